//! The one table of the keys of a rig file: spelling, limits, unit, typical value, meaning, where
//! one finds the value, and the place in [`Rig`]. The reader, `docs/rig.md`, the schema for
//! editors and `pneuma check` are driven by it. Signals stand in `signals.rs`, effects in
//! [`crate::effects`]. On the table the flat view of a rig's numbers is built.
//!
//! A key is `section.key` as the file spells it, or `effects.NAME.key`. The
//! three valve tables appear in the flat view as the scale of the whole table:
//! their value is 1, and setting 1.1 makes every entry a tenth larger.

use std::collections::BTreeMap;

use super::facts::{Facts, Limits, RATIO, facts, limits, positive};
use super::stated_flow::{CRITICAL_RATIO, STATED_FLOW};
use super::valve_table::ValveTable;
use super::{ChamberModel, Exhausts, FeedsAWhen, PositionZero, Rig, UnknownKey};
use crate::effects;

/// One section of a rig file.
pub(super) struct Section {
    pub name: &'static str,
    pub what: &'static str,
}

const fn section(name: &'static str, what: &'static str) -> Section {
    Section { name, what }
}

/// The sections whose keys are numbers, choices or tables, in writing order.
#[rustfmt::skip]
pub(super) const SECTIONS: &[Section] = &[
    section("gas", "The working gas; dry air where the section is absent."),
    section("environment", "The surroundings. Walls and supply air have the ambient temperature."),
    section("supply", "The air supply. A recorded `p_s` drives the valve; where the pressure is declared too, `p_s` is predicted and compared."),
    section("valve", "A proportional directional valve with two working ports. What opens supply to one port opens exhaust of the other; both ports share the two area tables. In place of the tables and the critical pressure ratio the section may state the flow of the data sheet, see below."),
    section("cylinder", "The cylinder; `+x` enlarges chamber A. A bench may state a part of it."),
    section("vessel", "A closed chamber without a piston, for leak tests; its pressure is the signal `p_a`."),
    section("actuator", "A stem driven by a positioner; `u` and `x` are fractions."),
    section("chambers", "The gas in the chambers."),
    section("axis", "How the axis is mounted."),
    section("carriage", "The moving load with the piston."),
    section("friction", "LuGre friction of seals and guides. What is absent is absent from the model."),
    section("horizon", "The window of the normalised fit figures."),
];

/// The sections with names of their own inside.
#[rustfmt::skip]
pub(super) const OPEN_SECTIONS: &[Section] = &[
    section("signals", "Which column of a recording is which signal."),
    section("uncertainty", "One standard deviation of a stated value."),
    section("controller", "Gains of the board's controller that differ from the standard ones."),
    section("board", "The sensors at a board's terminals, by signal, where they are not 0 to 10 V for 0 to 10 bar absolute, -10 to 10 V for -0.25 to 0.25 m, and -10 to 10 V for -2 to 2 m/s."),
    section("effects", "Physics beyond the standard model, by name."),
];

/// The names of all sections.
pub(super) fn section_names() -> impl Iterator<Item = &'static str> {
    OPEN_SECTIONS
        .iter()
        .chain(SECTIONS)
        .map(|section| section.name)
}

const GAMMA: Limits = limits(
    1.0,
    2.0,
    "a ratio of specific heats between 1 and 2 (air: 1.4)",
);
const GAS_CONSTANT: Limits = limits(50.0, 5000.0, "J/(kg K) between 50 and 5000 (air: 287)");
/// Absolute pressures, Pa.
pub const PRESSURE: Limits = limits(
    1e4,
    1e8,
    "absolute Pa between 10 kPa and 100 MPa (is this bar, kPa or a gauge pressure?)",
);
/// Temperatures, K.
pub const TEMPERATURE: Limits =
    limits(100.0, 1000.0, "kelvin between 100 and 1000 (is this degC?)");
