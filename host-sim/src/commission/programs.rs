//! The experiments of a commissioning, for an axis of any stroke.

use crate::closed_loop::controller;
use crate::experiment::{envelope_text, step_text};
use crate::model::AxisFault;
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
/// What a shut valve lets a load of the speed below go on, m, and the part of a shorter stroke: left free before
/// both ends. On the paper's axis a load of 1 m/s goes on for 68 mm (`host-sim/tests/experiments.rs`).
const COASTING_M: f64 = 0.1;
const COASTING_PART: f64 = 0.2;
/// What a load may move off the way to the middle before it moves along it, m.
const AWAY_M: f64 = 0.01;
/// No motion of the way is faster, m/s.
const FASTEST_M_PER_S: f64 = 1.2;
/// Openings of the exploration beyond the overlap, V: small ones, which a null that is off by a tenth of a volt turns
/// into less of a drift, and a larger one for an axis with more friction.
const BEYOND_V: [f64; 4] = [0.4, 0.7, 0.5, 0.5];
/// Shortest and longest pulse of an exploration, s.
const PULSE_S: [f64; 2] = [0.03, 0.09];
/// The opening beyond the overlap that brings the load to the middle, V, and the longest that it may take, s.
const HOMEWARD_V: f64 = 0.5;
const HOMEWARD_S: f64 = 4.0;
/// A load within this part of the free stroke from its middle may be explored from there.
const NEAR_PART: f64 = 0.25;

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

/// Brings a load that stands elsewhere to the middle, by an opening of the valve that ends there: no loop is
/// needed, which may not know the axis yet. None where it is near already, or the stroke is not known.
///
/// # Errors
/// Where the rig is no whole axis.
pub fn homeward(rig: &Rig, position_m: f64) -> Result<Option<String>, AxisFault> {
    let Some(axis) = Places::of(rig) else {
        return Ok(None);
    };
    let away_m = position_m - axis.middle_m;
    if away_m.abs() < NEAR_PART * axis.free_m {
        return Ok(None);
    }
    let behind_m = position_m + away_m.signum() * AWAY_M;
    let places = [behind_m.min(axis.middle_m), behind_m.max(axis.middle_m)];
    let opening_v = -away_m.signum() * upwards_v(rig, HOMEWARD_V)?;
    let step = [("opening_V", opening_v), ("seconds", HOMEWARD_S)];
    Ok(Some(
        head("To the middle of the stroke")
            + &envelope_text(rig, places, FASTEST_M_PER_S)
            + &step_text("opening", &step),
    ))
}

/// Pulses and a chirp of the valve about the middle, number 0 to 3. Nothing is controlled: what the axis
/// does of itself shows also where a loop by the rig file would swing or stick.
///
/// # Errors
/// Where the rig is no whole axis.
pub fn exploration(rig: &Rig, number: usize) -> Result<Option<String>, AxisFault> {
    let Some(axis) = Places::of(rig) else {
        return Ok(None);
    };
    let amplitude_v = upwards_v(rig, BEYOND_V[number % BEYOND_V.len()])?;
    let shut = step_text("opening", &[("opening_V", 0.0), ("seconds", 0.3)]);
    let pulses = [
        ("amplitude_V", amplitude_v),
        ("shortest_s", PULSE_S[0]),
        ("longest_s", PULSE_S[1]),
        ("seconds", 3.0),
    ];
    let chirp = [
        ("amplitude_V", amplitude_v),
        ("from_Hz", 2.0),
        ("to_Hz", 15.0),
        ("seconds", 2.0),
    ];
    Ok(Some(
        [
            head("Pulses of the valve about the middle: what the axis does of itself"),
            axis.envelope,
            shut.clone(),
            step_text("bursts", &pulses),
            shut.clone(),
            step_text("chirp", &chirp),
            shut,
        ]
        .concat(),
    ))
}

/// The opening that moves the load to +x, so much beyond the overlap, V.
fn upwards_v(rig: &Rig, beyond_v: f64) -> Result<f64, AxisFault> {
    let controller = controller(rig)?;
    let valve = &controller.axis().valve;
    let opening_v = f64::from(valve.supply.edge_v()) + beyond_v;
    Ok(if valve.feeds_a_above_null {
        opening_v
    } else {
        -opening_v
    })
}

/// Varied motion, for the diagnosis: number 0, 1 or 2.
pub fn varied(rig: &Rig, number: usize) -> Option<String> {
    let axis = Places::of(rig)?;
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
        swing(1.0, 0.4 + 0.2 * number as f64, 2),
        soon(axis.middle_m + side * axis.stroke_m),
        swing(0.7, 1.0, 2),
        soon(axis.middle_m),
        swing(0.4, 1.5, 3),
        ladder,
    ];
    Some(parts.concat())
}

/// Where there is room.
struct Places {
    middle_m: f64,
    /// What is used of either side of the middle.
    free_m: f64,
    stroke_m: f64,
    swing_m: f64,
    envelope: String,
}

impl Places {
    fn of(rig: &Rig) -> Option<Self> {
        let [low_m, high_m] = stroke_range_m(rig)?;
        let whole_m = high_m - low_m;
        let coasting_m = COASTING_M.min(COASTING_PART * whole_m);
        let places = [low_m + coasting_m, high_m - coasting_m];
        Some(Self {
            middle_m: 0.5 * (low_m + high_m),
            free_m: 0.5 * whole_m - coasting_m,
            stroke_m: STROKE_M.min(PART * whole_m),
            swing_m: SWING_M.min(SWING_PART * whole_m),
            envelope: envelope_text(rig, places, FASTEST_M_PER_S),
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
                homeward(&rig, low_m).expect("an axis"),
                homeward(&rig, high_m).expect("an axis"),
                exploration(&rig, 0).expect("an axis"),
                exploration(&rig, 3).expect("an axis"),
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
