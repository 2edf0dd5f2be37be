//! The signals of a recording, and the keys of one signal: the part of the table of keys that
//! stands under `[signals]`.

use super::facts::{Facts, facts};
use crate::units::Dimension;

/// A signal that a rig may record.
pub(super) struct SignalKey {
    pub name: &'static str,
    /// What its column may measure; the first is what it is after scaling.
    pub dimensions: &'static [Dimension],
    pub what: &'static str,
}

const fn signal(
    name: &'static str,
    dimensions: &'static [Dimension],
    what: &'static str,
) -> SignalKey {
    SignalKey {
        name,
        dimensions,
        what,
    }
}

const PRESSURE: &[Dimension] = &[Dimension::Pressure];
const TEMPERATURE: &[Dimension] = &[Dimension::Temperature];
const FLOW: &[Dimension] = &[Dimension::MassFlow];
const POSITION: &[Dimension] = &[Dimension::Length, Dimension::Fraction];

/// The signals there are.
#[rustfmt::skip]
pub(super) const SIGNALS: &[SignalKey] = &[
    signal("t", &[Dimension::Time], "time"),
    signal("u", &[Dimension::Voltage, Dimension::Fraction], "valve command, which holds from its row to the next; a fraction for an `[actuator]`"),
    signal("p_a", PRESSURE, "pressure in chamber A, or in the `[vessel]`"),
    signal("p_b", PRESSURE, "pressure in chamber B"),
    signal("p_s", PRESSURE, "supply pressure at the valve"),
    signal("p_e", PRESSURE, "exhaust pressure; used by the law of the valve's flow"),
    signal("x", POSITION, "position; **+x enlarges chamber A**"),
    signal("x_ref", POSITION, "reference position (shown, used by no law)"),
    signal("v", &[Dimension::Speed], "velocity along +x, compared with the position"),
    signal("a", &[Dimension::Acceleration], "acceleration along +x (shown, used by no law)"),
    signal("force", &[Dimension::Force], "force on the carriage **against +x**: a test machine that holds the rod against pressure in chamber A reads positive; a drive that pushes along +x has `scale = -1`"),
    signal("spool", &[Dimension::Length, Dimension::Voltage, Dimension::Fraction], "displacement of the valve's spool"),
    signal("flow_a", FLOW, "mass flow into port A"),
    signal("flow_b", FLOW, "mass flow into port B"),
    signal("flow_s", FLOW, "mass flow from the supply (shown, used by no law)"),
    signal("temperature_a", TEMPERATURE, "gas temperature in chamber A; used by the law of the valve's flow"),
    signal("temperature_b", TEMPERATURE, "gas temperature in chamber B; used by the law of the valve's flow"),
    signal("temperature_s", TEMPERATURE, "temperature of the supply air; used by the law of the valve's flow"),
];

/// The signal of that name.
pub(super) fn signal_key(name: &str) -> Option<&'static SignalKey> {
    SIGNALS.iter().find(|signal| signal.name == name)
}

/// What a signal measures after conversion and scaling, given what its column
/// was recorded in; `None` for a signal that does not exist. A raw sensor
/// voltage that the rig scales becomes what the signal measures.
pub fn signal_dimension(name: &str, recorded: Option<Dimension>) -> Option<Dimension> {
    let dimensions = signal_key(name)?.dimensions;
    let own = recorded.filter(|recorded| dimensions.contains(recorded));
    own.or_else(|| dimensions.first().copied())
}

/// The keys of one signal.
#[rustfmt::skip]
pub(super) const SIGNAL_KEYS: &[(&str, Facts)] = &[
    ("column", facts("", "\"p_a\" or 3", "header name of the column, or its number counted from 0; required but for the two keys below", "first line of the recording")),
    ("constant", facts("the unit", "5.0", "in place of a column: a value that was the same all the time and was not recorded", "notes of the experiment")),
    ("every", facts("the unit", "0.001", "for t in place of a column: the rows are this far apart", "sampling time of the logger; 1 s for a table without time")),
    ("unit", facts("", "\"bar(g)\"", "unit of the column, converted to SI on reading; a pressure states (abs) or (g); required", "logger's configuration")),
    ("noise", facts("SI", "200 Pa, 4e-6 m", "standard deviation of the noise after scaling", "`pneuma inspect` measures it")),
    ("resolution", facts("SI", "244 Pa, 7.6e-6 m", "step of the converter after scaling", "`pneuma inspect` measures it")),
    ("scale", facts("SI per SI", "1", "gain applied after the conversion to SI; turns volts or counts of a sensor into what it measures", "calibration")),
    ("offset", facts("SI", "0", "added after the gain; gauge columns then get the ambient pressure", "calibration")),
];

/// Their names.
pub(super) fn signal_key_names() -> Vec<&'static str> {
    SIGNAL_KEYS.iter().map(|(name, _)| *name).collect()
}
