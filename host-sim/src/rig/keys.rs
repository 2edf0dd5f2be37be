//! The one home of the spellings, limits and places of a rig's numbers, and
//! the flat view built on it.
//!
//! A key is `section.key` as the file spells it, or `effects.NAME.key`. The
//! three valve tables appear in the flat view as the scale of the whole table:
//! their value is 1, and setting 1.1 makes every entry a tenth larger.

use std::collections::BTreeMap;

use super::{ChamberModel, Exhausts, FeedsAWhen, PositionZero, Rig, UnknownKey, Valve};

/// The sections whose keys are numbers, choices or tables, in writing order.
pub(super) const SECTIONS: &[&str] = &[
    "gas",
    "environment",
    "supply",
    "valve",
    "cylinder",
    "vessel",
    "actuator",
    "chambers",
    "carriage",
    "friction",
    "horizon",
];

/// The sections with names of their own inside.
pub(super) const OPEN_SECTIONS: &[&str] = &["signals", "uncertainty", "controller", "effects"];

/// What a number may be, and how a line says so.
pub(crate) struct Limits {
    pub low: f64,
    pub high: f64,
    /// Whether `low` itself is admitted.
    pub low_included: bool,
    /// Whether `high` itself is admitted.
    pub high_included: bool,
    pub expected: &'static str,
}

impl Limits {
    pub(crate) fn admit(&self, value: f64) -> bool {
        let above = value > self.low || (self.low_included && value >= self.low);
        let below = value < self.high || (self.high_included && value <= self.high);
        above && below
    }
}

pub(crate) const fn limits(low: f64, high: f64, expected: &'static str) -> Limits {
    Limits {
        low,
        high,
        low_included: true,
        high_included: true,
        expected,
    }
}

pub(crate) const fn positive(high: f64, expected: &'static str) -> Limits {
    Limits {
        low: 0.0,
        high,
        low_included: false,
        high_included: true,
        expected,
    }
}

const RATIO: Limits = Limits {
    low: 0.0,
    high: 1.0,
    low_included: false,
    high_included: false,
    expected: "a ratio above 0 and below 1",
};
const GAMMA: Limits = limits(
    1.0,
    2.0,
    "a ratio of specific heats between 1 and 2 (air: 1.4)",
);
const GAS_CONSTANT: Limits = limits(50.0, 5000.0, "J/(kg K) between 50 and 5000 (air: 287)");
pub(crate) const PRESSURE: Limits = limits(
    1e4,
    1e8,
    "absolute Pa between 10 kPa and 100 MPa (is this bar, kPa or a gauge pressure?)",
);
pub(crate) const TEMPERATURE: Limits =
    limits(100.0, 1000.0, "kelvin between 100 and 1000 (is this degC?)");
pub(crate) const COMMAND: Limits = limits(-1000.0, 1000.0, "volts between -1000 and 1000");
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
    pub limits: Limits,
    pub required: bool,
    pub get: fn(&Rig) -> Option<f64>,
    /// Stores the value; false when the rig does not have the section.
    pub set: fn(&mut Rig, f64) -> bool,
}

