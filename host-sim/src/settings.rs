//! From a rig to the settings of a board, and on to the controller: the one way
//! there, for the chip, for QEMU and for the host.
//!
//! The numbers come from [`Values::axis`], which knows which key feeds which
//! parameter. What is built from the settings is compared with that axis: a
//! parameter that the settings have no place for cannot be lost in silence.
//! What belongs to a sensor, a logger or a recording stays behind, and
//! [`stays_behind`] says so. Gains that `[controller]` does not give are the
//! standard ones; a lag of the gauges slows the observer down.

use crate::effects::flow::{slew_limit, spool_dynamics, valve_delay, valve_hysteresis};
use crate::effects::{EFFECTS, Effect, EffectParameter, sensing};
use crate::gauge::GAIN_KEYS;
use crate::model::{AxisFault, Values};
use crate::rig::{BOARD_CHANNELS, Rig};
use firmware::codes::{POSITION_M, Scale};
use firmware::settings::{
    Ambient, Carriage, Chamber, Chambers, Column, CommandPath, Connection, Friction, FrictionTerms,
    Gains, Gas, MechanicalEffects, Sensors, Settings, SettingsFault, Tube, Valve, Wiring,
};
use model_core::axis::Axis;
use model_core::chamber;
use model_core::controller::Controller;
use model_core::left_out::ChamberLeakage;
use model_core::real::Real;
use model_core::valve::{AreaTable, TABLE_CAPACITY};

/// Steps for which axis and settings are compared; what they hold does not
/// depend on it.
const COMPARED_STEP_S: f64 = 1e-3;

/// What of a rig does not go into the settings: a line each, the key first.
pub fn stays_behind(rig: &Rig) -> Vec<String> {
    let is_told = |effect: &str, known: &EffectParameter| {
        let value = rig.value(&format!("effects.{effect}.{}", known.key));
        let is_neutral = |value: f64| {
            known
                .neutral
                .is_some_and(|none| none.total_cmp(&value).is_eq())
        };
        value.is_some_and(|value| !is_neutral(value))
    };
    let of_effect = |effect: &Effect| {
        let Some((parameters, reason)) = effect.off_board else {
            return Vec::new();
        };
        let name = effect.name;
        let told = effect.parameters.iter();
        let told: Vec<&str> = told
            .filter(|known| is_told(name, known))
            .map(|known| known.key)
            .collect();
        if parameters.is_empty() {
            let line = format!("effects.{name}: {reason}");
            return (!told.is_empty()).then_some(line).into_iter().collect();
        }
        let meant = told.iter().filter(|key| parameters.contains(key));
        let lines = meant.map(|key| format!("effects.{name}.{key}: {reason}"));
        lines.collect::<Vec<_>>()
    };
    let gains = GAIN_KEYS.into_iter().filter(|key| {
        rig.value(key)
            .is_some_and(|gain| gain.total_cmp(&1.0).is_ne())
    });
    let gains = gains.map(|key| format!("{key}: {}", sensing::WHY_OFF_BOARD));
    let effects = EFFECTS.iter().flat_map(of_effect);
    effects.chain(gains).collect()
}

/// Why a rig makes no settings: one line that begins with the rig's key or with
/// the name of the number in the settings.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigSettingsError {
    /// The rig says too little, or something that no board can have.
    #[error("{}: {}, expected {}", .0.key, .0.problem, .0.expected)]
    Rig(AxisFault),
    /// A number that a board would refuse.
    #[error("{0}")]
    Refused(SettingsFault),
    /// The settings do not give the axis or the gains of the rig.
    #[error("the settings have no place for a parameter of this rig's axis or controller")]
    Incomplete,
}

