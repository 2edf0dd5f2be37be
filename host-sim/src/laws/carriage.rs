//! A free carriage driven by recorded pressures, predicting its position.

use super::{InitialState, Output, Sink, Track, View};
use crate::model::Values;
use crate::recording::Recording;
use model_core::carriage::CarriageState;
use model_core::real::Real;
use std::ops::Range;

/// The longest step, s: friction is first order in the step, and at 1 ms its
/// error is several times the noise of a good position sensor (measured: 5 mm/s
/// against 1.6 mm/s rms of velocity).
const LONGEST_STEP_S: f64 = 2.5e-4;
/// Motion before a window from which the bristle's deflection is found, s.
const WARM_UP_S: f64 = 0.1;

pub(super) const OUTPUT: Output = Output {
    signal: "x",
    place: "force-balance",
    unit: "m",
};

pub(super) fn initial_states(recording: &Recording, row: usize, view: View) -> Vec<InitialState> {
    let time = &recording.time_s;
    let position = recording.signal("x").unwrap_or(&[]);
    let (x, slope) = view.value_and_slope(time, position, row);
    let velocity = match recording.signal("v") {
        Some(v) => view.value(time, v, row),
        None => slope,
    };
    let state = |name, guess, standard_deviation, measured_by| InitialState {
        name,
        guess,
        standard_deviation,
        bounds: (-1e3, 1e3),
        measured_by,
    };
    vec![
        state("x", x, 1e-3, Some(0)),
        state("v", velocity, 1e-2, Some(0)),
    ]
}

pub(super) fn predict<R: Real>(
    values: &Values<'_, R>,
    track: &Track<'_>,
    rows: Range<usize>,
    initial: &[R],
    sink: &mut impl Sink<R>,
) {
    let (Some(a), Some(b)) = (track.signal("p_a"), track.signal("p_b")) else {
        return;
    };
    let carriage = values.carriage();
    let (declared, terms) = (values.friction_levels(), values.friction_terms());
    let ambient = carriage.ambient_pressure_pa;
    let mut state = CarriageState::new(initial[0], initial[1]);
    state.deflection_m = warm_deflection(values, track, rows.start);
    sink.row(rows.start, &[initial[0]], initial);
    for row in rows.start..rows.end.saturating_sub(1) {
        let dt_s = track.dt_s(row);
        let steps = (dt_s / LONGEST_STEP_S - 1e-9).ceil().max(1.0);
        let step_s = R::from_f64(dt_s / steps);
        for step in 0..steps as u32 {
            let share = (f64::from(step) + 0.5) / steps;
            let between = |p: &[f64]| R::from_f64(p[row] + share * (p[row + 1] - p[row]));
            let (p_a, p_b) = (between(a), between(b));
            let levels = terms.levels(&declared, p_a - ambient, p_b - ambient);
            let drive = carriage.drive_n(p_a, p_b) - terms.constant_force_n;
            carriage.step(&mut state, &levels, drive, step_s);
        }
        let position = state.position_m.value;
        sink.row(row + 1, &[position], &[position, state.velocity_m_per_s]);
    }
}

/// Deflection of the bristle at a row, driven by the recorded motion before it.
fn warm_deflection<R: Real>(values: &Values<'_, R>, track: &Track<'_>, row: usize) -> R {
    let Some(motion) = track.motion.as_ref() else {
        return R::ZERO;
    };
    let (bristle, levels) = (values.bristle(), values.friction_levels());
    let time = &track.recording.time_s;
    let from = time.partition_point(|&instant| instant < time[row] - WARM_UP_S);
    let mut deflection = R::ZERO;
    for earlier in from..row {
        let way = motion.position_m[earlier + 1] - motion.position_m[earlier];
        let dt_s = track.dt_s(earlier);
        let velocity = R::from_f64(way / dt_s);
        (deflection, _) = bristle.step_driven(&levels, velocity, deflection, R::from_f64(dt_s));
    }
    deflection
}
