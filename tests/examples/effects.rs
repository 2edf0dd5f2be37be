//! Every effect of the list on half a page with its picture:
//! `cargo run --release -p tests --example effects` writes `docs/effects.md` and `docs/effects/`.

use diagnosis::compare::{LawComparison, compare_law};
use host_sim::closed_loop::{Course, HostController, Run, control_task, run};
use host_sim::effects::Effect;
use host_sim::laws::{Law, Track};
use host_sim::motion::{Limits, Motion, Segment};
use host_sim::plant::{self, Plant, PlantSettings};
use host_sim::recording::Recording;
use host_sim::rig::{ChamberModel, Rig};
use plotters::coord::Shift;
use plotters::prelude::*;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use tests::effects;

type Failure = Box<dyn Error + Send + Sync>;

const WITH: RGBColor = RGBColor(0x1f, 0x5f, 0xa8);
const WITHOUT: RGBColor = RGBColor(0x9a, 0x9a, 0x9a);
const INK: RGBColor = RGBColor(0x33, 0x33, 0x33);
/// Of a picture and of its upper panel, pixels.
const SIZE: (u32, u32) = (760, 400);
const UPPER: u32 = 190;
/// Every so many rows are drawn.
const DRAWN_ROWS: usize = 8;
/// The spool that the simulated valve has.
const SPOOL: [(&str, f64); 2] = [("natural_frequency_Hz", 100.0), ("damping_ratio", 0.7)];
/// What both chambers have at rest, nearly.
const REST_PA: f64 = 4.7e5;
/// Where the load moves about; a cushion is at the end of the stroke.
const NEAR_END_M: f64 = 0.18;

fn main() -> Result<(), Failure> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let docs = root.join("docs");
    std::fs::create_dir_all(docs.join("effects"))?;
    let rig = Rig::read(root.join("host-sim/rigs/paper.toml"))?;
    let all: Vec<&Effect> = effects::named().collect();
    let failures: Vec<String> = all
        .par_iter()
        .filter_map(|effect| {
            let file = docs.join(format!("effects/{}.svg", effect.name));
            let failure = draw(effect, &rig, &file).err()?;
            Some(format!("{}: {failure}", effect.name))
        })
        .collect();
    if !failures.is_empty() {
        return Err(failures.join("\n").into());
    }
    std::fs::write(docs.join("effects.md"), effects::page()?)?;
    println!("written: docs/effects.md and {} pictures", all.len());
    Ok(())
}

/// A run, as the loop has it and as a model without the effect predicts it.
struct Shown {
    run: Run,
    laws: Vec<LawComparison>,
}

fn shown(rig: &Rig, known: &Rig, centre_m: f64) -> Result<Shown, Failure> {
    let go = |to_m: f64| Segment::Move {
        to_m: centre_m + to_m,
    };
    let hold = |seconds: f64| Segment::Hold { seconds };
    let sine = Segment::Sine {
        amplitude_m: 0.03,
        frequency_hz: 1.0,
        periods: 3,
    };
    let segments = [
        hold(0.4),
        go(0.06),
        hold(0.9),
        go(-0.06),
        hold(0.9),
        sine,
        hold(0.3),
    ];
    let motion = Motion::new(centre_m, Limits::BRISK, &segments);
    let mut plant = Plant::new(rig, PlantSettings::at(centre_m, 1)).map_err(|f| f.problem)?;
    let mut drive = HostController::new(control_task(known).map_err(|fault| fault.problem)?);
    let course = Course::whole(motion, PlantSettings::TICK_S);
    let run = run(&mut plant, &mut drive, &course)?;
    let supply_pa = known.value("supply.pressure_Pa").ok_or("no supply")?;
    let recording = recorded(&run, supply_pa);
    let tracks = [Track::new(&recording)];
    let laws = [Law::Chambers, Law::Carriage];
    let laws = laws.into_iter().map(|law| compare_law(law, known, &tracks));
    Ok(Shown {
        laws: laws.collect::<Result<_, String>>()?,
        run,
    })
}

/// What a logger has of it; the supply is not recorded, but taken as stated.
fn recorded(run: &Run, supply_pa: f64) -> Recording {
    let seen = |row: &host_sim::closed_loop::Row| plant::seen(&row.sample.codes);
    let column = |value: &dyn Fn(&host_sim::closed_loop::Row) -> f64| -> Vec<f64> {
        run.rows.iter().map(value).collect()
    };
    let signals = BTreeMap::from([
        ("u".to_owned(), column(&|row| row.truth.command_v)),
        ("p_a".to_owned(), column(&|row| seen(row).pressure_a_pa)),
        ("p_b".to_owned(), column(&|row| seen(row).pressure_b_pa)),
        ("p_s".to_owned(), column(&|_| supply_pa)),
        ("x".to_owned(), column(&|row| seen(row).position_m)),
        ("v".to_owned(), column(&|row| seen(row).velocity_m_s)),
    ]);
    Recording::from_signals("run", column(&|row| row.truth.time_s), signals)
}