/// Valve commands, V.
pub const COMMAND: Limits = limits(-1000.0, 1000.0, "volts between -1000 and 1000");
const DISCHARGE_SLOPE: Limits = limits(-0.1, 0.25, "a number from -0.1 to 0.25");
const OPENING: Limits = limits(0.0, 1000.0, "volts from 0 to 1000");
const SPOOL_GAIN: Limits = limits(-0.1, 0.1, "metres per volt from -0.1 to 0.1");
const SHIFT: Limits = limits(-1.0, 1.0, "volts between -1 and 1");
const ROUNDNESS: Limits = limits(0.0, 1.0, "a part from 0 (straight lines) to 1 (smooth)");
const STROKE: Limits = positive(100.0, "metres above 0 and at most 100 (is this mm?)");
const BORE: Limits = positive(2.0, "metres above 0 and at most 2 (is this mm?)");
const PISTON_AREA: Limits = positive(3.0, "m2 above 0 and at most 3 (is this cm2 or mm2?)");
const DEAD_VOLUME: Limits = limits(0.0, 0.5, "m3 from 0 to 0.5 (is this litres or cm3?)");
const VESSEL_VOLUME: Limits = positive(1000.0, "m3 above 0 and at most 1000");
const VESSEL_SURFACE: Limits = positive(1000.0, "m2 above 0 and at most 1000 (is this cm2?)");
const STEM: Limits = limits(-1.0, 2.0, "a fraction, 0 shut to 1 open (is this %?)");
const TIME_CONSTANT: Limits = limits(0.0, 3600.0, "seconds from 0 to 3600");
const HEAT_TRANSFER: Limits = limits(0.0, 1e5, "W/(m2 K) from 0 to 100000");
const INDEX: Limits = limits(0.5, 2.0, "a polytropic index between 0.5 and 2");
const GAUGE_GAIN: Limits = limits(0.5, 2.0, "a factor from 0.5 to 2");
const INCLINATION: Limits = limits(-90.0, 90.0, "degrees from -90 to 90 (is this rad?)");
const MASS: Limits = positive(1e6, "kg above 0 and at most 1000000");
const FORCE: Limits = limits(-1e7, 1e7, "newtons between -1e7 and 1e7");
const FRICTION_FORCE: Limits = limits(0.0, 1e6, "newtons from 0 to 1000000");
const STIFFNESS: Limits = positive(1e12, "N/m above 0 and at most 1e12");
const DAMPING: Limits = limits(0.0, 1e9, "N s/m from 0 to 1e9");
const STRIBECK: Limits = positive(10.0, "m/s above 0 and at most 10 (is this mm/s?)");
const HORIZON: Limits = positive(1e5, "seconds above 0 and at most 100000");

/// One number of a section: its spelling, its limits and its place.
pub(super) struct NumberKey {
    pub name: &'static str,
    pub facts: Facts,
    pub limits: Limits,
    pub required: bool,
    pub get: fn(&Rig) -> Option<f64>,
    /// Stores the value; false when the rig does not have the section.
    pub set: fn(&mut Rig, f64) -> bool,
}

/// A row of [`NUMBERS`]: `field` is required in its section, `field?` may be
/// absent, `field = 0` may be left out and is then that number.
macro_rules! number {
    ($name:literal, $section:ident.$field:ident?, $limits:expr, $facts:expr) => {
        NumberKey {
            name: $name,
            facts: $facts,
            limits: $limits,
            required: false,
            get: |rig| rig.$section.as_ref().and_then(|section| section.$field),
            set: |rig, value| {
                let section = rig.$section.as_mut();
                section
                    .map(|section| section.$field = Some(value))
                    .is_some()
            },
        }
    };
    ($name:literal, $section:ident.$field:ident = 0, $limits:expr, $facts:expr) => {
        NumberKey {
            required: false,
            ..number!($name, $section.$field, $limits, $facts)
        }
    };
    ($name:literal, $section:ident.$field:ident, $limits:expr, $facts:expr) => {
        NumberKey {
            name: $name,
            facts: $facts,
            limits: $limits,
            required: true,
            get: |rig| rig.$section.as_ref().map(|section| section.$field),
            set: |rig, value| {
                let section = rig.$section.as_mut();
                section.map(|section| section.$field = value).is_some()
            },
        }
    };
}