/// A row of [`NUMBERS`]: `field` is required in its section, `field?` may be
/// absent, `field = 0` may be left out and is then that number.
macro_rules! number {
    ($name:literal, $section:ident.$field:ident?, $limits:expr) => {
        NumberKey {
            name: $name,
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
    ($name:literal, $section:ident.$field:ident = 0, $limits:expr) => {
        NumberKey {
            required: false,
            ..number!($name, $section.$field, $limits)
        }
    };
    ($name:literal, $section:ident.$field:ident, $limits:expr) => {
        NumberKey {
            name: $name,
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
    number!("gas.gamma", gas.gamma, GAMMA),
    number!("gas.gas_constant_J_kgK", gas.gas_constant_j_kgk, GAS_CONSTANT),
    number!("environment.pressure_Pa", environment.pressure_pa, PRESSURE),
    number!("environment.temperature_K", environment.temperature_k, TEMPERATURE),
    number!("supply.pressure_Pa", supply.pressure_pa, PRESSURE),
    number!("valve.null_V", valve.null_v, COMMAND),
    number!("valve.critical_pressure_ratio", valve.critical_pressure_ratio, RATIO),
    number!("valve.laminar_pressure_ratio", valve.laminar_pressure_ratio, RATIO),
    number!("cylinder.stroke_m", cylinder.stroke_m?, STROKE),
    number!("cylinder.bore_m", cylinder.bore_m?, BORE),
    number!("cylinder.area_a_m2", cylinder.area_a_m2?, PISTON_AREA),
    number!("cylinder.area_b_m2", cylinder.area_b_m2?, PISTON_AREA),
    number!("cylinder.dead_volume_a_m3", cylinder.dead_volume_a_m3?, DEAD_VOLUME),
    number!("cylinder.dead_volume_b_m3", cylinder.dead_volume_b_m3?, DEAD_VOLUME),
    number!("vessel.volume_m3", vessel.volume_m3, VESSEL_VOLUME),
    number!("vessel.surface_m2", vessel.surface_m2?, VESSEL_SURFACE),
    number!("actuator.stem_at_zero_command", actuator.stem_at_zero_command, STEM),
    number!("actuator.stem_at_full_command", actuator.stem_at_full_command, STEM),
    number!("actuator.time_constant_s", actuator.time_constant_s, TIME_CONSTANT),
    number!("chambers.heat_transfer_charging_W_m2K", chambers.heat_transfer_charging_w_m2k?, HEAT_TRANSFER),
    number!("chambers.heat_transfer_discharging_W_m2K", chambers.heat_transfer_discharging_w_m2k?, HEAT_TRANSFER),
    number!("chambers.expansion_index", chambers.expansion_index?, INDEX),
    number!("chambers.compression_index", chambers.compression_index?, INDEX),
    number!("chambers.polytropic_index", chambers.polytropic_index?, INDEX),
    number!("chambers.reference_pressure_Pa", chambers.reference_pressure_pa?, PRESSURE),
    number!("carriage.mass_kg", carriage.mass_kg, MASS),
    number!("carriage.external_force_N", carriage.external_force_n = 0, FORCE),
    number!("friction.bristle_stiffness_N_m", friction.bristle_stiffness_n_m?, STIFFNESS),
    number!("friction.bristle_damping_Ns_m", friction.bristle_damping_ns_m?, DAMPING),
    number!("friction.viscous_Ns_m", friction.viscous_ns_m?, DAMPING),
    number!("friction.coulomb_N", friction.coulomb_n?, FRICTION_FORCE),
    number!("friction.static_N", friction.static_n?, FRICTION_FORCE),
    number!("friction.stribeck_velocity_m_s", friction.stribeck_velocity_m_s?, STRIBECK),
    number!("horizon.seconds", horizon.seconds, HORIZON),
];

/// A key that takes one of a few words.
pub(super) struct ChoiceKey {
    pub name: &'static str,
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

/// One of the three tables of the valve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValveTable {
    /// `valve.opening_V`; its scale stretches the opening.
    Opening,
    /// `valve.supply_area_m2`.
    SupplyArea,
    /// `valve.exhaust_area_m2`.
    ExhaustArea,
}

impl ValveTable {
    /// All three, in the order of the file.
    pub const ALL: [Self; 3] = [Self::Opening, Self::SupplyArea, Self::ExhaustArea];

    /// The spelling `section.key`.
    pub fn key(self) -> &'static str {
        match self {
            Self::Opening => "valve.opening_V",
            Self::SupplyArea => "valve.supply_area_m2",
            Self::ExhaustArea => "valve.exhaust_area_m2",
        }
    }

    /// The table of that key.
    pub fn from_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|table| table.key() == key)
    }

    /// The points of the table.
    pub fn points(self, valve: &Valve) -> &Vec<f64> {
        match self {
            Self::Opening => &valve.opening_v,
            Self::SupplyArea => &valve.supply_area_m2,
            Self::ExhaustArea => &valve.exhaust_area_m2,
        }
    }

    pub(super) fn points_mut(self, valve: &mut Valve) -> &mut Vec<f64> {
        match self {
            Self::Opening => &mut valve.opening_v,
            Self::SupplyArea => &mut valve.supply_area_m2,
            Self::ExhaustArea => &mut valve.exhaust_area_m2,
        }
    }

    /// What one entry may be.
    pub(super) fn limits(self) -> Limits {
        match self {
            Self::Opening => limits(0.0, 1000.0, "volts from 0 to 1000"),
            Self::SupplyArea | Self::ExhaustArea => {
                limits(0.0, 0.01, "m2 from 0 to 0.01 (is this mm2?)")
            }
        }
    }
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

    fn scale_table(&mut self, table: ValveTable, scale: f64) -> bool {
        let Some(valve) = &mut self.valve else {
            return false;
        };
        for point in table.points_mut(valve) {
            *point *= scale;
        }
        true
    }
}