/// The rig without the effect, its spool that of the data sheet: nothing else is left out, and of the gas' temperature that it is
/// a reduced model's.
fn modelled(effect: &Effect, rig: &Rig) -> Rig {
    let spool = SPOOL.map(|(key, value)| (format!("effects.spool-dynamics.{key}"), value));
    let mut rig = rig.with_values(&spool.into_iter().collect());
    if let Some(chambers) = &mut rig.chambers
        && effect.name == "gas-temperature-dynamics"
    {
        chambers.model = ChamberModel::Polytropic;
        chambers.reference_pressure_pa = Some(REST_PA);
    }
    rig
}

fn draw(effect: &Effect, rig: &Rig, file: &Path) -> Result<(), Failure> {
    let sizes = effects::drawn(effect.name);
    if sizes.is_empty() {
        return Err("no size to draw it at".into());
    }
    let sizes = sizes.iter().map(|(key, value)| {
        let key = format!("effects.{}.{key}", effect.name);
        (key, *value)
    });
    let rig = &modelled(effect, rig);
    let with = rig.with_values(&sizes.collect());
    let centre_m = if effect.name == "end-cushion" {
        NEAR_END_M
    } else {
        0.0
    };
    let [with, without] = [&with, rig].map(|axis| shown(axis, rig, centre_m));
    let (with, without) = (with?, without?);
    let picture = SVGBackend::new(file, SIZE).into_drawing_area();
    picture.fill(&WHITE)?;
    let (upper, lower) = picture.split_vertically(UPPER);
    if let Some(row) = with.run.first_fault() {
        let (time_s, fault) = (row.truth.time_s, row.command.fault);
        return Err(format!("fault {fault} at {time_s} s: too large to be drawn").into());
    }
    let error_mm = |shown: &Shown| -> Vec<(f64, f64)> {
        let rows = shown.run.rows.iter().step_by(DRAWN_ROWS);
        rows.map(|row| (row.truth.time_s, 1e3 * row.error_m()))
            .collect()
    };
    panel(
        &upper,
        "load less reference, mm",
        [error_mm(&with), error_mm(&without)],
    )?;
    let (law, output) = most_telling(&with, &without);
    let signal = with.laws[law].signals[output].located.signal;
    let (unit, factor) = if signal == "x" {
        ("mm", 1e3)
    } else {
        ("kPa", 1e-3)
    };
    let misfit = |shown: &Shown| -> Vec<(f64, f64)> {
        let column = &shown.laws[law].residuals[output][0];
        let rows = shown.run.rows.iter().zip(column).step_by(DRAWN_ROWS);
        rows.map(|(row, misfit)| (row.truth.time_s, -factor * misfit))
            .collect()
    };
    let label = format!("{signal} recorded less predicted, {unit}");
    panel(&lower, &label, [misfit(&with), misfit(&without)])?;
    picture.present()?;
    Ok(())
}

/// Law and output whose misfit grows most by the effect, over the noise.
fn most_telling(with: &Shown, without: &Shown) -> (usize, usize) {
    let mut best = (0, 0);
    let mut most = f64::NEG_INFINITY;
    for (law, (sick, healthy)) in with.laws.iter().zip(&without.laws).enumerate() {
        for (output, (sick, healthy)) in sick.signals.iter().zip(&healthy.signals).enumerate() {
            let grown = sick.over_noise() / healthy.over_noise();
            if grown > most {
                (best, most) = ((law, output), grown);
            }
        }
    }
    best
}

/// Two curves over time, the one with the effect first.
fn panel(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    label: &str,
    [with, without]: [Vec<(f64, f64)>; 2],
) -> Result<(), Failure> {
    let all = with.iter().chain(&without);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut end_s = 0.0_f64;
    for (time_s, value) in all.filter(|(_, value)| value.is_finite()) {
        (low, high) = (low.min(*value), high.max(*value));
        end_s = end_s.max(*time_s);
    }
    let room = 0.06 * (high - low).max(1e-6);
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(16)
        .caption(label, ("sans-serif", 14).into_font().color(&INK))
        .x_label_area_size(24)
        .y_label_area_size(52)
        .build_cartesian_2d(0.0..end_s, low - room..high + room)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(0xe6, 0xe6, 0xe6))
        .axis_style(RGBColor(0xbb, 0xbb, 0xbb))
        .label_style(("sans-serif", 12).into_font().color(&INK))
        .x_labels(8)
        .y_labels(5)
        .x_label_formatter(&|time_s| format!("{time_s:.1} s"))
        .draw()?;
    for (points, colour) in [(without, WITHOUT), (with, WITH)] {
        let style = ShapeStyle::from(colour).stroke_width(if colour == WITH { 2 } else { 1 });
        chart.draw_series(LineSeries::new(points, style))?;
    }
    Ok(())
}