#[rustfmt::skip]
pub(super) static NUMBERS: &[NumberKey] = &[
    number!("gas.gamma", gas.gamma, GAMMA,
        facts("1", "1.4", "ratio of the specific heats", "air and nitrogen: 1.4; helium and argon: 1.67")),
    number!("gas.gas_constant_J_kgK", gas.gas_constant_j_kgk, GAS_CONSTANT,
        facts("J/(kg K)", "287", "specific gas constant", "dry air: 287; nitrogen: 296.8")),
    number!("environment.pressure_Pa", environment.pressure_pa, PRESSURE,
        facts("Pa(abs)", "101325", "ambient pressure, from which gauge columns count", "barometer, or the weather report corrected to the altitude (-12 hPa per 100 m)")),
    number!("environment.temperature_K", environment.temperature_k, TEMPERATURE,
        facts("K", "293.15", "ambient temperature", "thermometer at the axis")),
    number!("supply.pressure_Pa", supply.pressure_pa, PRESSURE,
        facts("Pa(abs)", "700000", "pressure at the supply port of the valve", "reading of the regulator (gauge) plus the ambient pressure")),
    number!("valve.null_V", valve.null_v, COMMAND,
        facts("V", "5.0", "command at which both working ports are closed", "data sheet (0 to 10 V valves: 5.0 +- 0.1); measure: the middle of the commands at which the piston stands")),
    number!("valve.critical_pressure_ratio", valve.critical_pressure_ratio, RATIO,
        facts("1", "0.2 to 0.5", "ratio of downstream to upstream pressure below which the flow is choked", "data sheet: b of ISO 6358; typical 0.3 where it states none")),
    number!("valve.laminar_pressure_ratio", valve.laminar_pressure_ratio, RATIO,
        facts("1", "0.98", "pressure ratio above which the flow is proportional to the pressure difference", "typical; it hardly shows in motion")),
    number!("valve.discharge_slope", valve.discharge_slope?, DISCHARGE_SLOPE,
        facts("1", "0.0933", "linear term of the discharge coefficient over the pressure ratio, Cd(r) = 0.8153 + s r - 0.1038 r^2", "measured flow over pressure ratio; left out: 0.0933 of the paper")),
    number!("valve.edge_V", valve.edge_v?, OPENING,
        facts("V", "0.2 to 0.4", "opening at which the areas begin to rise, between the last point with the leakage alone and the next", "measure: the least command beside the null that moves the piston; left out: the last point with the leakage")),
    number!("valve.exhaust_shift_V", valve.exhaust_shift_v?, SHIFT,
        facts("V", "-0.03 to 0.03", "by how much later than by the table the exhaust paths open", "measure: the least command that vents a closed port, less the one that fills it; left out: 0")),
    number!("valve.curve_roundness", valve.curve_roundness?, ROUNDNESS,
        facts("1", "1", "shape between the points of the tables: 0 straight lines, 1 a smooth curve", "a real valve is smooth; left out: straight lines")),
    number!("valve.spool_gain_m_V", valve.spool_gain_m_v?, SPOOL_GAIN,
        facts("m/V", "4e-4", "displacement of the spool per volt of command, for the signal spool", "measure: `pneuma identify spool`")),
    number!("cylinder.stroke_m", cylinder.stroke_m?, STROKE,
        facts("m", "0.05 to 2", "stroke", "type code")),
    number!("cylinder.bore_m", cylinder.bore_m?, BORE,
        facts("m", "0.01 to 0.1", "bore; end faces and wall give the heat exchange surface", "type code")),
    number!("cylinder.area_a_m2", cylinder.area_a_m2?, PISTON_AREA,
        facts("m2", "4.9e-4 (bore 25 mm)", "piston area on the side of chamber A", "pi/4 bore^2, less the rod if it is on this side")),
    number!("cylinder.area_b_m2", cylinder.area_b_m2?, PISTON_AREA,
        facts("m2", "4.9e-4 (bore 25 mm, rodless)", "piston area on the side of chamber B", "pi/4 bore^2, less the rod if it is on this side")),
    number!("cylinder.dead_volume_a_m3", cylinder.dead_volume_a_m3?, DEAD_VOLUME,
        facts("m3", "10e-6 to 50e-6", "volume of chamber A at its end stop, with port, fittings and tube", "tube: pi/4 diameter^2 times length (12.6 cm3 per metre at 4 mm) plus the dead volume of the data sheet")),
    number!("cylinder.dead_volume_b_m3", cylinder.dead_volume_b_m3?, DEAD_VOLUME,
        facts("m3", "10e-6 to 50e-6", "volume of chamber B at its end stop, with port, fittings and tube", "as dead_volume_a_m3")),
    number!("vessel.volume_m3", vessel.volume_m3, VESSEL_VOLUME,
        facts("m3", "1e-4 to 0.1", "volume", "data sheet, or weigh it filled with water")),
    number!("vessel.surface_m2", vessel.surface_m2?, VESSEL_SURFACE,
        facts("m2", "0.01 to 1", "inner surface, for the heat exchange of the energy balance; that of a sphere of this volume if absent", "drawing")),
    number!("actuator.stem_at_zero_command", actuator.stem_at_zero_command, STEM,
        facts("1", "0", "position of the stem at rest for the command 0", "read it off")),
    number!("actuator.stem_at_full_command", actuator.stem_at_full_command, STEM,
        facts("1", "1", "position of the stem at rest for the command 1", "read it off")),
    number!("actuator.time_constant_s", actuator.time_constant_s, TIME_CONSTANT,
        facts("s", "0.2 to 5", "lag of the stem behind the command", "step response: time to 63 % of the travel")),
    number!("chambers.heat_transfer_charging_W_m2K", chambers.heat_transfer_charging_w_m2k?, HEAT_TRANSFER,
        facts("W/(m2 K)", "20 to 100", "heat transfer coefficient while the net flow into the chamber is not negative", "typical 50; measure with the stop method")),
    number!("chambers.heat_transfer_discharging_W_m2K", chambers.heat_transfer_discharging_w_m2k?, HEAT_TRANSFER,
        facts("W/(m2 K)", "10 to 50", "heat transfer coefficient while the net flow leaves the chamber", "typical 20; measure with the stop method")),
    number!("chambers.expansion_index", chambers.expansion_index?, INDEX,
        facts("1", "1.0 to 1.4", "polytropic index of expansion, for model = \"polytropic\"", "typical 1.11")),
    number!("chambers.compression_index", chambers.compression_index?, INDEX,
        facts("1", "1.0 to 1.4", "polytropic index of compression, for model = \"polytropic\"", "typical 1.18")),
    number!("chambers.gauge_gain_a", chambers.gauge_gain_a?, GAUGE_GAIN,
        facts("1", "0.995 to 1.005", "pressure that the gauge of chamber A shows over the true one, both absolute", "calibration certificate; left out: 1")),
    number!("chambers.gauge_gain_b", chambers.gauge_gain_b?, GAUGE_GAIN,
        facts("1", "0.995 to 1.005", "the same of chamber B", "calibration certificate; left out: 1")),
    number!("chambers.polytropic_index", chambers.polytropic_index?, INDEX,
        facts("1", "1.0 to 1.4", "index n of p V^n = constant, for model = \"polytropic-process\"", "1 isothermal, 1.4 adiabatic, typical 1.2")),
    number!("chambers.reference_pressure_Pa", chambers.reference_pressure_pa?, PRESSURE,
        facts("Pa(abs)", "the pressure at rest, 4e5 to 6e5", "pressure at which the gas of the reduced model has the ambient temperature, for model = \"polytropic\"; the supply pressure if absent, as the paper prints it", "mean of the chamber pressures at rest")),
    number!("axis.inclination_deg", axis.inclination_deg, INCLINATION,
        facts("deg", "0", "angle by which the direction +x points above the horizontal (90: +x is up); the weight of the moving mass acts along it", "spirit level")),
    number!("carriage.mass_kg", carriage.mass_kg, MASS,
        facts("kg", "1 to 30", "moving mass: piston, carriage and load", "weigh it, or data sheet plus load")),
    number!("carriage.external_force_N", carriage.external_force_n = 0, FORCE,
        facts("N", "0", "constant force against +x (cables, a counterweight); 0 if absent", "spring scale")),
    number!("friction.bristle_stiffness_N_m", friction.bristle_stiffness_n_m?, STIFFNESS,
        facts("N/m", "1e4 to 1e6", "stiffness before break-away (sigma0)", "typical; needs a position sensor of 2 um or finer")),
    number!("friction.bristle_damping_Ns_m", friction.bristle_damping_ns_m?, DAMPING,
        facts("N s/m", "100 to 1500", "damping before break-away (sigma1)", "typical")),
    number!("friction.viscous_Ns_m", friction.viscous_ns_m?, DAMPING,
        facts("N s/m", "30 to 150", "viscous friction (sigma2)", "force at constant speed over the speed")),
    number!("friction.coulomb_N", friction.coulomb_n?, FRICTION_FORCE,
        facts("N", "10 to 40 (bore 25 mm)", "sliding friction at low speed", "pressure difference times area while creeping; typical 4 to 8 % of piston area times supply gauge pressure")),
    number!("friction.static_N", friction.static_n?, FRICTION_FORCE,
        facts("N", "1.1 to 1.5 times coulomb_N", "break-away force", "pressure difference times area at which the piston starts")),
    number!("friction.stribeck_velocity_m_s", friction.stribeck_velocity_m_s?, STRIBECK,
        facts("m/s", "0.002 to 0.02", "speed over which static falls to sliding friction", "typical")),
    number!("horizon.seconds", horizon.seconds, HORIZON,
        facts("s", "0.25", "prediction window of the fit figures; 0.25 if absent", "choose: about the time constant of interest")),
];

