//! Channels that show noise and nothing else while others prove motion: a broken wire on a floating
//! input, a gauge with its cock closed, two channels wired to one sensor.

use super::SignalReport;
use super::fault::{Fault, FaultKind, at_odds_as, floor};
use super::statistics::{moved, quantile};
use crate::recording::Recording;
use crate::rig::Rig;

/// White noise has 99.9 % of its rows within so many deviations either way ...
const WIDTH_OF_NOISE: f64 = 3.3;
/// ... and drift and rounding add this to it at the most.
const DRIFT: f64 = 1.5;
/// The carriage moves over this part of its stroke, and the other chamber by this part of its
/// pressure.
const MOVED: f64 = 0.1;
/// The path of the velocity is this many times what the position moves, window by window.
const TIMES_MOVED: f64 = 5.0;
/// Fewer windows hold a rest in which noise and creep are alike.
const LEAST_WINDOWS: usize = 40;
/// Rows of a window.
const ROWS: usize = 25;

pub(super) fn lifeless(rig: &Rig, recording: &Recording, signals: &[SignalReport]) -> Vec<Fault> {
    let mut faults: Vec<Fault> = Vec::new();
    faults.extend(one_sensor_twice(recording));
    if rig.valve.is_some() && moves(rig, recording) {
        let chambers = [("p_a", "p_b"), ("p_b", "p_a")].into_iter();
        faults.extend(chambers.filter_map(|pair| only_noise(recording, signals, pair)));
    }
    faults.extend(position_or_velocity(recording, signals));
    faults
}

/// Both chambers from one gauge: no two gauges have the same noise.
fn one_sensor_twice(recording: &Recording) -> Option<Fault> {
    let (a, b) = (recording.signal("p_a")?, recording.signal("p_b")?);
    let is_same = a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
    let changes = a
        .windows(2)
        .any(|pair| pair[0].to_bits() != pair[1].to_bits());
    (is_same && changes).then(|| {
        let said = "repeats p_a in every row: both columns are of one sensor";
        at_odds_as(FaultKind::Inconsistent, recording, "p_b", said)
    })
}

fn span(values: &[f64]) -> f64 {
    quantile(&mut values.to_vec(), 0.9995) - quantile(&mut values.to_vec(), 0.0005)
}

fn moves(rig: &Rig, recording: &Recording) -> bool {
    let stroke_m = rig.cylinder.as_ref().and_then(|cylinder| cylinder.stroke_m);
    let moved = recording.signal("x").zip(stroke_m);
    moved.is_some_and(|(position, stroke_m)| span(position) > MOVED * stroke_m)
}

/// A chamber that does not answer a carriage that moves and another chamber that does.
fn only_noise(
    recording: &Recording,
    signals: &[SignalReport],
    (own, other): (&str, &str),
) -> Option<Fault> {
    let report = signals.iter().find(|report| report.name == own)?;
    let [own_values, other_values] = [own, other].map(|name| recording.signal(name));
    let (own_values, other_values) = (own_values?, other_values?);
    let width = 2.0 * WIDTH_OF_NOISE * report.noise + 2.0 * report.quantum.unwrap_or(0.0);
    let other_median = quantile(&mut other_values.to_vec(), 0.5);
    let is_silent = report.noise > 0.0 && span(own_values) < DRIFT * width;
    let other_answers = span(other_values) > (MOVED * other_median).max(DRIFT * width);
    (is_silent && other_answers).then(|| {
        let said = format!(
            "shows noise of {:.3e} Pa about {:.3} bar and nothing else while x and {other} move: \
             a broken wire, or a gauge that is shut off",
            report.noise,
            quantile(&mut own_values.to_vec(), 0.5) / super::BAR_PA
        );
        at_odds_as(FaultKind::Dead, recording, own, &said)
    })
}

/// A position that stands while the velocity runs, or the other way round.
fn position_or_velocity(recording: &Recording, signals: &[SignalReport]) -> Option<Fault> {
    let of = |name: &str| signals.iter().find(|report| report.name == name);
    let (position, velocity) = (of("x")?, of("v")?);
    let windows = moved(recording, ROWS)?;
    if windows.len() < LEAST_WINDOWS {
        return None;
    }
    let rms = |of: &dyn Fn(f64, f64) -> f64| {
        let squares: f64 = windows.iter().map(|one| of(one.moved_m, one.path_m)).sum();
        (squares / windows.len().max(1) as f64).sqrt()
    };
    let moved_m = rms(&|moved_m, _| moved_m * moved_m);
    let path_m = rms(&|_, path_m| path_m * path_m);
    let both: f64 = windows.iter().map(|one| one.moved_m * one.path_m).sum();
    let correlation = both / (windows.len() as f64 * moved_m * path_m).max(f64::MIN_POSITIVE);
    // Noise of two rows stands in what a window moved, and in the path that of all of them.
    let seconds = windows.first()?.seconds;
    let position_m = 2.0_f64.sqrt() * position.noise + position.quantum.unwrap_or(0.0);
    let path_noise_m = velocity.noise * seconds / (ROWS as f64).sqrt();
    let is_noise = |rms_m: f64, noise_m: f64| rms_m < 2.0 * noise_m.max(f64::MIN_POSITIVE);
    if correlation.abs() > 0.5 {
        return None;
    }
    let (signal, still, moving) = if path_m > TIMES_MOVED * moved_m
        && is_noise(moved_m, position_m)
        && path_m > floor(position)
    {
        ("x", "x", "v")
    } else if moved_m > TIMES_MOVED * path_m
        && is_noise(path_m, path_noise_m)
        && moved_m > floor(position)
    {
        ("v", "v", "x")
    } else {
        return None;
    };
    let said = format!(
        "shows noise and nothing else while {moving} moves: {still} is dead, or its wire is broken"
    );
    Some(at_odds_as(FaultKind::Dead, recording, signal, &said))
}
