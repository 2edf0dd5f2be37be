//! Figures 10 to 13: friction of seals and guide.

use bench::{Kind, Picture};
use model_core::friction::{Bristle, FrictionLevels};
use std::f64::consts::TAU;

use super::Figure;
use crate::model::Values;
use crate::rig::Rig;

/// Growth with the mean gauge pressure and with the difference, N/bar: typical of 25 mm seals.
const PER_MEAN_N_BAR: f64 = 4.0;
const PER_DIFFERENCE_N_BAR: f64 = 1.5;
/// Amplitudes of the presliding loops, m.
const AMPLITUDES_M: [f64; 4] = [4e-6, 8e-6, 15e-6, 40e-6];

pub(super) fn figures(rig: &Rig) -> Vec<Figure> {
    let values = Values::<f64>::of(rig);
    let (levels, bristle) = (values.friction_levels(), values.bristle());
    vec![
        curve(&levels, &bristle),
        presliding(&levels, &bristle),
        pressures(&levels),
    ]
}

fn curve(levels: &FrictionLevels<f64>, bristle: &Bristle<f64>) -> Figure {
    let speeds =
        |fastest: f64| (1..=200).map(move |place| fastest * (f64::from(place) / 200.0).powi(2));
    let of = |fastest: f64| -> Vec<(f64, f64)> {
        let one = |speed: f64| (1e3 * speed, levels.steady_n(bristle, speed));
        speeds(fastest)
            .rev()
            .map(|speed| one(-speed))
            .chain(speeds(fastest).map(one))
            .collect()
    };
    let whole = Picture::new(
        "Friction over the speed",
        ("speed", "mm/s"),
        ("friction", "N"),
    )
    .with("(11) with the paper's numbers", Kind::Law, of(0.1));
    let marks = vec![
        (0.0, levels.static_n),
        (
            1e3 * bristle.stribeck_velocity_m_per_s,
            levels.sliding_n(bristle, bristle.stribeck_velocity_m_per_s),
        ),
    ];
    let slow = Picture::new("At low speed", ("speed", "mm/s"), ("friction", "N"))
        .with("(11)", Kind::Law, of(0.02))
        .with(
            "FS = 28.9 N at rest; vs = 5.03 mm/s",
            Kind::OtherPoints,
            marks,
        )
        .with(
            "FC = 20.2 N",
            Kind::Given,
            vec![(0.0, levels.coulomb_n), (20.0, levels.coulomb_n)],
        );
    Figure {
        number: "10, 11",
        title: "Friction over the speed, air ports open",
        says: "Friction rig, constant speeds up to 100 mm/s, ports open to the air; (11) fitted: sigma2 = 64.5 N s/m, FC = 20.2 N, FS = 28.9 N, vs = 5.03 mm/s.",
        assumed: "Nothing.",
        pictures: vec![whole, slow],
    }
}

fn presliding(levels: &FrictionLevels<f64>, bristle: &Bristle<f64>) -> Figure {
    const STEP_S: f64 = 1e-4;
    const HERTZ: f64 = 1.0;
    let mut picture = Picture::new(
        "Friction over the displacement",
        ("displacement", "µm"),
        ("friction", "N"),
    );
    for amplitude_m in AMPLITUDES_M {
        let mut deflection_m = 0.0;
        let mut points = Vec::new();
        for step in 0..20_000 {
            let angle = TAU * HERTZ * f64::from(step) * STEP_S;
            let speed = amplitude_m * TAU * HERTZ * angle.cos();
            let (next, force_n) = bristle.step_driven(levels, speed, deflection_m, STEP_S);
            deflection_m = next;
            if step % 25 == 0 {
                points.push((1e6 * amplitude_m * angle.sin(), force_n));
            }
        }
        picture = picture.with(format!("{:.0} µm", 1e6 * amplitude_m), Kind::Law, points);
    }
    let steady = (-100..=100).filter(|place| *place != 0).map(|place| {
        let speed = 2.6e-3 * f64::from(place) / 100.0;
        (1e3 * speed, levels.steady_n(bristle, speed))
    });
    let parts = Picture::new(
        "Where LuGre and its steady curve part",
        ("speed", "mm/s"),
        ("friction", "N"),
    )
    .with(
        "LuGre, sine of 200 µm at 2 Hz",
        Kind::Law,
        over_speed(levels, bristle),
    )
    .with("steady curve (11)", Kind::Given, steady.collect());
    Figure {
        number: "(9)",
        title: "Friction before break-away",
        says: "sigma0 = 9.14e5 N/m and sigma1 = 1327 N s/m from transient presliding at reversal, at 4 bar.",
        assumed: "Amplitudes of 4 to 40 µm at 1 Hz; the levels are those of open ports.",
        pictures: vec![picture, parts],
    }
}

/// Friction over the speed of a slow sine: at reversal the bristles turn over first.
fn over_speed(levels: &FrictionLevels<f64>, bristle: &Bristle<f64>) -> Vec<(f64, f64)> {
    const STEP_S: f64 = 5e-5;
    const HERTZ: f64 = 2.0;
    const AMPLITUDE_M: f64 = 2e-4;
    let mut deflection_m = 0.0;
    let mut points = Vec::new();
    for step in 0..20_000 {
        let speed = AMPLITUDE_M * TAU * HERTZ * (TAU * HERTZ * f64::from(step) * STEP_S).cos();
        let (next, force_n) = bristle.step_driven(levels, speed, deflection_m, STEP_S);
        deflection_m = next;
        // The first half settles.
        if step >= 10_000 && step % 10 == 0 {
            points.push((1e3 * speed, force_n));
        }
    }
    points
}

fn pressures(levels: &FrictionLevels<f64>) -> Figure {
    let line = |name: &str, per_bar: f64| {
        let mut picture = Picture::new(
            format!("Levels over the {name}"),
            (name, "bar"),
            ("friction", "N"),
        );
        for (what, level_n) in [("FS", levels.static_n), ("FC", levels.coulomb_n)] {
            let points = vec![(0.0, level_n), (6.0, level_n + 6.0 * per_bar)];
            picture = picture.with(what, Kind::Law, points);
        }
        picture
    };
    Figure {
        number: "12, 13",
        title: "Friction over the chamber pressures",
        says: "FC, FS and sigma2 grow nearly linearly with the chamber pressure and with the pressure difference; vs does not depend on them.",
        assumed: "The slopes, 4.0 N/bar and 1.5 N/bar (typical of 25 mm seals), the same for FC and FS: the text has no number. The paper's model uses the levels of open ports, so that this growth is missing in it.",
        pictures: vec![
            line("mean gauge pressure", PER_MEAN_N_BAR),
            line("pressure difference", PER_DIFFERENCE_N_BAR),
        ],
    }
}