impl From<RigSettingsError> for AxisFault {
    fn from(error: RigSettingsError) -> Self {
        let line = error.to_string();
        let (key, expected) = match error {
            RigSettingsError::Rig(fault) => return fault,
            RigSettingsError::Refused(fault) => (fault.field(), "a number that a board accepts"),
            RigSettingsError::Incomplete => ("effects", "effects of the catalogue"),
        };
        let problem = line.strip_prefix(&format!("{key}: ")).unwrap_or(&line);
        Self {
            key: key.into(),
            problem: problem.into(),
            expected: expected.into(),
        }
    }
}

/// The settings of a rig, of whose wiring nothing is known.
pub fn settings(rig: &Rig) -> Result<Settings, RigSettingsError> {
    check_rig(rig).map_err(RigSettingsError::Rig)?;
    let values = Values::<f32> {
        rig,
        keys: &[],
        replaced: &[],
    };
    let mut axis = values
        .axis(COMPARED_STEP_S)
        .map_err(RigSettingsError::Rig)?;
    axis.valve = with_one_column(axis.valve);
    let gains = gains(rig).ok_or(RigSettingsError::Incomplete)?;
    let sensors = sensors(rig).map_err(RigSettingsError::Rig)?;
    let settings = settings_of(&values, &axis, (gains, sensors));
    let built = settings
        .axis(axis.dt_s)
        .map_err(RigSettingsError::Refused)?;
    if built != axis {
        return Err(RigSettingsError::Incomplete);
    }
    Ok(settings)
}

/// The settings of a rig whose wiring was checked or not.
pub fn wired(rig: &Rig, wiring: Wiring) -> Result<Settings, RigSettingsError> {
    let settings = settings(rig)?;
    Ok(Settings { wiring, ..settings })
}

/// How the axis of a rig is connected, its wiring checked or not.
pub fn connection(rig: &Rig, wiring: Wiring) -> Result<Connection, AxisFault> {
    let sensors = sensors(rig)?;
    Ok(Connection { wiring, sensors })
}

/// The controller of a rig for ticks of `dt_s`, by the way that a board takes:
/// rig, settings, judgement, controller.
pub fn controller(rig: &Rig, dt_s: f64) -> Result<Controller<f32>, RigSettingsError> {
    settings(rig)?
        .try_build(f32::from_f64(dt_s))
        .map_err(RigSettingsError::Refused)
}

fn check_rig(rig: &Rig) -> Result<(), AxisFault> {
    let fault = |key: &str, problem: &str, expected: &str| {
        Err(AxisFault {
            key: key.into(),
            problem: problem.into(),
            expected: expected.into(),
        })
    };
    if rig.actuator.is_some() {
        return fault(
            "actuator",
            "a positioner with its own controller is no axis",
            "[valve] and [cylinder] in its place",
        );
    }
    let half_stroke = rig.cylinder.as_ref().and_then(|cylinder| cylinder.stroke_m);
    let is_about_middle = rig
        .cylinder
        .as_ref()
        .is_none_or(|cylinder| cylinder.position_zero == Some(crate::rig::PositionZero::MidStroke));
    if half_stroke.is_some() && !is_about_middle {
        return fault(
            "cylinder.position_zero",
            &format!(
                "the board's position converter reads {} to {} m",
                POSITION_M.lowest, POSITION_M.highest
            ),
            "\"mid-stroke\"",
        );
    }
    Ok(())
}

