//! What is done to samples, supply or board.

use firmware::codes::{AdcCode, POSITION_M, PRESSURE_PA, Scale, VELOCITY_M_PER_S};
use firmware::fault::{Channel, Fault};
use firmware::tick::Sample;

/// Ticks that [`Disturbance::Skip`] leaves out.
const SKIPPED: u32 = 50;
const TICK_S: f64 = 1e-3;

/// What goes wrong, from its moment on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Disturbance {
    /// A channel gives this code.
    Code(Channel, u16),
    /// A channel keeps its last code.
    Freeze(Channel),
    /// A channel is off by this, SI.
    Offset(Channel, f64),
    /// A channel runs away at this rate, SI per s.
    Drift(Channel, f64),
    /// A channel's value is multiplied.
    Gain(Channel, f64),
    /// The tubes of both pressure sensors are exchanged.
    ExchangedPressures,
    /// Samples are left out, once.
    Skip,
    /// The tick number stays.
    StandingTick,
    /// The reference stays as it is, velocity and all.
    StandingReference,
    /// The reference is off by this, m.
    ReferenceOffset(f32),
    /// The supply falls to this, Pa absolute; the axis feels it.
    Supply(f64),
    /// The board sees a fault.
    Board(Fault),
}

/// A disturbance, and the faults that may be said of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// What is done.
    pub disturbance: Disturbance,
    /// In words.
    pub name: &'static str,
    /// The fault that belongs to it, and others that say it as well.
    pub faults: &'static [Fault],
    /// It shows only while the load moves, or is asked to: at rest it may go
    /// unseen for as long as the rest lasts.
    pub needs_motion: bool,
}

const fn case(
    name: &'static str,
    disturbance: Disturbance,
    faults: &'static [Fault],
    needs_motion: bool,
) -> Case {
    Case {
        disturbance,
        name,
        faults,
        needs_motion,
    }
}

use Channel::{Position, PressureA, PressureB, SupplyPressure, Velocity};
use Disturbance::{
    Board, Code, Drift, ExchangedPressures, Freeze, Gain, Offset, ReferenceOffset, Skip,
    StandingReference, StandingTick, Supply,
};

const FAILED: &[Fault] = &[Fault::FailedConversion];
const RANGE: &[Fault] = &[Fault::OutOfRange];
const FROZEN: &[Fault] = &[Fault::FrozenSensor];
const JUMP: &[Fault] = &[Fault::JumpingSensor];
/// A chamber pressure that is wrong, or one that the loop drives away because
/// of it.
const PRESSURE: &[Fault] = &[
    Fault::PressureContradictsPosition,
    Fault::JumpingSensor,
    Fault::OutOfRange,
    Fault::WrongPolarity,
];
/// A frozen pressure that acts before it is known for frozen.
const FROZEN_PRESSURE: &[Fault] = &[Fault::FrozenSensor, Fault::PressureContradictsPosition];
/// A position that stands by chance for some ticks at rest is frozen, by a
/// velocity that is wrong.
const VELOCITY: &[Fault] = &[
    Fault::VelocityContradictsPosition,
    Fault::JumpingSensor,
    Fault::FrozenSensor,
    Fault::WrongPolarity,
];
const STALE: &[Fault] = &[Fault::StaleReference];

