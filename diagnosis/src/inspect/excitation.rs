//! How much of the rig's range a recording visits.

use serde::Serialize;

use super::SignalReport;
use crate::inspect::statistics::as_float;
use crate::recording::Recording;
use crate::rig::Rig;

/// Rows over which a displacement is judged.
const WINDOW_ROWS: usize = 10;
/// A displacement over the window above this many times the noise is motion.
const MOTION_NOISE: f64 = 5.0;
/// A displacement below this share of the largest one is rest.
const REST_SHARE: f64 = 0.002;
/// A rest lasts at least this many rows.
const REST_ROWS: usize = 20;

/// What a recording excites; `None` where the signals do not tell.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Excitation {
    /// Largest minus smallest position, in the unit of `x`.
    pub stroke_span: Option<f64>,
    /// Share of the rows at rest.
    pub stick_fraction: Option<f64>,
    /// Changes of direction, with or without a rest between.
    pub reversals: Option<usize>,
    /// Rests of at least 20 rows.
    pub rests: Option<usize>,
    /// Smallest and largest command minus null, V.
    pub opening_span_v: Option<[f64; 2]>,
    /// Smallest and largest `p_a` over the supply pressure.
    pub pressure_ratio_a: Option<[f64; 2]>,
    /// Smallest and largest `p_b` over the supply pressure.
    pub pressure_ratio_b: Option<[f64; 2]>,
}

pub(super) fn excitation(rig: &Rig, recording: &Recording, signals: &[SignalReport]) -> Excitation {
    let position = recording.signal("x");
    let report = signals.iter().find(|signal| signal.name == "x");
    let motion = position.zip(report).map(|(x, report)| motion(x, report));
    let motion = motion.as_ref();
    Excitation {
        stroke_span: report.map(|report| report.maximum - report.minimum),
        stick_fraction: motion.map(|motion| {
            let still = motion.iter().filter(|direction| **direction == 0).count();
            as_float(still) / as_float(motion.len().max(1))
        }),
        reversals: motion.map(|motion| reversals(motion)),
        rests: motion.map(|motion| rests(motion)),
        opening_span_v: opening_span(rig, recording),
        pressure_ratio_a: pressure_ratio(rig, recording, "p_a"),
        pressure_ratio_b: pressure_ratio(rig, recording, "p_b"),
    }
}

/// The direction of motion in each window: -1, 0 (rest) or 1.
fn motion(position: &[f64], report: &SignalReport) -> Vec<i8> {
    let moved: Vec<f64> = position
        .windows(WINDOW_ROWS + 1)
        .map(|window| window[WINDOW_ROWS] - window[0])
        .collect();
    let largest = moved.iter().fold(0.0_f64, |most, one| most.max(one.abs()));
    let quantum = report.quantum.unwrap_or(0.0);
    let noise = match report.declared_noise {
        Some(declared) if !report.noise_visible => declared,
        _ => report.noise,
    };
    let threshold = (MOTION_NOISE * noise)
        .max(1.5 * quantum)
        .max(REST_SHARE * largest);
    moved
        .iter()
        .map(|moved| match moved {
            up if *up > threshold => 1,
            down if *down < -threshold => -1,
            _ => 0,
        })
        .collect()
}

fn reversals(motion: &[i8]) -> usize {
    let moving: Vec<i8> = motion.iter().copied().filter(|one| *one != 0).collect();
    moving.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

fn rests(motion: &[i8]) -> usize {
    motion
        .chunk_by(|left, right| left == right)
        .filter(|stretch| stretch[0] == 0 && stretch.len() >= REST_ROWS)
        .count()
}

fn opening_span(rig: &Rig, recording: &Recording) -> Option<[f64; 2]> {
    let null_v = rig.valve.as_ref()?.null_v;
    let command = recording.signal("u")?;
    span(command.iter().map(|command_v| command_v - null_v))
}

fn pressure_ratio(rig: &Rig, recording: &Recording, chamber: &str) -> Option<[f64; 2]> {
    let chamber = recording.signal(chamber)?;
    if let Some(supply) = recording.signal("p_s") {
        let pairs = chamber
            .iter()
            .zip(supply)
            .filter(|(_, supply)| **supply > 0.0);
        return span(pairs.map(|(chamber, supply)| chamber / supply));
    }
    let supply_pa = rig.supply.as_ref()?.pressure_pa;
    span(chamber.iter().map(|chamber| chamber / supply_pa))
}

fn span(values: impl Iterator<Item = f64> + Clone) -> Option<[f64; 2]> {
    let low = values.clone().reduce(f64::min)?;
    let high = values.reduce(f64::max)?;
    Some([low, high])
}