/// A key that takes one of a few words.
pub(super) struct ChoiceKey {
    pub name: &'static str,
    pub facts: Facts,
    pub words: &'static [&'static str],
    /// Required with its section.
    pub required: bool,
    pub get: fn(&Rig) -> Option<usize>,
    /// Stores the word by its place in `words`.
    pub set: fn(&mut Rig, usize),
}

const FEEDS: [FeedsAWhen; 2] = [FeedsAWhen::AboveNull, FeedsAWhen::BelowNull];
const EXHAUSTS: [Exhausts; 2] = [Exhausts::One, Exhausts::Two];
const ZEROS: [PositionZero; 2] = [PositionZero::MidStroke, PositionZero::EndA];
const MODELS: [ChamberModel; 3] = [
    ChamberModel::EnergyBalance,
    ChamberModel::Polytropic,
    ChamberModel::PolytropicProcess,
];

fn place<T: PartialEq>(list: &[T], wanted: &T) -> Option<usize> {
    list.iter().position(|entry| entry == wanted)
}

pub(super) static CHOICES: &[ChoiceKey] = &[
    ChoiceKey {
        name: "valve.feeds_a_when",
        facts: facts(
            "",
            "above-null",
            "side of the null on which the valve feeds chamber A",
            "try a small command: +x enlarges chamber A",
        ),
        words: &["above-null", "below-null"],
        required: true,
        get: |rig| place(&FEEDS, &rig.valve.as_ref()?.feeds_a_when),
        set: |rig, word| {
            if let Some(valve) = &mut rig.valve {
                valve.feeds_a_when = FEEDS[word];
            }
        },
    },
    ChoiceKey {
        name: "valve.exhausts",
        facts: facts(
            "",
            "one",
            "whether both exhaust ports share one silencer or have one each; one if absent",
            "look at the valve: ports 3 and 5",
        ),
        words: &["one", "two"],
        required: false,
        get: |rig| place(&EXHAUSTS, &rig.valve.as_ref()?.exhausts?),
        set: |rig, word| {
            if let Some(valve) = &mut rig.valve {
                valve.exhausts = Some(EXHAUSTS[word]);
            }
        },
    },
    ChoiceKey {
        name: "cylinder.position_zero",
        facts: facts(
            "",
            "mid-stroke",
            "where x is 0: the middle of the stroke, or the end where chamber A is smallest; needed with stroke_m",
            "position sensor",
        ),
        words: &["mid-stroke", "end-a"],
        required: false,
        get: |rig| place(&ZEROS, &rig.cylinder.as_ref()?.position_zero?),
        set: |rig, word| {
            if let Some(cylinder) = &mut rig.cylinder {
                cylinder.position_zero = Some(ZEROS[word]);
            }
        },
    },
    ChoiceKey {
        name: "chambers.model",
        facts: facts(
            "",
            "energy-balance",
            "law of the gas: energy balance with heat exchange, reduced polytropic model with two indices, or a closed chamber",
            "energy-balance unless there is a reason",
        ),
        words: &["energy-balance", "polytropic", "polytropic-process"],
        required: true,
        get: |rig| place(&MODELS, &rig.chambers.as_ref()?.model),
        set: |rig, word| {
            if let Some(chambers) = &mut rig.chambers {
                chambers.model = MODELS[word];
            }
        },
    },
];