/// All cases.
pub const CASES: &[Case] = &[
    case(
        "position: conversion failed",
        Code(Position, 0xFFFF),
        FAILED,
        false,
    ),
    case(
        "p_a: conversion failed",
        Code(PressureA, 0xFFFF),
        FAILED,
        false,
    ),
    case(
        "p_b: conversion failed",
        Code(PressureB, 0xFFFF),
        FAILED,
        false,
    ),
    case(
        "p_s: conversion failed",
        Code(SupplyPressure, 0xFFFF),
        FAILED,
        false,
    ),
    case(
        "velocity: conversion failed",
        Code(Velocity, 0xFFFF),
        FAILED,
        false,
    ),
    case(
        "position: wire broken, code 0",
        Code(Position, 0),
        RANGE,
        false,
    ),
    case(
        "position: shorted, highest code",
        Code(Position, 0xFFFE),
        RANGE,
        false,
    ),
    case("p_a: wire broken, code 0", Code(PressureA, 0), RANGE, false),
    case(
        "p_a: shorted, highest code",
        Code(PressureA, 0xFFF0),
        RANGE,
        false,
    ),
    case("p_b: wire broken, code 0", Code(PressureB, 0), RANGE, false),
    case(
        "p_b: shorted, highest code",
        Code(PressureB, 0xFFF0),
        RANGE,
        false,
    ),
    case(
        "p_s: wire broken, code 0",
        Code(SupplyPressure, 0),
        RANGE,
        false,
    ),
    case(
        "p_s: shorted, highest code",
        Code(SupplyPressure, 0xFFF0),
        RANGE,
        false,
    ),
    case(
        "velocity: wire broken, code 0",
        Code(Velocity, 0),
        RANGE,
        false,
    ),
    case(
        "velocity: shorted, highest code",
        Code(Velocity, 0xFFFE),
        RANGE,
        false,
    ),
    case("position: frozen", Freeze(Position), FROZEN, true),
    case("velocity: frozen", Freeze(Velocity), FROZEN, true),
    case("p_a: frozen", Freeze(PressureA), FROZEN_PRESSURE, true),
    case("p_b: frozen", Freeze(PressureB), FROZEN_PRESSURE, true),
    case(
        "position: jumps by 2 mm",
        Offset(Position, 2e-3),
        JUMP,
        false,
    ),
    case(
        "velocity: jumps by 0.6 m/s",
        Offset(Velocity, 0.6),
        JUMP,
        false,
    ),
    case("p_a: jumps by 0.8 bar", Offset(PressureA, 8e4), JUMP, false),
    case(
        "p_b: jumps by -0.8 bar",
        Offset(PressureB, -8e4),
        JUMP,
        false,
    ),
    case(
        "p_a: drifts by 2 bar/s",
        Drift(PressureA, 2e5),
        PRESSURE,
        false,
    ),
    case(
        "p_b: drifts by -2 bar/s",
        Drift(PressureB, -2e5),
        PRESSURE,
        false,
    ),
    case("p_a and p_b exchanged", ExchangedPressures, PRESSURE, true),
    case(
        "velocity: drifts by 0.2 m/s2",
        Drift(Velocity, 0.2),
        VELOCITY,
        false,
    ),
    case(
        "velocity: off by 0.1 m/s",
        Offset(Velocity, 0.1),
        VELOCITY,
        false,
    ),
    case(
        "velocity: half the gain",
        Gain(Velocity, 0.5),
        VELOCITY,
        true,
    ),
    case("velocity: reversed", Gain(Velocity, -1.0), VELOCITY, true),
    case(
        "position: slips by 50 mm/s",
        Drift(Position, 0.05),
        VELOCITY,
        false,
    ),
    case("50 samples missing", Skip, &[Fault::MissedTicks], false),
    case(
        "tick number stands still",
        StandingTick,
        &[Fault::TickStandsStill],
        false,
    ),
    case(
        "reference stands, velocity and all",
        StandingReference,
        STALE,
        true,
    ),
    case(
        "reference beyond the stroke",
        ReferenceOffset(0.4),
        &[Fault::ReferenceOutOfStroke],
        false,
    ),
    case(
        "reference infinite",
        ReferenceOffset(f32::INFINITY),
        &[Fault::ReferenceOutOfStroke],
        false,
    ),
    case(
        "supply vented",
        Supply(1.013e5),
        &[Fault::SupplyLost],
        false,
    ),
    case(
        "supply falls to 2.5 bar",
        Supply(2.5e5),
        &[Fault::SupplyLost],
        false,
    ),
    case(
        "board: task overrun",
        Board(Fault::TaskOverrun),
        &[Fault::TaskOverrun],
        false,
    ),
    case(
        "board: DAC write-back mismatch",
        Board(Fault::DacMismatch),
        &[Fault::DacMismatch],
        false,
    ),
    case(
        "board: watchdog reset",
        Board(Fault::WatchdogReset),
        &[Fault::WatchdogReset],
        false,
    ),
    case(
        "board: brown-out",
        Board(Fault::BrownOut),
        &[Fault::BrownOut],
        false,
    ),
    case(
        "board: clock failed",
        Board(Fault::ClockFailed),
        &[Fault::ClockFailed],
        false,
    ),
    case(
        "board: settings damaged",
        Board(Fault::SettingsDamaged),
        &[Fault::SettingsDamaged],
        false,
    ),
    case(
        "board: settings impossible",
        Board(Fault::SettingsImpossible),
        &[Fault::SettingsImpossible],
        false,
    ),
    case(
        "board: stream of references ends",
        Board(Fault::StaleReference),
        STALE,
        false,
    ),
];

