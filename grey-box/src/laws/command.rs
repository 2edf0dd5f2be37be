//! The spool's way behind a recorded command.

use crate::effects::flow::valve_hysteresis;
use crate::model::Values;
use model_core::axis::CommandState;
use model_core::real::Real;
use std::ops::Range;

/// History of the command that is run through before a window, s: longer than
/// any delay or lag of a valve ...
const COMMAND_WARM_UP_S: f64 = 0.2;
/// ... and with a play, which stays until the command has come back across it.
const PLAY_WARM_UP_S: f64 = 5.0;

/// The spool's position over each row of the range, after a run through the
/// command before it; before the first row that is `earlier`.
pub(super) fn spool_positions<R: Real>(
    values: &Values<'_, R>,
    (time_s, command): (&[f64], &[f64]),
    rows: &Range<usize>,
    earlier: R,
) -> Vec<R> {
    let step_s = super::motion::median_step_s(time_s);
    let path = values.command_path(step_s);
    let has_play = valve_hysteresis::law(values).width > R::ZERO;
    let warm_up_s = if has_play {
        PLAY_WARM_UP_S
    } else {
        COMMAND_WARM_UP_S
    };
    let warm_up = (warm_up_s / step_s).ceil() as usize;
    let from = rows.start.saturating_sub(warm_up);
    let before = match from {
        0 => earlier,
        _ => R::from_f64(command[from]),
    };
    let mut state = CommandState::holding(before);
    let mut positions = Vec::with_capacity(rows.len());
    for (row, &command_v) in command.iter().enumerate().take(rows.end).skip(from) {
        let position = path.step(&mut state, R::from_f64(command_v));
        if row >= rows.start {
            positions.push(position);
        }
    }
    positions
}

/// Where the spool stands at the rows themselves: between the means before and behind each.
pub(super) fn spool_at_rows<R: Real>(
    values: &Values<'_, R>,
    recorded: (&[f64], &[f64]),
    rows: &Range<usize>,
) -> Vec<R> {
    let from = rows.start.saturating_sub(1);
    let first = recorded.1.get(from).copied().unwrap_or(0.0);
    let means = spool_positions(values, recorded, &(from..rows.end), R::from_f64(first));
    let before = if rows.start == 0 {
        R::from_f64(first)
    } else {
        means.first().copied().unwrap_or(R::ZERO)
    };
    let own = means.iter().skip(rows.start - from).copied();
    let half = R::from_f64(0.5);
    let mut last = before;
    own.map(|mean| {
        let at = (last + mean) * half;
        last = mean;
        at
    })
    .collect()
}
