//! Which way round an axis answers: guarded pulses, then a small swing, and what their recordings
//! show.
//!
//! **Pulses.** The valve opens to either side for some milliseconds, twice as long each time until a
//! chamber answers: a slow spool or a delay swallows short ones. The pressure of the chamber that is
//! fed rises against the other one's; the load hardly feels it. Where the pressures answer the
//! wrong way round, valve or gauges are exchanged, and the swing is made with the valve's
//! direction turned over: if the load then goes where it is pushed, it was the valve, else the
//! gauges.
//!
//! **Swing.** The loop swings the load a millimetre. From rest a load moves where the gas pushes it:
//! the work of the measured force is positive, by the measured position and by the measured velocity.

use crate::closed_loop::controller;
use crate::experiment::step_text;
use crate::model::AxisFault;
use crate::recording::Recording;
use crate::rig::{FeedsAWhen, Rig};
use firmware::experiment::CHECKED_WITHIN_M;

/// The places of a check, so much to either side of the load: what a board allows less what the load
/// creeps until it begins.
const WITHIN_M: f64 = CHECKED_WITHIN_M as f64 - 0.3e-3;
/// A check is no faster, m/s: what the load reaches within the way above on the spring of its gas.
const SPEED_M_PER_S: f64 = 0.5;
/// What the first pulses add to a chamber at half of its volume, Pa: a tenth of the friction of a usual seal.
const RISE_PA: f64 = 6e3;
/// Pulses are long enough where they do half of it to a chamber.
const PLAIN_PA: f64 = 0.5 * RISE_PA;
/// Less is noise of a mean, Pa: ten deviations of a usual gauge's over a window.
const NOISE_PA: f64 = 300.0;
/// The chamber that answers less does so by this part of the other one's answer: volumes near an end of the
/// stroke are ten to one.
const LEAST_PART: f64 = 0.1;
/// Opening of a pulse beyond the overlap, V: more than a null is off by.
const BEYOND_V: f64 = 0.5;
/// Shortest and longest pulse, s.
const PULSE_S: [f64; 2] = [0.006, 0.3];
/// Pulses are made so many times longer at the most, by two each time.
pub const DOUBLINGS: u32 = 6;
/// Rest before and after a pulse, s ...
const REST_S: f64 = 0.3;
/// ... and when in it the pressures are taken, s from the pulse's begin and end: later a leak past the
/// piston has evened them out.
const BEFORE_S: [f64; 2] = [-0.15, 0.0];
const AFTER_S: [f64; 2] = [0.03, 0.12];
/// The swing: amplitude, m, frequency, Hz, and periods.
const SWING: (f64, f64, f64) = (1e-3, 1.0, 2.0);
/// Windows of the swing, s, and the way in one that is motion, m.
const WINDOW_S: f64 = 0.02;
const MOTION_M: f64 = 30e-6;

/// What a check finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wiring {
    /// Everything answers the right way round.
    Right,
    /// No chamber answers.
    NoAnswer,
    /// Chamber a does not answer, b does.
    NoAnswerOfA,
    /// Chamber b does not answer, a does.
    NoAnswerOfB,
    /// The chambers answer alike to both sides.
    NotOpposed,
    /// The valve's command or its tubes.
    Valve,
    /// The gauges.
    Gauges,
    /// Tubes and gauges together, or position and velocity.
    Motion,
    /// The position.
    Position,
    /// The velocity.
    Velocity,
    /// The valve, and the position.
    ValveAndPosition,
    /// The valve, and the velocity.
    ValveAndVelocity,
}

impl Wiring {
    /// What it is, and what to do.
    pub fn text(self) -> &'static str {
        match self {
            Self::Right => "valve, tubes, gauges, position and velocity answer the right way round",
            Self::NoAnswer => {
                "neither chamber answers the valve: look for the air, for a shut-off valve, for the valve's 24 V and for the wire of its command"
            }
            Self::NoAnswerOfA => {
                "chamber a does not answer the valve, chamber b does: look for the tube of chamber a (off, squeezed) and for gauge a"
            }
            Self::NoAnswerOfB => {
                "chamber b does not answer the valve, chamber a does: look for the tube of chamber b (off, squeezed) and for gauge b"
            }
            Self::NotOpposed => {
                "both chambers answer the valve alike: look whether both gauges are at one chamber, and whether the other tube is off"
            }
            Self::Valve => {
                "the valve is reversed, or its two tubes are exchanged: exchange the tubes at the valve, or turn [valve] feeds_a_when of the rig file over"
            }
            Self::Gauges => "the gauges of the two chambers are exchanged: exchange their wires",
            Self::Motion => {
                "the load goes the wrong way: the tubes are exchanged, gauges with them, or position and velocity are both reversed"
            }
            Self::Position => {
                "the position is reversed: turn its sensor over, or exchange its wires"
            }
            Self::Velocity => "the velocity is reversed: exchange its wires",
            Self::ValveAndPosition => "valve (or its tubes) and position are reversed",
            Self::ValveAndVelocity => "valve (or its tubes) and velocity are reversed",
        }
    }
}