fn settings_of(
    values: &Values<'_, f32>,
    axis: &Axis<f32>,
    (controller, sensors): (Gains, Sensors),
) -> Settings {
    let pneumatics = &axis.pneumatics;
    let (levels, bristle) = (&axis.friction, &axis.carriage.bristle);
    let terms = &axis.friction_terms;
    let shared = &pneumatics.chamber_a;
    Settings {
        gas: Gas {
            heat_capacity_ratio: pneumatics.gas.heat_capacity_ratio,
            gas_constant_j_per_kg_k: pneumatics.gas.gas_constant_j_per_kg_k,
        },
        ambient: Ambient {
            pressure_pa: pneumatics.ambient.pressure_pa,
            temperature_k: pneumatics.ambient.temperature_k,
        },
        valve: valve(&axis.valve),
        command_path: command_path(values),
        chambers: Chambers {
            thermal: shared.thermal.into(),
            heat_transfer_charging_w_per_m2_k: shared.heat_transfer_charging_w_per_m2_k,
            heat_transfer_discharging_w_per_m2_k: shared.heat_transfer_discharging_w_per_m2_k,
        },
        chamber_a: chamber(&pneumatics.chamber_a, &pneumatics.leak_a),
        chamber_b: chamber(&pneumatics.chamber_b, &pneumatics.leak_b),
        tube: Tube {
            length_m: pneumatics.tube.length_m,
            diameter_m: pneumatics.tube.diameter_m,
        },
        carriage: Carriage {
            mass_kg: axis.carriage.mass_kg,
            external_force_n: axis.carriage.external_force_n,
        },
        friction: Friction {
            bristle_stiffness_n_per_m: bristle.stiffness_n_per_m,
            bristle_damping_n_s_per_m: bristle.damping_n_s_per_m,
            stribeck_velocity_m_per_s: bristle.stribeck_velocity_m_per_s,
            coulomb_n: levels.coulomb_n,
            static_n: levels.static_n,
            viscous_n_s_per_m: levels.viscous_n_s_per_m,
        },
        friction_terms: FrictionTerms {
            coulomb_n: terms.coulomb_n,
            stribeck_n: terms.stribeck_n,
            viscous_n_s_per_m: terms.viscous_n_s_per_m,
            per_mean_pressure_n_per_pa: terms.per_mean_pressure_n_per_pa,
            per_pressure_difference_n_per_pa: terms.per_pressure_difference_n_per_pa,
            static_rise_per_mean_pressure_n_per_pa: terms.static_rise_per_mean_pressure_n_per_pa,
            constant_force_n: terms.constant_force_n,
        },
        pneumatic_effects: pneumatics.into(),
        mechanical_effects: MechanicalEffects::from(values.carriage_effects()),
        controller,
        wiring: Wiring::Unchecked,
        sensors,
    }
}

/// What the board's converters show, `[board.SIGNAL]`.
pub fn sensors(rig: &Rig) -> Result<Sensors, AxisFault> {
    let [position, pressure_a, pressure_b, supply, velocity] = BOARD_CHANNELS
        .each_ref()
        .map(|input| rig.board_scale(input));
    let needed = |scale: Option<Scale>, key: &str| scale.ok_or_else(|| AxisFault::missing(key));
    let supply = match supply {
        Some(scale) => scale,
        None => {
            let declared = rig.value("supply.pressure_Pa").ok_or_else(|| AxisFault {
                key: "supply.pressure_Pa".into(),
                problem: "missing, and [board.p_s] says that there is no sensor".into(),
                expected: "the pressure that the board shall take for granted".into(),
            })?;
            Scale::new(declared as f32, declared as f32)
        }
    };
    Ok(Sensors {
        position_m: needed(position, "board.x")?,
        pressure_a_pa: needed(pressure_a, "board.p_a")?,
        pressure_b_pa: needed(pressure_b, "board.p_b")?,
        supply_pressure_pa: supply,
        velocity_m_per_s: velocity,
    })
}

/// The valve with one column of openings, as a board has it: the supply's, and of the exhaust's own
/// as many as there is room for, from the edge on. A table that cannot be one stays, and is missed
/// when the settings are compared.
fn with_one_column(valve: model_core::valve::Valve<f32>) -> model_core::valve::Valve<f32> {
    let (supply, exhaust) = (&valve.supply, &valve.exhaust);
    if supply.openings_v() == exhaust.openings_v() {
        return valve;
    }
    let mut openings_v = supply.openings_v().to_vec();
    let own = exhaust.openings_v().iter();
    let own = own.filter(|own_v| !supply.openings_v().contains(own_v));
    openings_v.extend(own.take(TABLE_CAPACITY - openings_v.len()));
    openings_v.sort_by(f32::total_cmp);
    let [supply, exhaust] = [supply, exhaust].map(|table| at_openings(&openings_v, table));
    model_core::valve::Valve {
        supply,
        exhaust,
        ..valve
    }
}

