//! What of a tick is shown.

use firmware::codes::{COMMAND_V, POSITION_M, PRESSURE_PA, Scale, VELOCITY_M_PER_S};
use firmware::telemetry::Record;
use serde::Serialize;

/// A signal of the page.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Signal {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The picture in which it is drawn; none: only chosen by name.
    pub group: &'static str,
    /// Whether its rate is a signal too.
    pub rate: bool,
    #[serde(skip)]
    value: fn(&Record) -> f64,
}

/// How many there are.
pub const COUNT: usize = 14;

/// All of them, in the order of a row.
#[rustfmt::skip]
pub const SIGNALS: [Signal; COUNT] = [
    signal("position", "mm", "Position", |tick| 1e3 * position_m(tick)),
    signal("reference", "mm", "Position", |tick| 1e3 * f64::from(tick.reference_position_m)),
    signal("error", "mm", "Error", |tick| 1e3 * (position_m(tick) - f64::from(tick.reference_position_m))),
    rated("pressure a", "bar", "Pressure, absolute", |tick| bar(tick.codes.pressure_a.0)),
    rated("pressure b", "bar", "Pressure, absolute", |tick| bar(tick.codes.pressure_b.0)),
    signal("supply", "bar", "Pressure, absolute", |tick| bar(tick.codes.supply_pressure.0)),
    signal("command", "V", "Command", |tick| value(&COMMAND_V, tick.valve_in_force.0)),
    signal("velocity", "m/s", "Velocity", |tick| value(&VELOCITY_M_PER_S, tick.codes.velocity.0)),
    signal("believed velocity", "m/s", "Velocity", |tick| f64::from(tick.estimate[1])),
    signal("believed friction", "N", "Force", |tick| f64::from(tick.estimate[2])),
    signal("believed disturbance", "N", "Force", |tick| f64::from(tick.estimate[3])),
    signal("believed position", "mm", "", |tick| 1e3 * f64::from(tick.estimate[0])),
    signal("state", "", "", |tick| f64::from(tick.state)),
    signal("fault", "", "", |tick| f64::from(tick.fault)),
];

const fn signal(
    name: &'static str,
    unit: &'static str,
    group: &'static str,
    value: fn(&Record) -> f64,
) -> Signal {
    Signal {
        name,
        unit,
        group,
        rate: false,
        value,
    }
}

const fn rated(
    name: &'static str,
    unit: &'static str,
    group: &'static str,
    value: fn(&Record) -> f64,
) -> Signal {
    let mut rated = signal(name, unit, group, value);
    rated.rate = true;
    rated
}

/// A row: the number of the tick, then the signals.
pub type Row = (u32, [f32; COUNT]);

/// The row of a tick.
pub fn row(record: &Record) -> Row {
    let values = SIGNALS.map(|signal| (signal.value)(record) as f32);
    (record.tick, values)
}

fn position_m(tick: &Record) -> f64 {
    value(&POSITION_M, tick.codes.position.0)
}

fn bar(code: u16) -> f64 {
    1e-5 * value(&PRESSURE_PA, code)
}

fn value(scale: &Scale, code: u16) -> f64 {
    f64::from(scale.value(code))
}
