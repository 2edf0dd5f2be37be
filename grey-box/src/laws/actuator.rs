//! A positioner-driven stem: command in, position out.
//!
//! ```text
//! target = s0 + (s1 - s0) u(t - d), through the play
//! s'     = (target - s)/tau, limited to -falling .. +rising
//! ```
//!
//! The command holds from row to row; the rate limit acts between rows as well,
//! hence the fine steps.

use super::{InitialState, Output, Sink, Track};
use crate::effects::flow::{slew_limit, valve_delay, valve_hysteresis};
use crate::model::Values;
use crate::recording::Recording;
use model_core::real::Real;
use std::ops::Range;

/// The finest step is this part of a row's length: the instant at which a
/// delayed command changes is then met within a tenth of a row.
const STEPS_PER_ROW: u32 = 10;

pub(super) const OUTPUT: Output = Output {
    signal: "x",
    place: "valve-command",
    unit: "1",
};

pub(super) fn initial_states(recording: &Recording, row: usize) -> Vec<InitialState> {
    let guess = recording
        .signal("x")
        .and_then(|x| x.get(row).copied())
        .unwrap_or(0.0);
    vec![InitialState {
        name: "stem",
        guess,
        standard_deviation: 0.02,
        bounds: (-1.0, 2.0),
        measured_by: Some(0),
        read_by: None,
    }]
}

pub(super) fn predict<R: Real>(
    values: &Values<'_, R>,
    track: &Track<'_>,
    rows: Range<usize>,
    initial: &[R],
    sink: &mut dyn Sink<R>,
) {
    let Some(command) = track.signal("u") else {
        return;
    };
    let time = &track.recording.time_s;
    let closed = values.get_or("actuator.stem_at_zero_command", 0.0);
    let open = values.get_or("actuator.stem_at_full_command", 1.0);
    let lag_s = values.get_or("actuator.time_constant_s", 0.0);
    let delay_s = valve_delay::law(values).delay_s;
    let (slew, play) = (slew_limit::law(values), valve_hysteresis::law(values));
    let target = |command: R| closed + (open - closed) * command;
    let mut stem = initial[0];
    let mut played = target(R::from_f64(command[rows.start]));
    sink.row(rows.start, &[stem], &[stem]);
    for row in rows.start..rows.end.saturating_sub(1) {
        let step_s = track.dt_s(row) / f64::from(STEPS_PER_ROW);
        let dt = R::from_f64(step_s);
        let follow = if lag_s > R::ZERO {
            R::ONE - (-(dt / lag_s)).exp()
        } else {
            R::ONE
        };
        for step in 0..STEPS_PER_ROW {
            let from = time[row] + step_s * f64::from(step);
            let held = held_mean(time, command, R::from_f64(from) - delay_s, step_s);
            played = play.step(played, target(held));
            let wanted = stem + follow * (played - stem);
            (stem, _) = slew.step(stem, wanted, dt);
        }
        sink.row(row + 1, &[stem], &[stem]);
    }
}

/// Mean over `from..from + length` of a command that holds from row to row.
fn held_mean<R: Real>(time_s: &[f64], command: &[f64], from: R, length_s: f64) -> R {
    let row_at = |instant: f64| {
        time_s
            .partition_point(|&time| time <= instant)
            .saturating_sub(1)
    };
    let end = from + R::from_f64(length_s);
    let (first, last) = (row_at(from.value()), row_at(end.value()));
    let mut sum = R::ZERO;
    let mut start = from;
    for row in first..last {
        let change = R::from_f64(time_s[row + 1]);
        sum += (change - start) * R::from_f64(command[row]);
        start = change;
    }
    (sum + (end - start) * R::from_f64(command[last])) / R::from_f64(length_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_held_mean_weighs_the_part_after_the_change() {
        let mean = held_mean(&[0.0, 1.0, 2.0], &[5.0, 7.0, 9.0], 0.75_f64, 0.5);
        assert!((mean - 6.0).abs() < 1e-12);
        assert!((held_mean(&[0.0, 1.0], &[5.0, 7.0], -3.0_f64, 1.0) - 5.0).abs() < 1e-12);
        assert!((held_mean(&[0.0, 1.0], &[5.0, 7.0], 8.0_f64, 1.0) - 7.0).abs() < 1e-12);
    }
}