fn at_openings(openings_v: &[f32], table: &AreaTable<f32>) -> AreaTable<f32> {
    let mut most_m2 = 0.0_f64;
    let area_m2 = |opening_v: &f32| {
        let area_m2 = table.area_m2(opening_v * table.opening_stretch) / table.area_scale;
        most_m2 = most_m2.max(f64::from(area_m2));
        most_m2
    };
    let areas_m2: Vec<f64> = openings_v.iter().map(area_m2).collect();
    let openings_v: Vec<f64> = openings_v.iter().copied().map(f64::from).collect();
    let Ok(mut moved) = AreaTable::new(&openings_v, &areas_m2) else {
        return *table;
    };
    moved.opening_stretch = table.opening_stretch;
    moved.area_scale = table.area_scale;
    moved
}

fn valve(valve: &model_core::valve::Valve<f32>) -> Valve {
    let column = |points: &[f32]| Column::from_slice(points).unwrap_or_default();
    Valve {
        null_v: valve.null_v,
        feeds_a_above_null: valve.feeds_a_above_null,
        critical_pressure_ratio: valve.law.critical_pressure_ratio,
        laminar_pressure_ratio: valve.law.laminar_pressure_ratio,
        discharge_slope: valve.law.discharge_slope,
        openings_v: column(valve.supply.openings_v()),
        supply_areas_m2: column(valve.supply.areas_m2()),
        exhaust_areas_m2: column(valve.exhaust.areas_m2()),
        opening_stretch: valve.supply.opening_stretch,
        supply_area_scale: valve.supply.area_scale,
        exhaust_area_scale: valve.exhaust.area_scale,
    }
}

fn command_path(values: &Values<'_, f32>) -> CommandPath {
    let (slew, spool) = (slew_limit::law(values), spool_dynamics::law(values));
    CommandPath {
        delay_s: valve_delay::law(values).delay_s,
        hysteresis_width_v: valve_hysteresis::law(values).width,
        rising_v_per_s: slew.rising_per_s,
        falling_v_per_s: slew.falling_per_s,
        natural_frequency_hz: spool.natural_frequency_hz,
        damping_ratio: spool.damping_ratio,
    }
}

fn chamber(chamber: &chamber::Chamber<f32>, leak: &ChamberLeakage<f32>) -> Chamber {
    Chamber {
        area_m2: chamber.geometry.area_m2,
        dead_volume_m3: chamber.geometry.dead_volume_m3,
        length_at_zero_m: chamber.geometry.length_at_zero_m,
        bore_m: chamber.geometry.bore_m,
        temperature_memory: chamber.temperature_memory,
        wall_conductance_w_per_k: chamber.wall_conductance_w_per_k,
        leak_laminar_kg_per_s_pa2: leak.laminar_kg_per_s_pa2,
        leak_orifice_m2: leak.orifice_area_m2,
    }
}

/// The standard gains, with those of the rig in their place; `None` where one of
/// the rig's has none, which its reader rules out.
/// The observer's gain on the pressures.
const FOLLOWS_PRESSURES: &str = "observer_pressure_per_s";
/// The observer takes the lag of a gauge for an error of its model: with gains of up to a fifth of
/// the lag's rate an axis tracks and holds about lags of 1 to 10 ms as without, with a quarter it
/// begins to swing at 2 ms (docs/settings.md, "Gauges that lag").
const LAG_SHARE: f64 = 0.2;
/// The least that settings admit, 1/s.
const LEAST_PER_S: f64 = 1.0;

