//! Physics that the standard model leaves out: one declaration per effect.
//!
//! A declaration holds the name, the parameters of `[effects.NAME]` with unit and neutral value,
//! the words and units of a verdict, the sizes from which it matters, when it can be there and how
//! it is tried, what shows it and what separates it from others. Rig files, `docs/rig.md`, the fits,
//! verdicts, advice and the settings of a board read it from here.
//!
//! To add one: its law in `model_core::left_out`, its declaration in a file of this folder, and its
//! line in [`EFFECTS`]. [`crate::model`] (or [`crate::gauge`]) hands its law to the axis.

pub mod candidate;
pub mod declaration;
pub mod flow;
pub mod friction;
pub mod gas;
pub mod load;
pub mod mark;
pub mod scene;
pub mod sensing;

use std::collections::BTreeMap;

use crate::rig::EffectFault;
use crate::text::expected_one_of;

pub use candidate::{Candidate, Edge};
pub use declaration::{Effect, EffectParameter, Half, Kind, Numbers};
pub use mark::Mark;
pub use scene::{ChamberGas, FRICTION_SHARE, Scene};

use flow::{
    chamber_leakage, exhaust_back_pressure, piston_leakage, port_throttle, slew_limit,
    spool_dynamics, supply_droop, tube_line, unknown_opening, valve_delay, valve_hysteresis,
};
use friction::{
    coulomb, direction_dependent, dwell_stiction, position_dependent, pressure_dependent, stribeck,
    viscous,
};
use gas::{dead_volume, gas_temperature, variable_heat_transfer, wall_temperature};
use load::{
    constant_force, end_cushion, force_equation, load_backlash, load_compliance, unknown_force,
};
use sensing::{
    gauge_gain, position_time_skew, pressure_sensor_lag, pressure_sensor_offset, unknown_reading,
};

/// Every effect, in the order in which they are tried and listed.
pub const EFFECTS: &[Effect] = &[
    gas_temperature::EFFECT,
    dead_volume::EFFECT,
    chamber_leakage::EFFECT,
    position_time_skew::EFFECT,
    pressure_sensor_lag::EFFECT,
    pressure_sensor_offset::EFFECT,
    gauge_gain::EFFECT,
    variable_heat_transfer::EFFECT,
    wall_temperature::EFFECT,
    piston_leakage::EFFECT,
    tube_line::EFFECT,
    valve_delay::EFFECT,
    spool_dynamics::EFFECT,
    slew_limit::EFFECT,
    valve_hysteresis::EFFECT,
    supply_droop::EFFECT,
    exhaust_back_pressure::EFFECT,
    port_throttle::EFFECT,
    end_cushion::EFFECT,
    coulomb::EFFECT,
    viscous::EFFECT,
    stribeck::EFFECT,
    pressure_dependent::EFFECT,
    constant_force::EFFECT,
    direction_dependent::EFFECT,
    position_dependent::EFFECT,
    dwell_stiction::EFFECT,
    load_compliance::EFFECT,
    load_backlash::EFFECT,
    unknown_force::EFFECT,
    force_equation::EFFECT,
    unknown_opening::EFFECT,
    unknown_reading::EFFECT,
];

/// The effect of that name.
pub fn effect(name: &str) -> Option<&'static Effect> {
    EFFECTS.iter().find(|effect| effect.name == name)
}

/// Whether this is a table that recordings asked for, and no physics with a name.
pub fn is_unnamed(name: &str) -> bool {
    effect(name).is_some_and(|effect| effect.kind == Kind::Unnamed)
}

/// Judges one `[effects.NAME]` of a rig file.
pub fn check(name: &str, parameters: &BTreeMap<String, f64>) -> Result<(), EffectFault> {
    let Some(effect) = effect(name) else {
        let known: Vec<&str> = EFFECTS.iter().map(|effect| effect.name).collect();
        return Err(EffectFault {
            parameter: None,
            problem: "unknown effect".into(),
            expected: expected_one_of(name, &known),
        });
    };
    for (key, value) in parameters {
        check_parameter(effect, key, *value)?;
    }
    Ok(())
}

fn check_parameter(effect: &Effect, key: &str, value: f64) -> Result<(), EffectFault> {
    let fault = |problem: String, expected: String| EffectFault {
        parameter: Some(key.into()),
        problem,
        expected,
    };
    let Some(parameter) = effect.parameter(key) else {
        let known: Vec<&str> = effect.parameters.iter().map(|known| known.key).collect();
        let expected = expected_one_of(key, &known);
        return Err(fault("unknown parameter".into(), expected));
    };
    if value >= parameter.least {
        return Ok(());
    }
    let expected = format!("a number of at least {}", parameter.least);
    Err(fault(format!("{value} is out of range"), expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of the trade's units one of the catalogue's is, by definition.
    fn by_definition(unit: &str, trade: &str) -> f64 {
        match (unit, trade) {
            ("m3", "L") | ("m", "mm") | ("s", "ms") => 1e3,
            ("m3", "cm³") | ("m2", "mm²") => 1e6,
            ("Pa", "kPa") | ("N/m", "N/mm") => 1e-3,
            ("N/Pa", "N/bar") => 1e5,
            ("1", "%") | ("1/m", "% per m") | ("1/m2", "% per m²") => 100.0,
            ("1", "")
            | ("signal", "command units")
            | ("signal/s", "command units per s")
            | ("m, m/s", "m or m/s")
            | ("kg/(s Pa2)", "kg/(s Pa²)")
            | ("N/m3", "N/m³")
            | ("N s2/m2", "N s²/m²")
            | ("W/(m2 K)", "W/(m² K)") => 1.0,
            (unit, trade) if unit == trade => 1.0,
            _ => f64::NAN,
        }
    }

    #[test]
    fn prop_every_parameter_is_said_in_words_and_in_a_unit_of_its_dimension() {
        for effect in EFFECTS {
            for one in effect.parameters {
                let times = by_definition(one.unit, one.trade_unit) / one.trade_factor();
                assert!((times - 1.0).abs() < 1e-12, "{}.{}", effect.name, one.key);
                assert!(!one.words.is_empty(), "{}.{}", effect.name, one.key);
            }
        }
    }

    #[test]
    fn prop_every_effect_has_its_own_name_words_and_a_recording_that_shows_it() {
        for (index, one) in EFFECTS.iter().enumerate() {
            let first = EFFECTS.iter().position(|other| other.name == one.name);
            assert_eq!(first, Some(index), "{}", one.name);
            let said = [one.what, one.meaning, one.shown_by];
            assert!(said.iter().all(|words| !words.is_empty()), "{}", one.name);
        }
    }

    /// A board is spared parameters that there are.
    #[test]
    fn prop_what_stays_off_a_board_is_declared() {
        for effect in EFFECTS {
            let keys = effect.off_board.map_or(&[][..], |(keys, _)| keys);
            for key in keys {
                assert!(effect.parameter(key).is_some(), "{}.{key}", effect.name);
            }
        }
    }
}
