//! A page with every element a report can have, on synthetic data.
//!
//! `cargo run -p host-sim --example report_gallery -- gallery.html`

use std::path::PathBuf;

use host_sim::report::{
    BarChart, Cell, Chart, ChartStack, Matrix, Page, Provenance, Role, Series, Table, number,
};

const SAMPLES: usize = 40_000;
const TIME_STEP_S: f64 = 0.000_5;

fn main() -> std::io::Result<()> {
    let path = std::env::args_os()
        .nth(1)
        .map_or_else(|| "gallery.html".into(), PathBuf::from);
    let page = gallery();
    page.write(&path)?;
    let size = number::bytes(std::fs::metadata(&path)?.len());
    println!("{} ({size})", path.display());
    Ok(())
}

fn gallery() -> Page {
    let mut page = Page::new("Report gallery");
    page.lead("The model omits the tube between valve and cylinder: 1.93 ± 0.06 m. Adding it reduces the held-out error from 6.9 to 1.72 psi rms.");
    page.tile(
        "held-out error",
        "1.72",
        "psi",
        "was 6.9 refitted, 7.4 as given",
    );
    page.tile("noise floor", "1.41", "psi", "lower limit for any model");
    page.tile("tube length", "1.93 ± 0.06", "m", "not in the model");
    page.tile("probability", "97", "%", "next: spool dynamics, 2 %");
    page.section("Where the misfit sits", |section| {
        section.text("Both chambers lag behind the model after every step of the command. The shaded intervals contain 93 % of the misfit of chamber A pressure. All panels share zoom and cursor.");
        section.chart(recording());
        section.chart(phase_portrait());
    });
    page.section("What it is", |section| {
        section.bars(ranking());
        section.row(|row| {
            row.chart(residuals());
            row.chart(spectrum());
        });
        section.callout("These recordings cannot distinguish tube line and valve delay: record a sine sweep up to 20 Hz.");
    });
    page.section("How well it fits", |section| {
        section.bars(errors());
        section.table(parameters());
        section.subheading("Seen on other machines");
        section.matrix(confusion());
        section.matrix(correlations());
    });
    page.section("Words", |section| {
        section.definitions([
            ("as given", "the model with the parameters it came with"),
            (
                "refitted",
                "the same model, its ordinary parameters fitted to the training recordings",
            ),
            ("improved", "the refitted model with what was missing"),
        ]);
        section.list(["a list has items", "and each is a sentence"]);
        section.details("All charts that failed", |details| {
            details.text("A chart without usable data says so.");
            details.chart(broken());
        });
        section.details("The rig file", |details| {
            details.code("[valve]\nnull_V = 5.06   # <given>");
        });
    });
    page.provenance(provenance());
    page
}

fn provenance() -> Provenance {
    Provenance::new("pneuma diagnose --rig rig.toml --train train-1.csv --json verdict.json --report report.html --seed 7")
        .fact("version", env!("CARGO_PKG_VERSION"))
        .fact("seed", 7)
        .file("train-1.csv", 3_481_200, "b3:8f14e45fceea167a")
        .file("rig.toml", 812, "b3:c9f0f895fb98ab91")
}