/// The pulses, for a load at this place, made longer by two so many times.
///
/// # Errors
/// Where the rig is no whole axis.
pub fn pulses(rig: &Rig, position_m: f64, doublings: u32) -> Result<String, AxisFault> {
    let (opening_v, shortest_s) = pulse(rig)?;
    let seconds = (shortest_s * f64::from(1 << doublings.min(DOUBLINGS))).min(PULSE_S[1]);
    let rest = step_text("opening", &[("opening_V", 0.0), ("seconds", REST_S)]);
    let mut text = head("Pulses of the valve: which chamber rises", rig, position_m);
    for side in [1.0, -1.0, -1.0, 1.0] {
        text += &rest;
        let one = [("opening_V", side * opening_v), ("seconds", seconds)];
        text += &step_text("opening", &one);
    }
    Ok(text + &rest)
}

/// The swing, for a load at this place.
pub fn swing(rig: &Rig, position_m: f64) -> String {
    let (amplitude_m, frequency_hz, periods) = SWING;
    let hold = step_text("hold", &[("seconds", 0.5)]);
    let numbers = [
        ("amplitude_m", amplitude_m),
        ("frequency_Hz", frequency_hz),
        ("periods", periods),
    ];
    let head = head("A small swing: which way the load goes", rig, position_m);
    format!("{head}{hold}{}{hold}", step_text("sine", &numbers))
}

fn head(what: &str, rig: &Rig, position_m: f64) -> String {
    let places = [position_m - WITHIN_M, position_m + WITHIN_M];
    let envelope = crate::experiment::envelope_text(rig, places, SPEED_M_PER_S);
    format!("# {what}.\nformat = \"experiment/1\"\n\n{envelope}")
}

/// Opening, V, and length, s, of a pulse: choked flow from the supply for [`RISE_PA`] in a chamber
/// at half of the stroke, isothermal (ideal nozzle, ISO 6358 in SI units).
fn pulse(rig: &Rig) -> Result<(f64, f64), AxisFault> {
    let controller = controller(rig)?;
    let (axis, gas) = (controller.axis(), &controller.axis().pneumatics.gas);
    let supply_pa = rig.value("supply.pressure_Pa").unwrap_or(6e5);
    let chamber = &axis.pneumatics.chamber_a.geometry;
    let volume_m3 = f64::from(chamber.dead_volume_m3 + chamber.area_m2 * chamber.length_at_zero_m);
    let edge_v = f64::from(axis.valve.supply.edge_v());
    let area_m2 = f64::from(axis.valve.supply.area_m2((edge_v + BEYOND_V) as f32));
    let gamma = f64::from(gas.heat_capacity_ratio);
    let r = f64::from(gas.gas_constant_j_per_kg_k);
    let temperature_k = f64::from(axis.pneumatics.ambient.temperature_k);
    let power = (gamma + 1.0) / (2.0 * (gamma - 1.0));
    let choked = (gamma / (r * temperature_k)).sqrt() * (2.0 / (gamma + 1.0)).powf(power);
    let flow_kg_per_s = area_m2 * supply_pa * choked;
    let seconds = RISE_PA * volume_m3 / (r * temperature_k * flow_kg_per_s);
    Ok((edge_v + BEYOND_V, seconds.clamp(PULSE_S[0], PULSE_S[1])))
}

/// The rig with the valve's direction turned over.
pub fn turned_over(rig: &Rig) -> Rig {
    let mut turned = rig.clone();
    if let Some(valve) = &mut turned.valve {
        valve.feeds_a_when = match valve.feeds_a_when {
            FeedsAWhen::AboveNull => FeedsAWhen::BelowNull,
            FeedsAWhen::BelowNull => FeedsAWhen::AboveNull,
        };
    }
    turned
}

/// How the pressures answered the pulses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// As the rig file says.
    Right,
    /// The other way round.
    Reversed,
    /// Hardly: longer pulses are needed.
    Faint,
    /// Not so that it can be gone on with.
    Ended(Wiring),
}

/// Reads the recording of the pulses, which came to its end or not: a load that moved at short pulses
/// gets no longer ones. None where it holds no pulse.
pub fn answer(recording: &Recording, rig: &Rig, came_to_its_end: bool) -> Option<Answer> {
    let rises_pa = rises(recording, rig)?;
    let larger_pa = rises_pa[0].abs().max(rises_pa[1].abs());
    let plain_pa = if came_to_its_end {
        PLAIN_PA
    } else {
        2.0 * NOISE_PA
    };
    if larger_pa < plain_pa {
        return Some(Answer::Faint);
    }
    let least_pa = (LEAST_PART * larger_pa).max(NOISE_PA);
    let told = |rise_pa: f64| match rise_pa {
        rise_pa if rise_pa.abs() < least_pa => 0,
        rise_pa if rise_pa > 0.0 => 1,
        _ => -1,
    };
    Some(match rises_pa.map(told) {
        [0, _] => Answer::Ended(Wiring::NoAnswerOfA),
        [_, 0] => Answer::Ended(Wiring::NoAnswerOfB),
        [1, -1] => Answer::Right,
        [-1, 1] => Answer::Reversed,
        _ => Answer::Ended(Wiring::NotOpposed),
    })
}