/// What a person needs to know of a key `section.key` or `effects.NAME.key`, and its range.
pub fn describe(key: &str) -> Option<Facts> {
    if let Some((name, parameter)) = effect_parameter(key) {
        return Some(effects::effect(name)?.parameter(parameter)?.facts());
    }
    let numbers = NUMBERS.iter().map(|number| (number.name, number.facts));
    let choices = CHOICES.iter().map(|choice| (choice.name, choice.facts));
    let tables = ValveTable::ALL.map(|table| (table.key(), table.facts()));
    let stated = STATED_FLOW.iter().map(|stated| (stated.name, stated.facts));
    let mut all = numbers.chain(choices).chain(tables).chain(stated);
    all.find(|(name, _)| *name == key).map(|(_, facts)| facts)
}

/// Every scalar number a rig file may hold outside `[signals]` and
/// `[effects.NAME]`, as `section.key`, in the order of the sections.
pub fn numeric_keys() -> impl Iterator<Item = &'static str> {
    NUMBERS.iter().map(|number| number.name)
}

/// The least and the largest value that a rig file admits at a key; for a valve
/// table those of its scale. `None` for a key that there is not.
pub fn key_bounds(key: &str) -> Option<(f64, f64)> {
    /// A table stretched or shrunk further than this is another table.
    const SCALE: (f64, f64) = (0.01, 100.0);
    /// An open end is kept away from by this part of the closed one.
    const MARGIN: f64 = 1e-12;
    if ValveTable::from_key(key).is_some() {
        return Some(SCALE);
    }
    let limits = &number(key)?.limits;
    let margin = MARGIN * limits.high.abs();
    let lower = limits.low + if limits.low_included { 0.0 } else { margin };
    let upper = limits.high - if limits.high_included { 0.0 } else { margin };
    Some((lower, upper))
}