/// Noise that is the same on every run and needs no crate.
fn noise(index: usize) -> f64 {
    let hash = |seed: u64| {
        let mixed = (seed ^ (seed >> 31)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((mixed ^ (mixed >> 32)) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let seed = index as u64 * 4 + 1;
    hash(seed) + hash(seed + 1) + hash(seed + 2) + hash(seed + 3)
}

fn times() -> impl Iterator<Item = f64> {
    (0..SAMPLES).map(|index| index as f64 * TIME_STEP_S)
}

/// A square wave, smoothed: what a chamber does after steps of the valve.
fn pressure(time_s: f64, lag_s: f64) -> f64 {
    let phase_s = time_s.rem_euclid(4.0);
    let rise = |since_s: f64| 1.0 - (-since_s.max(0.0) / lag_s).exp();
    320.0 + 180.0 * (rise(phase_s) - rise(phase_s - 2.0)) + 6.0 * (time_s * 0.9).sin()
}

fn recording() -> ChartStack {
    let recorded = times()
        .enumerate()
        .map(|(index, time)| (time, pressure(time, 0.12) + 4.0 * noise(index)));
    let given = times().map(|time| (time, pressure(time, 0.05) + 9.0));
    let refitted = times().map(|time| (time, pressure(time, 0.08)));
    let improved = times().map(|time| (time, pressure(time, 0.118)));
    let uncertain = times().map(|time| {
        let middle = pressure(time, 0.118);
        (time, middle - 7.0, middle + 7.0)
    });
    let pressure_panel = Chart::new("Chamber A")
        .y_axis("pressure", "kPa")
        .band("improved ± 2σ", Role::Improved, uncertain)
        .series(Series::new("recorded", Role::Recorded, recorded))
        .series(Series::new("as given", Role::Given, given).dashed())
        .series(Series::new("refitted", Role::Refitted, refitted).dashed())
        .series(Series::new("improved", Role::Improved, improved))
        .height(230);
    let misfit = |lag: f64, offset: f64| {
        move |(index, time): (usize, f64)| {
            (
                time,
                pressure(time, lag) + offset - pressure(time, 0.12) - 4.0 * noise(index),
            )
        }
    };
    let misfit_panel = Chart::new("Misfit")
        .y_axis("model − recorded", "kPa")
        .series(Series::new(
            "refitted",
            Role::Refitted,
            times().enumerate().map(misfit(0.08, 0.0)),
        ))
        .series(Series::new(
            "improved",
            Role::Improved,
            times().enumerate().map(misfit(0.118, 0.0)),
        ))
        .level(0.0, "");
    let command = times()
        .step_by(40)
        .map(|time| (time, if time.rem_euclid(4.0) < 2.0 { 6.2 } else { 3.9 }));
    let command_panel = Chart::new("Valve")
        .x_axis("time", "s")
        .y_axis("command", "V")
        .series(Series::new("command", Role::Recorded, command).step())
        .height(90);
    ChartStack::new("Training recording 1, 40,000 rows")
        .panel(pressure_panel)
        .panel(misfit_panel)
        .panel(command_panel)
        .interval(4.0, 4.5, "after each step")
        .interval(6.0, 6.5, "")
        .interval(12.0, 12.5, "and here, where the piston also starts to move")
        .note("Long series keep first, lowest, highest and last point of every bucket.")
}

fn phase_portrait() -> Chart {
    let loop_of = |width: f64, scatter: f64| {
        (0..3_000).map(move |index| {
            let angle = index as f64 * 0.02;
            let velocity = 120.0 * angle.sin();
            let friction = 40.0 * (velocity / 8.0).tanh() + 0.12 * velocity + width * angle.cos();
            (velocity, friction + scatter * noise(index))
        })
    };
    Chart::new("Friction over velocity: a phase portrait zooms by box")
        .x_axis("velocity", "mm/s")
        .y_axis("friction force", "N")
        .series(Series::new("recorded", Role::Recorded, loop_of(9.0, 6.0)).dots())
        .series(Series::new("improved", Role::Improved, loop_of(9.0, 0.0)))
        .series(Series::new("as given", Role::Given, loop_of(0.0, 0.0)).dashed())
}

fn residuals() -> Chart {
    let samples: Vec<f64> = (0..SAMPLES).map(|index| 4.0 * noise(index)).collect();
    let bell = |sigma: f64| {
        (-120..=120).map(move |step| {
            let x = f64::from(step) * 0.06;
            let height =
                (-0.5 * (x / sigma).powi(2)).exp() / (sigma * std::f64::consts::TAU.sqrt());
            (x, height)
        })
    };
    Chart::new("Misfit of the improved model")
        .x_axis("misfit", "kPa")
        .y_axis("density", "1/kPa")
        .series(Series::histogram("misfit", Role::Improved, &samples, 48))
        .series(Series::new("noise alone", Role::Noise, bell(2.31)))
}

fn spectrum() -> Chart {
    let bins = || (1..20_000).map(|bin| f64::from(bin) * 0.05);
    let power = |frequency: f64, corner: f64, index: usize| {
        (1.0 / (1.0 + (frequency / corner).powi(4)) + 1e-5) * (1.0 + 0.8 * noise(index))
    };
    Chart::new("Spectrum")
        .x_axis("frequency", "Hz")
        .y_axis("power density", "kPa²/Hz")
        .logarithmic_x()
        .logarithmic_y()
        .series(Series::new(
            "refitted",
            Role::Refitted,
            bins().enumerate().map(|(i, f)| (f, power(f, 8.0, i))),
        ))
        .series(Series::new(
            "improved",
            Role::Improved,
            bins()
                .enumerate()
                .map(|(i, f)| (f, 0.05 * power(f, 8.0, i))),
        ))
        .level(1e-5, "noise floor")
        .interval(6.0, 12.0, "tube")
}

fn ranking() -> BarChart {
    let names = [
        "tube-line",
        "valve-delay",
        "spool-dynamics",
        "direction-dependent-friction",
        "none of these",
    ];
    BarChart::new("What is missing, by probability", names)
        .axis("probability", "")
        .bars_with_errors(
            "probability",
            Role::Improved,
            [
                (0.71, 0.05),
                (0.22, 0.06),
                (0.04, 0.02),
                (0.01, 0.01),
                (0.02, 0.01),
            ],
        )
}

fn errors() -> BarChart {
    BarChart::new(
        "Error over 0.25 s, held-out recordings",
        ["pressure A", "pressure B", "position"],
    )
    .axis("error / standard deviation of the signal", "")
    .bars("as given", Role::Given, [0.31, 0.28, 0.17])
    .bars("refitted", Role::Refitted, [0.24, 0.21, 0.12])
    .bars("improved", Role::Improved, [0.081, 0.077, 0.043])
    .bars("noise floor", Role::Noise, [0.066, 0.064, 0.031])
}

fn parameters() -> Table {
    Table::new(["parameter", "given", "refitted", "improved", "unit"])
        .caption("Parameters before and after")
        .row([
            "`valve.null_V`".into(),
            Cell::number(5.06, 3),
            Cell::number(5.071, 3),
            Cell::with_deviation(5.058, 0.002, 3),
            "V".into(),
        ])
        .row([
            "`friction.coulomb_n`".into(),
            Cell::number(41.0, 1),
            Cell::number(55.2, 1),
            Cell::with_deviation(40.1, 0.9, 1),
            "N".into(),
        ])
        .emphasised_row([
            "`tube.length_m`".into(),
            None::<f64>.into(),
            None::<f64>.into(),
            Cell::with_deviation(1.93, 0.06, 2),
            "m".into(),
        ])
}

fn confusion() -> Matrix {
    let effects = [
        "tube-line",
        "valve-delay",
        "spool-dynamics",
        "piston-leakage",
        "coulomb-friction",
        "nothing",
        "unknown",
    ];
    let cell = |row: usize, column: usize| {
        let distance = row.abs_diff(column) as f64;
        if distance > 2.0 {
            0.0
        } else {
            0.9 * (-2.2 * distance).exp() + 0.04 * noise(row * 7 + column).abs()
        }
    };
    let cells = (0..7)
        .map(|row| (0..7).map(|column| cell(row, column)).collect())
        .collect();
    Matrix::new("How often each effect was named", effects, effects, cells)
        .axes("missing in truth", "named")
        .full_shade(1.0)
        .note("Shares of 400 synthetic machines per row.")
}

fn correlations() -> Matrix {
    let names = ["null", "gain", "length", "friction"];
    let cells = vec![
        vec![1.0, -0.42, 0.11, 0.03],
        vec![-0.42, 1.0, -0.87, f64::NAN],
        vec![0.11, -0.87, 1.0, 0.21],
        vec![0.03, f64::NAN, 0.21, 1.0],
    ];
    Matrix::new("Correlations of the estimates", names, names, cells).full_shade(1.0)
}

fn broken() -> Chart {
    Chart::new("A column named </script><img src=x onerror=alert(1)>")
        .x_axis("<b>time</b>", "s")
        .y_axis("nothing", "")
        .series(Series::new(
            "</script><img onerror=alert(1)>",
            Role::Given,
            [(f64::NAN, 1.0), (2.0, f64::INFINITY)],
        ))
        .height(120)
}
