//! The rig file: what an engineer knows of a rig.
//!
//! Responsibilities: read `rig.toml` (format `rig/1`), refuse what is unknown
//! or absurd with one line, offer the numbers as plain structs and as a flat
//! list for fits, and write a rig back.
//!
//! * [`Rig::read`], [`Rig::parse`]: text to structs (`read.rs`).
//! * [`Rig::faults`]: all that is wrong with a text, not the first fault alone.
//! * [`Rig::value`], [`Rig::uncertainty_sd`], [`Rig::with_values`]: the flat
//!   view, keyed by the TOML spelling `section.key` (`keys.rs`, `signals.rs`: the one
//!   table of spellings, limits, units and meanings).
//! * [`Rig::to_toml`]: structs to text (`write.rs`); [`Rig::edited`]: a person's text with
//!   changed numbers, its comments and order kept (`edit.rs`).
//! * [`mod@reference`]: the table as `docs/rig.md` and as a schema for editors.
//! * `board.rs`: what a board's converters show.
//! * `stated_flow.rs`: areas from the flow of a data sheet.
//!
//! All values are SI, pressures absolute. Every section is optional. The names
//! of `[effects.NAME]` are those of [`crate::effects`]; [`Rig::parse_with`] takes
//! another judge.
//!
//! Limits: comments and the layout of a rig file are kept by [`Rig::edited`] only.

mod board;
mod edit;
mod error;
mod facts;
mod keys;
mod read;
pub mod reference;
mod signals;
mod stated_flow;
mod valve_table;
mod write;

use std::collections::BTreeMap;

pub use board::{BOARD_CHANNELS, BoardChannel, BoardSensor, LinearSensor, Output};
pub use error::{EffectFault, RigError, UnknownKey};
pub use facts::{Facts, Limits, facts, limits, positive};
pub use keys::{COMMAND, GAINS, PRESSURE, TEMPERATURE, describe, key_bounds, numeric_keys};
pub use read::EffectCheck;
pub use read::{line_at, numeric, read_text, shown};
pub use valve_table::ValveTable;

pub use signals::signal_dimension;
pub use stated_flow::{StatedFlow, nominal_flow_of_conductance};
pub use write::quoted;

use crate::units::Unit;

/// The only format there is.
pub const FORMAT: &str = "rig/1";
/// Ambient pressure assumed for gauge columns when `[environment]` is absent.
pub const STANDARD_PRESSURE_PA: f64 = 101_325.0;
/// Prediction window for fit figures when `[horizon]` is absent.
pub const DEFAULT_HORIZON_S: f64 = 0.25;

/// A rig as its file describes it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// `[signals]`: which column is which signal.
    pub signals: Signals,
    /// `[gas]`.
    pub gas: Option<Gas>,
    /// `[environment]`.
    pub environment: Option<Environment>,
    /// `[supply]`.
    pub supply: Option<Supply>,
    /// `[valve]`.
    pub valve: Option<Valve>,
    /// `[cylinder]`.
    pub cylinder: Option<Cylinder>,
    /// `[vessel]`.
    pub vessel: Option<Vessel>,
    /// `[actuator]`.
    pub actuator: Option<Actuator>,
    /// `[chambers]`.
    pub chambers: Option<Chambers>,
    /// `[axis]`.
    pub axis: Option<Axis>,
    /// `[carriage]`.
    pub carriage: Option<Carriage>,
    /// `[friction]`.
    pub friction: Option<Friction>,
    /// `[horizon]`.
    pub horizon: Option<Horizon>,
    /// `[uncertainty]` as typed: relative, absolute for keys ending in `_V`
    /// that are no tables. [`Rig::uncertainty_sd`] gives absolute values.
    pub uncertainty: BTreeMap<String, f64>,
    /// `[controller]`: gains of the board's controller that are not the standard
    /// ones, by the names of [`firmware::settings::Gains`].
    pub controller: BTreeMap<String, f64>,
    /// `[board.SIGNAL]`: sensors at a board's terminals that are not the standard ones.
    pub board: BTreeMap<String, BoardSensor>,
    /// `[effects.NAME]`: left-out physics already modelled, with parameters.
    pub effects: BTreeMap<String, BTreeMap<String, f64>>,
}

/// `[signals]`, and the pressure that gauge columns count from.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// The signals by name (`t`, `u`, `p_a`, ...).
    pub by_name: BTreeMap<String, Signal>,
    /// Ambient pressure added to gauge columns: `[environment] pressure_Pa`.
    pub gauge_zero_pa: f64,
}

impl Default for Signals {
    fn default() -> Self {
        Self {
            by_name: BTreeMap::new(),
            gauge_zero_pa: STANDARD_PRESSURE_PA,
        }
    }
}