/// What pulses to the side that feeds chamber a do to each chamber, less what those to the other
/// side do, halved, Pa.
fn rises(recording: &Recording, rig: &Rig) -> Option<[f64; 2]> {
    let (command_v, time_s) = (recording.signal("u")?, &recording.time_s);
    let null_v = rig.value("valve.null_V")?;
    let feeds_a_above = rig.valve.as_ref()?.feeds_a_when == FeedsAWhen::AboveNull;
    let (opening_v, _) = pulse(rig).ok()?;
    let is_open = |row: usize| (command_v[row] - null_v).abs() > 0.5 * opening_v;
    let mut sums = [0.0; 2];
    let mut count = 0.0;
    let mut row = 1;
    while row < time_s.len() {
        if !is_open(row) {
            row += 1;
            continue;
        }
        let begin = row;
        while row < time_s.len() && is_open(row) {
            row += 1;
        }
        let feeds_a = (command_v[begin] > null_v) == feeds_a_above;
        let before = BEFORE_S.map(|after_s| time_s[begin] + after_s);
        let after = AFTER_S.map(|after_s| time_s[row - 1] + after_s);
        for (sum, name) in sums.iter_mut().zip(["p_a", "p_b"]) {
            let pressure_pa = recording.signal(name)?;
            let mean = |span: [f64; 2]| mean_within(time_s, pressure_pa, span);
            let rise_pa = mean(after)? - mean(before)?;
            *sum += if feeds_a { rise_pa } else { -rise_pa };
        }
        count += 1.0;
    }
    (count > 0.0).then(|| sums.map(|sum| sum / count))
}

fn mean_within(time_s: &[f64], values: &[f64], [from_s, to_s]: [f64; 2]) -> Option<f64> {
    let within: Vec<f64> = time_s
        .iter()
        .zip(values)
        .filter(|(time, _)| (from_s..to_s).contains(*time))
        .map(|(_, value)| *value)
        .collect();
    (!within.is_empty()).then(|| within.iter().sum::<f64>() / within.len() as f64)
}

/// What the swing shows, which ended in no fault or in one; a loop that swings out of its envelope, about a valve
/// slower than its settings say, shows the signs as well. `is_turned_over` where it was made with the
/// valve's direction turned over. None where it shows nothing.
pub fn found(
    recording: &Recording,
    rig: &Rig,
    (is_without_fault, is_turned_over): (bool, bool),
) -> Option<Wiring> {
    let [by_position_j, by_velocity_j] = works(recording, rig)?;
    let (position, velocity) = (by_position_j > 0.0, by_velocity_j > 0.0);
    Some(match (position, velocity, is_turned_over) {
        (true, true, _) if !is_without_fault => return None,
        (true, true, false) => Wiring::Right,
        (true, true, true) => Wiring::Valve,
        (false, false, false) => Wiring::Motion,
        (false, false, true) => Wiring::Gauges,
        (false, true, false) => Wiring::Position,
        (true, false, false) => Wiring::Velocity,
        (false, true, true) => Wiring::ValveAndPosition,
        (true, false, true) => Wiring::ValveAndVelocity,
    })
}

/// Work of the gas on the load, by position and by velocity, J; none where nothing moved. Of a load
/// that slides the force has the sign of its motion, whatever friction holds it with at rest.
fn works(recording: &Recording, rig: &Rig) -> Option<[f64; 2]> {
    let signal = |name| recording.signal(name);
    let (time_s, position_m) = (&recording.time_s, signal("x")?);
    let (pressure_a_pa, pressure_b_pa) = (signal("p_a")?, signal("p_b")?);
    let velocity_m_per_s = signal("v")?;
    let controller = controller(rig).ok()?;
    let carriage = &controller.axis().carriage;
    let known_n = carriage.external_force_n + controller.axis().friction_terms.constant_force_n;
    let force_n = |row: usize| {
        let (a, b) = (pressure_a_pa[row] as f32, pressure_b_pa[row] as f32);
        f64::from(carriage.drive_n(a, b) - known_n)
    };
    let [mut by_position_j, mut by_velocity_j] = [0.0; 2];
    let mut has_moved = false;
    let mut begin = 0;
    for row in 1..time_s.len() {
        let seconds = time_s[row] - time_s[begin];
        if seconds < WINDOW_S {
            continue;
        }
        let way_m = position_m[row] - position_m[begin];
        let rows = (row - begin) as f64;
        let mean = |values: &dyn Fn(usize) -> f64| (begin..row).map(values).sum::<f64>() / rows;
        if way_m.abs() > MOTION_M {
            has_moved = true;
            let window_n = mean(&force_n);
            by_position_j += window_n * way_m;
            by_velocity_j += window_n * mean(&|at| velocity_m_per_s[at]) * seconds;
        }
        begin = row;
    }
    has_moved.then_some([by_position_j, by_velocity_j])
}
