//! The figures of recordings from which effects take the starts and boxes of their parameters.

use crate::effects::{ChamberGas, Scene};
use crate::laws::{Law, Track, white_noise};
use crate::model::{Side, Values};
use crate::rig::{PositionZero, Rig};

/// What the declarations of effects read. `misfit` is a force where the law is one of a bench.
pub fn scene<'a>(law: Law, rig: &'a Rig, tracks: &[Track<'_>], misfit: f64) -> Scene<'a> {
    let sides = Side::BOTH.into_iter();
    let recorded = |side: &Side| rig.signals.contains(side.pressure_signal());
    let [gas_a, gas_b] = Side::BOTH.map(|side| chamber_gas(rig, tracks, side));
    let ends = tracks.iter();
    let ends = ends.filter_map(|track| track.recording.time_s.last().copied());
    Scene {
        law,
        rig,
        sides: sides.filter(recorded).collect(),
        row_s: row_s(tracks),
        // On a free carriage the misfit is a length; a newton is a fair start there.
        misfit_n: if law == Law::Force { misfit } else { 1.0 },
        gas_a,
        gas_b,
        decay_begins_s: tracks.iter().find_map(departure),
        end_s: ends.fold(0.0, f64::max),
        fastest_per_s: fastest_per_s(tracks),
        typical_speed_m_s: motion_speed(tracks),
        nearest_end_m: nearest_end_m(rig, tracks),
        highest_pressure_pa: highest_pressure_pa(tracks),
    }
}

/// Median time from row to row over all recordings, s.
fn row_s(tracks: &[Track<'_>]) -> f64 {
    let steps = |track: &Track<'_>| crate::laws::median_step_s(&track.recording.time_s);
    tracks.iter().map(steps).fold(f64::INFINITY, f64::min)
}

/// A chamber's gas in mid-recording.
fn chamber_gas(rig: &Rig, tracks: &[Track<'_>], side: Side) -> Option<ChamberGas> {
    let values = Values::of(rig);
    let chamber = values.chamber(side)?;
    let track = tracks.first()?;
    let middle = track.len() / 2;
    let position = track.recording.signal("x").map_or(0.0, |x| x[middle]);
    let pressure_pa = track.recording.signal(side.pressure_signal())?[middle];
    let temperature_k = values.ambient().temperature_k;
    let volume_m3 = chamber.geometry.volume_m3(position);
    let gas = values.gas();
    let mass_kg = pressure_pa * volume_m3 / (gas.gas_constant_j_per_kg_k * temperature_k);
    let specific = gas.gas_constant_j_per_kg_k / (gas.heat_capacity_ratio - 1.0);
    Some(ChamberGas {
        mass_kg,
        capacity_j_k: mass_kg * specific,
        pressure_pa,
        choked_kg_s_m2: 0.82 * gas.flow_coefficient * pressure_pa / temperature_k.sqrt(),
    })
}

/// The last instant before which the pressure stood within 1 % of its whole
/// fall; `None` where that cannot be told from noise, or where the pressure
/// falls from the first row on.
fn departure(track: &Track<'_>) -> Option<f64> {
    let pressure = track.recording.signal("p_a")?;
    let (first, last) = (*pressure.first()?, *pressure.last()?);
    let step = 0.01 * (first - last);
    if step < 3.0 * white_noise(pressure) {
        return None;
    }
    let row = pressure.iter().position(|&p| p < first - step)?;
    (row > 1).then(|| track.recording.time_s[row - 1])
}

/// The highest speed of any recording's position or stem.
fn fastest_per_s(tracks: &[Track<'_>]) -> f64 {
    let speed = |track: &Track<'_>| fastest(track.recording.signal("x")?, &track.recording.time_s);
    tracks.iter().filter_map(speed).fold(0.0, f64::max)
}

/// The highest speed of a signal, by its 99.5th percentile.
fn fastest(signal: &[f64], time_s: &[f64]) -> Option<f64> {
    let mut speeds: Vec<f64> = signal
        .windows(2)
        .zip(time_s.windows(2))
        .map(|(x, t)| ((x[1] - x[0]) / (t[1] - t[0])).abs())
        .collect();
    let rank = (speeds.len() * 199 / 200).min(speeds.len().checked_sub(1)?);
    Some(*speeds.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// How near the carriage comes to an end of its stroke, m.
fn nearest_end_m(rig: &Rig, tracks: &[Track<'_>]) -> Option<f64> {
    let stroke = rig.value("cylinder.stroke_m")?;
    let low = match rig.cylinder.as_ref()?.position_zero? {
        PositionZero::MidStroke => -0.5 * stroke,
        PositionZero::EndA => 0.0,
    };
    let nearest = tracks
        .iter()
        .filter_map(|track| track.recording.signal("x"))
        .flatten()
        .map(|x| (x - low).min(low + stroke - x))
        .fold(f64::INFINITY, f64::min);
    nearest.is_finite().then_some(nearest.max(0.0))
}

/// The highest pressure of chamber A, Pa, at least one bar.
fn highest_pressure_pa(tracks: &[Track<'_>]) -> f64 {
    let recorded = tracks
        .iter()
        .filter_map(|track| track.recording.signal("p_a"));
    recorded
        .flatten()
        .fold(1e5_f64, |most, &pressure_pa| most.max(pressure_pa))
}

/// A typical speed of the recordings, m/s.
fn motion_speed(tracks: &[Track<'_>]) -> f64 {
    let mut speeds: Vec<f64> = tracks
        .iter()
        .filter_map(|track| track.motion.as_ref())
        .flat_map(|motion| motion.velocity_m_per_s.iter().map(|v| v.abs()))
        .collect();
    if speeds.is_empty() {
        return 1.0;
    }
    let rank = speeds.len() * 9 / 10;
    speeds
        .select_nth_unstable_by(rank, f64::total_cmp)
        .1
        .max(1e-6)
}