impl Disturbance {
    /// The cause is there still, whatever is acknowledged.
    pub(super) fn lasts(&self) -> bool {
        matches!(self, Self::Supply(_))
    }

    /// By the time it is seen the loop has driven the axis to where other faults
    /// are true.
    pub(super) fn upsets_the_axis(&self) -> bool {
        matches!(self, Self::ExchangedPressures)
    }

    /// The sample as it comes `ticks` after the moment at which `first` was the
    /// last sound sample.
    pub(super) fn applied(&self, mut sample: Sample, first: &Sample, ticks: u32) -> Sample {
        let value = |sample: &Sample, channel: Channel| sample.codes.to_array()[channel as usize];
        match *self {
            Self::Code(channel, code) => set(&mut sample, channel, code),
            Self::Freeze(channel) => set(&mut sample, channel, value(first, channel)),
            Self::Offset(channel, offset) => shift(&mut sample, channel, offset),
            Self::Drift(channel, rate) => {
                shift(&mut sample, channel, rate * TICK_S * f64::from(ticks + 1));
            }
            Self::Gain(channel, gain) => {
                let si = si(channel, value(&sample, channel));
                shift(&mut sample, channel, (gain - 1.0) * si);
            }
            Self::ExchangedPressures => {
                let codes = &mut sample.codes;
                std::mem::swap(&mut codes.pressure_a, &mut codes.pressure_b);
            }
            Self::Skip => sample.tick += SKIPPED,
            Self::StandingTick => sample.tick = first.tick,
            Self::StandingReference => sample.reference = first.reference,
            Self::ReferenceOffset(offset_m) => sample.reference.position_m += offset_m,
            Self::Supply(_) | Self::Board(_) => {}
        }
        sample
    }
}

fn scale(channel: Channel) -> Scale {
    match channel {
        Channel::Position => POSITION_M,
        Channel::Velocity => VELOCITY_M_PER_S,
        Channel::PressureA | Channel::PressureB | Channel::SupplyPressure => PRESSURE_PA,
    }
}

fn si(channel: Channel, code: u16) -> f64 {
    f64::from(scale(channel).value(code))
}

fn set(sample: &mut Sample, channel: Channel, code: u16) {
    let codes = &mut sample.codes;
    let place = match channel {
        Channel::Position => &mut codes.position,
        Channel::PressureA => &mut codes.pressure_a,
        Channel::PressureB => &mut codes.pressure_b,
        Channel::SupplyPressure => &mut codes.supply_pressure,
        Channel::Velocity => &mut codes.velocity,
    };
    *place = AdcCode(code);
}

/// Adds to a channel's value; its scale's ends beyond them.
fn shift(sample: &mut Sample, channel: Channel, by_si: f64) {
    let scale = scale(channel);
    let span = f64::from(scale.highest) - f64::from(scale.lowest);
    let by_codes = (by_si / span * f64::from(u16::MAX)).round();
    let code = f64::from(sample.codes.to_array()[channel as usize]) + by_codes;
    set(sample, channel, code.clamp(0.0, 65_534.0) as u16);
}