pub(super) fn number(key: &str) -> Option<&'static NumberKey> {
    NUMBERS.iter().find(|number| number.name == key)
}

fn effect_parameter(key: &str) -> Option<(&str, &str)> {
    key.strip_prefix("effects.")?.rsplit_once('.')
}

/// Whether the entry of `[uncertainty]` for `key` is a standard deviation in
/// the unit of the value rather than a share of it.
pub(super) fn uncertainty_is_absolute(key: &str) -> bool {
    key.ends_with("_V") && ValveTable::from_key(key).is_none()
}

/// Gains of the board's controller: the key, its unit and what it is. Ranges and standard values
/// are those of [`firmware::settings::Gains`].
#[rustfmt::skip]
pub const GAINS: &[(&str, &str, &str)] = &[
    ("observer_pressure_per_s", "1/s", "how fast the observer follows the chamber pressures; lower where they are noisy"),
    ("observer_motion_per_s", "1/s", "how fast the observer follows position and velocity; lower where they are noisy"),
    ("observer_disturbance_per_s", "1/s", "how fast the observer learns the disturbance force"),
    ("observer_edge_per_s", "1/s", "how fast the observer learns the edges of the valve; 0 does not"),
    ("observer_friction_per_s", "1/s", "how fast the observer learns the friction; 0 does not"),
    ("position_per_s", "1/s", "bandwidth of the position loop; lower where the load swings"),
    ("force_per_s", "1/s", "bandwidth of the force loop"),
    ("approach_per_s", "1/s", "speed at which a position error loads the bristles of the friction feedforward"),
    ("rest_force_per_s", "1/s", "how fast the force at rest follows a position error"),
    ("damping", "1", "damping ratio of the position loop"),
    ("lead_s", "s", "time by which the feedforward runs ahead: 1.5 ticks plus the lag of the spool"),
    ("breakaway_margin", "1", "share of the Coulomb friction by which break-away may be exceeded"),
    ("slip_m_per_s", "m/s", "speed above which a load at rest counts as slipping"),
    ("rest_error_m", "m", "position error below which the load may come to rest"),
    ("lost_error_m", "m", "position error above which rest is given up"),
    ("indifferent_m", "m", "position error that is not corrected at rest"),
    ("move_velocity_m_per_s", "m/s", "speed limit of a move to a set-point"),
    ("move_acceleration_m_per_s2", "m/s2", "acceleration limit of a move to a set-point"),
    ("move_jerk_m_per_s3", "m/s3", "jerk limit of a move to a set-point"),
];

