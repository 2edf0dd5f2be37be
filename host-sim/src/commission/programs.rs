//! The experiments of a commissioning, for an axis of any stroke.

use crate::experiment::{FASTEST_M_PER_S, envelope_text, step_text};
use crate::rig::Rig;
use crate::scenario::stroke_range_m;
use model_core::controller::Gains;

/// The usual stroke of a score, m, or this part of a shorter one.
const STROKE_M: f64 = 0.06;
const PART: f64 = 0.3;
/// Of a sine, m, or this part of the stroke.
const SWING_M: f64 = 0.03;
const SWING_PART: f64 = 0.15;
/// Time for a move and the rest after it, s.
pub const MOVE_S: f64 = 2.5;
/// The sine of a score.
pub const SWING_HZ: f64 = 0.5;
/// Periods of it.
const PERIODS: u32 = 4;
/// Heights of the pulses of the recordings, V: a small one, one of usual motions, a large one.
const PULSES_V: [f64; 3] = [1.2, 0.8, 1.6];

/// Moves and a sine, whose errors are the score.
pub fn score(rig: &Rig) -> Option<String> {
    let axis = Places::of(rig)?;
    Some(format!(
        "{}{}{}{}{}{}{}{}",
        head("Score: moves and a sine"),
        axis.envelope,
        go(axis.middle_m),
        go(axis.middle_m + axis.stroke_m),
        go(axis.middle_m - axis.stroke_m),
        go(axis.middle_m),
        sine(axis.swing_m, SWING_HZ, PERIODS),
        go(axis.middle_m)
    ))
}

/// How much slower the loop is while the settings do not know all of the axis. Of shares from 1 to
/// 0.15, 0.35 alone holds the paper's axis both with a tube of 1.5 m and with a spool of 15 Hz that
/// its settings do not know (`pneuma loop`); slower loops wander between friction and their own
/// lag.
const CAREFUL: f64 = 0.35;

/// The rig with the loops of position and force slower by that.
pub fn careful(rig: &Rig) -> Rig {
    let standard = Gains::<f64>::standard();
    let mut careful = rig.clone();
    for (key, usual) in [
        ("position_per_s", standard.position_per_s),
        ("force_per_s", standard.force_per_s),
        ("approach_per_s", standard.approach_per_s),
        ("rest_force_per_s", standard.rest_force_per_s),
    ] {
        let gain = careful.controller.entry(key.into()).or_insert(usual);
        *gain *= CAREFUL;
    }
    careful
}

/// Varied motion, for the diagnosis: number 0, 1 or 2. The loop never has to hold the load for
/// long: about an axis that is not as its settings say it may swing there, and that is what the
/// recordings are to show the reason of.
pub fn varied(rig: &Rig, number: usize) -> Option<String> {
    let axis = Places::of(rig)?;
    let pulses_v = PULSES_V[number % PULSES_V.len()];
    let pulses = step_text(
        "bursts",
        &[
            ("amplitude_V", pulses_v),
            ("shortest_s", 0.03),
            ("longest_s", 0.12),
            ("seconds", 2.5),
        ],
    );
    let ladder = [
        ("from_m", axis.middle_m),
        ("to_m", axis.middle_m + 0.25 * axis.stroke_m),
        ("move_s", 0.4),
    ];
    let ladder = step_text("dwell", &ladder) + "rests_s = [0.1, 0.3, 0.6]\n";
    let side = if number.is_multiple_of(2) { -1.0 } else { 1.0 };
    let soon = |to_m: f64| step_text("move", &[("to_m", to_m), ("seconds", 0.8)]);
    let swing = |part: f64, frequency_hz: f64, periods: u32| {
        sine(part * axis.swing_m, frequency_hz, periods)
    };
    let parts = [
        head("Varied motion for the diagnosis"),
        axis.envelope.clone(),
        soon(axis.middle_m),
        swing(1.0, 0.4 + 0.2 * number as f64, 3),
        pulses.clone(),
        soon(axis.middle_m + side * axis.stroke_m),
        swing(0.7, 1.0, 3),
        pulses,
        soon(axis.middle_m),
        swing(0.4, 1.5, 4),
        ladder,
    ];
    Some(parts.concat())
}

/// Where there is room.
struct Places {
    middle_m: f64,
    stroke_m: f64,
    swing_m: f64,
    envelope: String,
}

impl Places {
    fn of(rig: &Rig) -> Option<Self> {
        let [low_m, high_m] = stroke_range_m(rig)?;
        let whole_m = high_m - low_m;
        Some(Self {
            middle_m: 0.5 * (low_m + high_m),
            stroke_m: STROKE_M.min(PART * whole_m),
            swing_m: SWING_M.min(SWING_PART * whole_m),
            envelope: envelope_text(rig, [low_m, high_m], FASTEST_M_PER_S),
        })
    }
}

fn head(what: &str) -> String {
    format!("# {what}.\nformat = \"experiment/1\"\n\n")
}

fn go(to_m: f64) -> String {
    step_text("move", &[("to_m", to_m), ("seconds", MOVE_S)])
}

fn sine(amplitude_m: f64, frequency_hz: f64, periods: u32) -> String {
    step_text(
        "sine",
        &[
            ("amplitude_m", amplitude_m),
            ("frequency_Hz", frequency_hz),
            ("periods", f64::from(periods)),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::super::wiring;
    use super::*;
    use crate::experiment;

    /// A cylinder of 500 mm and one of 100 mm.
    #[test]
    fn prop_programs_fit_boards_and_strokes() {
        let text = include_str!("../../rigs/paper.toml");
        let short = text.replace("stroke_m = 0.5", "stroke_m = 0.1");
        assert_ne!(short, text);
        for text in [text, &short] {
            let rig = Rig::parse(text, "rig.toml").expect("a rig");
            let [low_m, high_m] = stroke_range_m(&rig).expect("a stroke");
            let all = [
                wiring::pulses(&rig, 0.04, 3).ok(),
                Some(wiring::swing(&rig, 0.04)),
                score(&rig),
                varied(&rig, 0),
                varied(&rig, 1),
                varied(&rig, 2),
            ];
            for file in all {
                let file = file.expect("a file");
                let program = experiment::parse(&file, "e.toml");
                let program = program.unwrap_or_else(|error| panic!("{error}\n{file}"));
                assert!(program.seconds() < 40.0);
                for step in &program.steps {
                    if let firmware::experiment::Step::Move { to_m, .. } = step {
                        assert!((low_m..=high_m).contains(&f64::from(*to_m)), "{file}");
                    }
                }
            }
        }
    }
}