/// The gains of `[controller]`, the standard ones where it is silent; about gauges that are known
/// to lag the observer follows the pressures more slowly.
fn gains(rig: &Rig) -> Option<Gains> {
    let mut gains = toml::Table::try_from(Gains::default()).ok()?;
    for (key, value) in &rig.controller {
        *gains.get_mut(key)? = toml::Value::Float(*value);
    }
    let lag_s = rig.value("effects.pressure-sensor-lag.time_constant_s");
    if let Some(lag_s) = lag_s.filter(|_| !rig.controller.contains_key(FOLLOWS_PRESSURES)) {
        let gain = gains.get_mut(FOLLOWS_PRESSURES)?;
        let slower = (LAG_SHARE / lag_s).min(gain.as_float()?);
        *gain = toml::Value::Float(slower.max(LEAST_PER_S));
    }
    gains.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{EFFECTS, EffectParameter};
    use std::collections::BTreeMap;

    fn paper() -> Rig {
        Rig::parse(include_str!("../rigs/paper.toml"), "paper.toml").expect("it is a rig")
    }

    #[test]
    fn prop_an_exhaust_that_opens_elsewhere_arrives() {
        let mut rig = paper();
        for (key, value) in [
            ("valve.exhaust_shift_V", 0.01),
            ("valve.curve_roundness", 1.0),
            ("valve.opening_V", 1.03),
        ] {
            rig.set_value(key, value).expect("a valve has a place");
        }
        let settings = settings(&rig).expect("settings");
        let sent = settings
            .axis(f32::from_f64(COMPARED_STEP_S))
            .expect("an axis")
            .valve;
        let values = Values::<f32> {
            rig: &rig,
            keys: &[],
            replaced: &[],
        };
        let meant = values.axis(COMPARED_STEP_S).expect("an axis").valve;
        for step in 1..50_u8 {
            let opening_v = 0.1 * f32::from(step);
            let [sent_m2, meant_m2] = [&sent, &meant].map(|one| one.exhaust.area_m2(opening_v));
            assert!((sent_m2 / meant_m2 - 1.0).abs() < 1e-4, "{opening_v} V");
        }
    }

    fn is_not_sent(effect: &str, parameter: &str) -> bool {
        let known = crate::effects::effect(effect).and_then(|effect| effect.off_board);
        known.is_some_and(|(keys, _)| keys.is_empty() || keys.contains(&parameter))
    }

    /// A possible value, another for every parameter and place, neutral for no number.
    fn value_for(parameter: &EffectParameter, place: usize) -> f64 {
        let distinct = 1.0 + 0.01 * place as f64;
        distinct
            * match parameter.key {
                "diameter_m" => 0.006,
                "natural_frequency_Hz" => 100.0,
                "laminar_kg_s_Pa2" | "laminar_a_kg_s_Pa2" | "laminar_b_kg_s_Pa2" => 2e-16,
                "orifice_m2" | "orifice_a_m2" | "orifice_b_m2" => 1e-8,
                "memory_a" | "memory_b" => 0.5,
                "volume_a_m3" | "volume_b_m3" => 1e-5,
                "per_mean_pressure_N_Pa"
                | "per_pressure_difference_N_Pa"
                | "static_rise_per_mean_pressure_N_Pa" => 1e-5,
                "bristle_stiffness_N_m" => 3e5,
                "delay_s" | "time_constant_s" => 2e-3,
                "tank_volume_m3" | "volume_m3" => 1e-3,
                "buffer_length_m" | "gap_m" => 0.01,
                "asymmetry" | "viscous_asymmetry" => 0.3,
                "feed_area_m2" | "silencer_area_m2" | "needle_area_m2" | "outlet_a_m2"
                | "outlet_b_m2" => 5e-6,
                "zone_middle_m" => 0.1,
                "from" => 0.1,
                "of_velocity" => return f64::from(u8::from(place.is_multiple_of(2))),
                "rising_per_s" | "falling_per_s" => 500.0,
                _ => 0.8,
            }
    }

    fn effects_of_the_axis() -> Vec<(&'static str, &'static EffectParameter, f64)> {
        let all = EFFECTS
            .iter()
            .flat_map(|effect| effect.parameters.iter().map(|one| (effect.name, one)));
        all.enumerate()
            .filter(|(_, (name, one))| !is_not_sent(name, one.key))
            .map(|(place, (name, one))| (name, one, value_for(one, place)))
            .collect()
    }

    #[test]
    fn prop_every_effect_arrives_to_the_bit() {
        let mut rig = paper();
        // A known lag of the gauges would slow the observer down.
        let standard = Gains::default().observer_pressure_per_s;
        rig.controller
            .insert(FOLLOWS_PRESSURES.into(), f64::from(standard));
        for (name, parameter, value) in effects_of_the_axis() {
            let effect = rig.effects.entry(name.into()).or_default();
            effect.insert(parameter.key.into(), value);
        }
        let values = Values::<f32> {
            rig: &rig,
            keys: &[],
            replaced: &[],
        };
        let expected = values.axis(1e-3).expect("it is an axis");
        let settings = settings(&rig).expect("it makes settings");
        assert_eq!(settings.axis(1e-3), Ok(expected));
        let content = firmware::settings::record::encode_content(&settings).expect("it fits");
        let read = firmware::settings::record::decode_content(&content).expect("it reads");
        assert_eq!(read.axis(1e-3), Ok(expected));
        assert_eq!(controller(&rig, 1e-3), Ok(Controller::new(expected)));
    }

    #[test]
    fn prop_no_effect_is_dropped() {
        let rig_with = |effect: &crate::effects::Effect, changed: Option<usize>| {
            let mut rig = paper();
            let all = effect.parameters.iter().enumerate();
            let all = all.filter(|(_, one)| !is_not_sent(effect.name, one.key));
            let values = all.map(|(place, one)| (one.key.to_owned(), value_for(one, place)));
            let mut values: BTreeMap<String, f64> = values.collect();
            if let Some(place) = changed {
                let one = &effect.parameters[place];
                values.insert(one.key.to_owned(), value_for(one, place + 1));
            }
            rig.effects.insert(effect.name.into(), values);
            rig
        };
        for effect in EFFECTS {
            let whole = settings(&rig_with(effect, None)).expect("it makes settings");
            let is_sent = |one: &EffectParameter| !is_not_sent(effect.name, one.key);
            if effect.parameters.iter().any(is_sent) {
                assert_ne!(
                    whole,
                    settings(&paper()).expect("as well"),
                    "{}",
                    effect.name
                );
            }
            for (place, parameter) in effect.parameters.iter().enumerate() {
                let name = format!("effects.{}.{}", effect.name, parameter.key);
                let rig = rig_with(effect, Some(place));
                let changed = settings(&rig).expect("it makes settings");
                let behind = stays_behind(&rig);
                assert_eq!(changed != whole, is_sent(parameter), "{name}");
                let whole_effect = format!("effects.{}: ", effect.name);
                let is_told = behind
                    .iter()
                    .any(|line| line.starts_with(&name) || line.starts_with(&whole_effect));
                assert_eq!(is_told, !is_sent(parameter), "{name}");
            }
        }
    }

    #[test]
    fn prop_every_gain_arrives_and_no_other_changes() {
        let plain = settings(&paper()).expect("it makes settings").controller;
        assert_eq!(plain, Gains::default());
        for standard in plain.fields() {
            let key = standard
                .name
                .strip_prefix("controller.")
                .expect("its section");
            // Another number of the range, whatever the standard one is.
            let value = 0.5 * (standard.value + standard.lowest);
            let mut text = include_str!("../rigs/paper.toml").to_owned();
            text += &format!("\n[controller]\n{key} = {value}\n");
            let rig = Rig::parse(&text, "paper.toml").expect("it is a rig");
            let again = Rig::parse(&rig.to_toml(), "again.toml").expect("it is a rig");
            assert_eq!(again, rig);
            let changed = settings(&rig).expect("it makes settings").controller;
            for (field, unchanged) in changed.fields().zip(plain.fields()) {
                let expected = if field.name == standard.name {
                    value
                } else {
                    unchanged.value
                };
                assert!(
                    (field.value - expected).abs() <= 1e-6 * expected.abs(),
                    "{key}: {field:?}"
                );
            }
            let built = controller(&rig, 1e-3).expect("it makes a controller");
            assert_ne!(
                built,
                controller(&paper(), 1e-3).expect("the paper's"),
                "{key}"
            );
        }
    }

    #[test]
    fn prop_gains_that_no_board_takes_are_refused_with_line_and_range() {
        let refused = |line: &str| {
            let mut text = include_str!("../rigs/paper.toml").to_owned();
            text += &format!("\n[controller]\n{line}\n");
            let error = Rig::parse(&text, "paper.toml").expect_err("it is no gain");
            assert_eq!(error.line, Some(text.lines().count()));
            error.to_string()
        };
        let range = refused("position_per_s = 6000");
        assert!(
            range.contains("controller.position_per_s") && range.contains("1 to 500"),
            "{range}"
        );
        let text = refused("damping = \"high\"");
        assert!(text.contains("controller.damping"), "{text}");
        let unknown = refused("position_gain = 60");
        assert!(
            unknown.contains("unknown key") && unknown.contains("position_per_s"),
            "{unknown}"
        );
        // Within its range, but not for a tick of 20 ms.
        let fault = controller(&paper(), 0.02).expect_err("the tick is too slow");
        assert!(fault.to_string().starts_with("controller."), "{fault}");
    }

    #[test]
    fn prop_every_chamber_model_arrives() {
        let text = include_str!("../rigs/paper.toml");
        for (model, extra) in [
            ("energy-balance", ""),
            ("polytropic", ""),
            ("polytropic-process", "polytropic_index = 1.3\n"),
        ] {
            let model = format!("model = \"{model}\"\n{extra}");
            let text = text.replace("model = \"energy-balance\"", &model);
            let rig = Rig::parse(&text, "paper.toml").expect("it is a rig");
            settings(&rig).expect("it makes settings");
        }
    }

    #[test]
    fn prop_rigs_that_make_no_controller_say_why() {
        let refused = |from: &str, to: &str| {
            let text = include_str!("../rigs/paper.toml").replace(from, to);
            let rig = Rig::parse(&text, "paper.toml").expect("it is a rig");
            settings(&rig)
                .expect_err("it is no rig for a board")
                .to_string()
        };
        let zero = refused("\"mid-stroke\"", "\"end-a\"");
        assert!(zero.starts_with("cylinder.position_zero: "), "{zero}");
        let long = refused("stroke_m = 0.5 ", "stroke_m = 0.8 ");
        assert!(
            long.starts_with("chamber_a.length_at_zero_m: 0.4 is"),
            "{long}"
        );
        let missing = refused("mass_kg = 2.0", "mass_kg = 100000.0");
        assert!(
            missing.starts_with("carriage.mass_kg: 100000 is"),
            "{missing}"
        );
        let vessel = Rig::parse(include_str!("../rigs/vessel-leak.toml"), "v").expect("a rig");
        let vessel = settings(&vessel).expect_err("it has no carriage");
        assert!(vessel.to_string().starts_with("vessel: "), "{vessel}");
        let stem = Rig::parse(include_str!("../rigs/plant-valve.toml"), "v").expect("a rig");
        let stem = settings(&stem).expect_err("it has no axis");
        assert!(stem.to_string().starts_with("actuator: "), "{stem}");
    }
}