impl Rig {
    /// The number at `section.key` or `effects.NAME.key`; 1 for a valve table
    /// (its scale). `None` when the rig does not have it.
    pub fn value(&self, key: &str) -> Option<f64> {
        if ValveTable::from_key(key).is_some() {
            return self.valve.as_ref().map(|_| 1.0);
        }
        if let Some((effect, parameter)) = effect_parameter(key) {
            return self.effects.get(effect)?.get(parameter).copied();
        }
        (number(key)?.get)(self)
    }

    /// One standard deviation of what the engineer typed, in the unit of the
    /// value (for a valve table: of its scale). `None` where the value is
    /// exact: no entry, an entry of 0, or a share of a value that is 0.
    pub fn uncertainty_sd(&self, key: &str) -> Option<f64> {
        let entry = *self.uncertainty.get(key)?;
        let value = self.value(key)?;
        let deviation = if uncertainty_is_absolute(key) {
            entry
        } else {
            entry * value.abs()
        };
        (deviation > 0.0).then_some(deviation)
    }

    /// Every key that has a value in this rig, valve tables and effects
    /// included.
    pub fn value_keys(&self) -> Vec<String> {
        let numbers = numeric_keys()
            .chain(ValveTable::ALL.map(ValveTable::key))
            .filter(|key| self.value(key).is_some())
            .map(String::from);
        let effects = self.effects.iter().flat_map(|(name, parameters)| {
            parameters
                .keys()
                .map(move |key| format!("effects.{name}.{key}"))
        });
        numbers.chain(effects).collect()
    }

    /// A copy with some numbers replaced. A valve table is multiplied by its
    /// value; an effect that the rig does not have is added. Limits are not
    /// checked. A key without a place in this rig is a mistake of the caller:
    /// it is left out (and stops a debug build); see [`Rig::try_with_values`].
    #[must_use]
    pub fn with_values(&self, values: &BTreeMap<String, f64>) -> Self {
        let mut rig = self.clone();
        for (key, value) in values {
            let stored = rig.set_value(key, *value);
            debug_assert!(stored.is_ok(), "{stored:?}");
        }
        rig
    }

    /// As [`Rig::with_values`], reporting the first key without a place.
    pub fn try_with_values(&self, values: &BTreeMap<String, f64>) -> Result<Self, UnknownKey> {
        let mut rig = self.clone();
        for (key, value) in values {
            rig.set_value(key, *value)?;
        }
        Ok(rig)
    }

    /// Replaces one number in place; see [`Rig::with_values`].
    pub fn set_value(&mut self, key: &str, value: f64) -> Result<(), UnknownKey> {
        self.state_valve_by_tables(key);
        let stored = if let Some(table) = ValveTable::from_key(key) {
            self.scale_table(table, value)
        } else if let Some((effect, parameter)) = effect_parameter(key) {
            let parameters = self.effects.entry(effect.into()).or_default();
            parameters.insert(parameter.into(), value);
            true
        } else {
            number(key).is_some_and(|number| (number.set)(self, value))
        };
        self.signals.gauge_zero_pa = self.ambient_pressure_pa();
        stored
            .then_some(())
            .ok_or_else(|| UnknownKey(key.to_owned()))
    }

    /// A table or a ratio that is no longer that of the data sheet is stated by itself.
    fn state_valve_by_tables(&mut self, key: &str) {
        let derived = key == CRITICAL_RATIO || ValveTable::from_key(key).is_some();
        if let Some(valve) = self.valve.as_mut().filter(|_| derived) {
            valve.stated_flow = None;
        }
    }

    fn scale_table(&mut self, table: ValveTable, scale: f64) -> bool {
        let Some(valve) = &mut self.valve else {
            return false;
        };
        for point in table.points_mut(valve) {
            *point *= scale;
        }
        // The edge is one of the table's openings.
        if let Some(edge_v) = valve
            .edge_v
            .as_mut()
            .filter(|_| table == ValveTable::Opening)
        {
            *edge_v *= scale;
        }
        true
    }
}