impl Signals {
    /// The signal of that name, if the rig records it.
    pub fn get(&self, name: &str) -> Option<&Signal> {
        self.by_name.get(name)
    }

    /// True if the rig records a signal of that name.
    pub fn contains(&self, name: &str) -> bool {
        self.by_name.contains_key(name)
    }

    /// All signals with their names, in alphabetical order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Signal)> {
        self.by_name
            .iter()
            .map(|(name, signal)| (name.as_str(), signal))
    }
}

/// One signal: its column and its way to SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// Where the signal stands in the file.
    pub column: Column,
    /// The unit of the column.
    pub unit: Unit,
    /// Declared standard deviation of the noise, SI (after scaling).
    pub noise: Option<f64>,
    /// Declared quantum, SI (after scaling).
    pub resolution: Option<f64>,
    /// Gain applied after the conversion to SI.
    pub scale: Option<f64>,
    /// Offset added after the gain, SI.
    pub offset: Option<f64>,
}

impl Signal {
    /// Converts a recorded number to SI: unit, then scale and offset, then the
    /// ambient pressure for a gauge column (a gain of a gauge sensor must not
    /// scale the atmosphere).
    pub fn to_si(&self, recorded: f64, gauge_zero_pa: f64) -> f64 {
        let scaled =
            self.unit.to_si(recorded) * self.scale.unwrap_or(1.0) + self.offset.unwrap_or(0.0);
        if self.unit.is_gauge() {
            scaled + gauge_zero_pa
        } else {
            scaled
        }
    }

    /// The number to record for an SI value: the inverse of [`Signal::to_si`].
    pub fn from_si(&self, value_si: f64, gauge_zero_pa: f64) -> f64 {
        let counted = if self.unit.is_gauge() {
            value_si - gauge_zero_pa
        } else {
            value_si
        };
        let unscaled = (counted - self.offset.unwrap_or(0.0)) / self.scale.unwrap_or(1.0);
        (unscaled - self.unit.to_si(0.0)) / self.unit.factor()
    }
}

/// A column of a recording, or what stands in for one.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// By its name in the header line.
    Name(String),
    /// By its number, from 0.
    Number(usize),
    /// None: the signal has this value in every row, in its unit.
    Constant(f64),
    /// None, for the time: the rows are this far apart, in its unit.
    Every(f64),
}

/// `[gas]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gas {
    /// Ratio of the specific heats.
    pub gamma: f64,
    /// Specific gas constant, J/(kg K).
    pub gas_constant_j_kgk: f64,
}

/// `[environment]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Environment {
    /// Ambient pressure, Pa absolute.
    pub pressure_pa: f64,
    /// Ambient temperature, K.
    pub temperature_k: f64,
}

/// `[supply]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Supply {
    /// Supply pressure, Pa absolute.
    pub pressure_pa: f64,
}

/// Which side of the null position feeds chamber A.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FeedsAWhen {
    /// A command above the null feeds A.
    #[default]
    AboveNull,
    /// A command below the null feeds A.
    BelowNull,
}

/// How the valve's exhaust paths leave it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Exhausts {
    /// Through one port.
    #[default]
    One,
    /// Each through its own, as ports 3 and 5 of a 5/3 valve.
    Two,
}

/// `[valve]`: a proportional directional valve with mirrored ports.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Valve {
    /// Which side of the null feeds chamber A.
    pub feeds_a_when: FeedsAWhen,
    /// How the exhaust paths leave it; one port where the file does not say.
    pub exhausts: Option<Exhausts>,
    /// Command at which both ports are shut, V.
    pub null_v: f64,
    /// Pressure ratio below which the flow is choked.
    pub critical_pressure_ratio: f64,
    /// Pressure ratio above which the flow is laminar.
    pub laminar_pressure_ratio: f64,
    /// Linear term of the discharge coefficient over the pressure ratio.
    pub discharge_slope: Option<f64>,
    /// Where the areas begin to rise, V: between the last point with the leakage and the next.
    pub edge_v: Option<f64>,
    /// By how much later than by the table the exhaust paths open, V.
    pub exhaust_shift_v: Option<f64>,
    /// From chords between the points of the tables, 0, to a smooth curve through them, 1.
    pub curve_roundness: Option<f64>,
    /// Displacement of the spool per volt of command, m/V.
    pub spool_gain_m_v: Option<f64>,
    /// Opening `abs(u - null)` of the points of both tables, V, increasing.
    pub opening_v: Vec<f64>,
    /// Orifice area from the supply at those openings, m2.
    pub supply_area_m2: Vec<f64>,
    /// Orifice area to the exhaust at those openings, m2.
    pub exhaust_area_m2: Vec<f64>,
    /// The data sheet's flow, where tables and critical ratio follow from it.
    pub stated_flow: Option<StatedFlow>,
}

/// Where `x` is zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PositionZero {
    /// In the middle of the stroke.
    MidStroke,
    /// Where chamber A is smallest.
    EndA,
}

/// `[cylinder]`: `+x` enlarges chamber A. A bench may know a part of it only.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cylinder {
    /// Stroke, m.
    pub stroke_m: Option<f64>,
    /// Bore, m: end faces and `pi * bore` give the heat-exchange surface.
    pub bore_m: Option<f64>,
    /// Piston area on the side of A, m2.
    pub area_a_m2: Option<f64>,
    /// Piston area on the side of B, m2.
    pub area_b_m2: Option<f64>,
    /// Volume of A at its end stop, with tubes, m3.
    pub dead_volume_a_m3: Option<f64>,
    /// Volume of B at its end stop, with tubes, m3.
    pub dead_volume_b_m3: Option<f64>,
    /// Where `x` is zero; present whenever the stroke is.
    pub position_zero: Option<PositionZero>,
}

/// `[vessel]`: a chamber without a piston; its pressure is the signal `p_a`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vessel {
    /// Volume, m3.
    pub volume_m3: f64,
    /// Surface of the wall for the heat exchange, m2; none where the file does not say.
    pub surface_m2: Option<f64>,
}

/// `[actuator]`: a stem driven by a positioner; signals `u` (command) and `x`
/// (stem), both fractions 0 to 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Actuator {
    /// Stem at rest for the command 0.
    pub stem_at_zero_command: f64,
    /// Stem at rest for the command 1.
    pub stem_at_full_command: f64,
    /// Lag of the stem behind the command, s.
    pub time_constant_s: f64,
}

/// The law of the gas in the chambers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChamberModel {
    /// Mass and energy balance with heat exchange at the wall.
    #[default]
    EnergyBalance,
    /// Polytropic with separate indices, the paper's simplified law.
    Polytropic,
    /// A closed chamber: `p V^n` stays constant.
    PolytropicProcess,
}

/// `[chambers]`: each model needs its own keys and admits the others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chambers {
    /// The law.
    pub model: ChamberModel,
    /// Heat transfer while the net flow into the chamber is >= 0, W/(m2 K).
    pub heat_transfer_charging_w_m2k: Option<f64>,
    /// Heat transfer otherwise, W/(m2 K).
    pub heat_transfer_discharging_w_m2k: Option<f64>,
    /// Polytropic index of expansion.
    pub expansion_index: Option<f64>,
    /// Polytropic index of compression.
    pub compression_index: Option<f64>,
    /// Shown over true pressure of chamber A's gauge.
    pub gauge_gain_a: Option<f64>,
    /// The same of chamber B's.
    pub gauge_gain_b: Option<f64>,
    /// Index of the closed chamber's process.
    pub polytropic_index: Option<f64>,
    /// Pressure at which the gas of the polytropic model has the wall's temperature, Pa
    /// absolute; the supply pressure where the file does not say.
    pub reference_pressure_pa: Option<f64>,
}

/// `[axis]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// Angle by which +x points above the horizontal, degrees.
    pub inclination_deg: f64,
}

/// `[carriage]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Carriage {
    /// Moved mass, kg.
    pub mass_kg: f64,
    /// Constant force against `+x`, N; 0 when the file does not say.
    pub external_force_n: f64,
}

/// `[friction]`: LuGre; what a rig does not give is absent from its model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Friction {
    /// Stiffness of the bristles, N/m.
    pub bristle_stiffness_n_m: Option<f64>,
    /// Damping of the bristles, N s/m.
    pub bristle_damping_ns_m: Option<f64>,
    /// Viscous friction, N s/m.
    pub viscous_ns_m: Option<f64>,
    /// Coulomb friction, N.
    pub coulomb_n: Option<f64>,
    /// Static friction, N.
    pub static_n: Option<f64>,
    /// Stribeck velocity, m/s.
    pub stribeck_velocity_m_s: Option<f64>,
}

/// `[horizon]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Horizon {
    /// Prediction window for fit figures, s.
    pub seconds: f64,
}

impl Rig {
    /// Whether `[valve]` states the flow of a data sheet, and no areas over the opening.
    pub fn states_flow(&self) -> bool {
        let valve = self.valve.as_ref();
        valve.is_some_and(|valve| valve.stated_flow.is_some())
    }

    /// Ambient pressure, Pa absolute: of the file, or the standard one.
    pub fn ambient_pressure_pa(&self) -> f64 {
        self.environment
            .as_ref()
            .map_or(STANDARD_PRESSURE_PA, |environment| environment.pressure_pa)
    }

    /// Prediction window for fit figures, s.
    pub fn horizon_s(&self) -> f64 {
        self.horizon
            .as_ref()
            .map_or(DEFAULT_HORIZON_S, |horizon| horizon.seconds)
    }
}
