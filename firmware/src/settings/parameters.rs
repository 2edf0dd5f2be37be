//! The rig's parameters as plain numbers, each said once.

use super::effects::{MechanicalEffects, PneumaticEffects};
use super::gains::Gains;
use super::mechanics::{Carriage, Friction, FrictionTerms};
use super::sensors::Sensors;
use heapless::Vec;
use model_core::paper;
use model_core::valve::TABLE_CAPACITY;
use serde::{Deserialize, Serialize};

/// A column of the valve's table.
pub type Column = Vec<f32, TABLE_CAPACITY>;

/// Everything that the controller is built from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The gas.
    pub gas: Gas,
    /// The surroundings; walls and supplied gas have their temperature.
    pub ambient: Ambient,
    /// The valve.
    pub valve: Valve,
    /// From the command to the spool.
    pub command_path: CommandPath,
    /// What both chambers share.
    pub chambers: Chambers,
    /// Chamber a, which +x enlarges.
    pub chamber_a: Chamber,
    /// Chamber b.
    pub chamber_b: Chamber,
    /// The tube between each port and its chamber.
    pub tube: Tube,
    /// The carriage.
    pub carriage: Carriage,
    /// Declared friction.
    pub friction: Friction,
    /// What adds to the declared friction.
    pub friction_terms: FrictionTerms,
    /// Left-out physics of the gas.
    pub pneumatic_effects: PneumaticEffects,
    /// Left-out physics of the carriage.
    pub mechanical_effects: MechanicalEffects,
    /// Bandwidths and limits of the controller.
    pub controller: Gains,
    /// What is known of the wiring.
    pub wiring: Wiring,
    /// What the sensors show.
    pub sensors: Sensors,
}

/// How an axis is connected to a board: what of the settings is no part of its controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Connection {
    /// What is known of the wiring.
    pub wiring: Wiring,
    /// What the sensors show.
    pub sensors: Sensors,
}

impl Connection {
    /// Of an axis of which nothing is known.
    pub const UNKNOWN: Self = Self::standard(Wiring::Unchecked);

    /// Of sensors that the link's scales were made for.
    pub const fn standard(wiring: Wiring) -> Self {
        let sensors = Sensors::STANDARD;
        Self { wiring, sensors }
    }
}

/// Whether valve, tubes, gauges and signs were seen to answer the right way round on this axis. A
/// board whose wiring is unchecked follows no reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Wiring {
    /// Nobody has looked.
    #[default]
    Unchecked,
    /// They were.
    Checked,
}

/// An ideal gas.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gas {
    /// gamma.
    pub heat_capacity_ratio: f32,
    /// R, J/(kg K).
    pub gas_constant_j_per_kg_k: f32,
}

/// The surroundings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ambient {
    /// Pressure, Pa absolute.
    pub pressure_pa: f32,
    /// Temperature, K.
    pub temperature_k: f32,
}

/// The valve and its flow law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Valve {
    /// Command at which the spool is centred, V.
    pub null_v: f32,
    /// Whether port a is fed by commands above the null.
    pub feeds_a_above_null: bool,
    /// b of the flow law.
    pub critical_pressure_ratio: f32,
    /// lambda of the flow law.
    pub laminar_pressure_ratio: f32,
    /// s of the discharge coefficient.
    pub discharge_slope: f32,
    /// Openings of the table's points, V.
    pub openings_v: Column,
    /// Areas from the supply at those openings, m2.
    pub supply_areas_m2: Column,
    /// Areas to the exhaust at those openings, m2.
    pub exhaust_areas_m2: Column,
    /// Factor on every opening.
    pub opening_stretch: f32,
    /// Factor on every area from the supply.
    pub supply_area_scale: f32,
    /// Factor on every area to the exhaust.
    pub exhaust_area_scale: f32,
}

/// Delay, play, slew limit and motion of the spool; noughts are neutral.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CommandPath {
    /// Dead time, s.
    pub delay_s: f32,
    /// Full width of the play, V.
    pub hysteresis_width_v: f32,
    /// Fastest rise, V/s.
    pub rising_v_per_s: f32,
    /// Fastest fall, V/s.
    pub falling_v_per_s: f32,
    /// Natural frequency of the spool, Hz.
    pub natural_frequency_hz: f32,
    /// Damping ratio of the spool.
    pub damping_ratio: f32,
}

/// How the gas temperature follows, see [`model_core::chamber::ThermalModel`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Thermal {
    /// The full balance.
    EnergyBalance,
    /// The reduced model.
    Polytropic {
        /// n while the chamber is emptied.
        expansion_index: f32,
        /// n while the chamber is filled.
        compression_index: f32,
        /// Pressure at which the gas has the wall's temperature, Pa.
        reference_pressure_pa: f32,
    },
    /// p V^n constant.
    PolytropicProcess {
        /// n.
        index: f32,
    },
}

/// What both chambers share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chambers {
    /// Model of the gas temperature.
    pub thermal: Thermal,
    /// h while charging, W/(m2 K).
    pub heat_transfer_charging_w_per_m2_k: f32,
    /// h while discharging, W/(m2 K).
    pub heat_transfer_discharging_w_per_m2_k: f32,
}

/// One chamber: geometry, gas temperature, leak.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chamber {
    /// Piston area, m2.
    pub area_m2: f32,
    /// Volume at zero length, m3.
    pub dead_volume_m3: f32,
    /// Length at x = 0, m.
    pub length_at_zero_m: f32,
    /// Bore, m.
    pub bore_m: f32,
    /// Part of the gas temperature that follows the full balance.
    pub temperature_memory: f32,
    /// Heat conductance to the wall beside h S(x), W/K.
    pub wall_conductance_w_per_k: f32,
    /// Laminar leak, kg/(s Pa2).
    pub leak_laminar_kg_per_s_pa2: f32,
    /// Orifice of the leak, m2.
    pub leak_orifice_m2: f32,
}

/// A tube; a length of nought is none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tube {
    /// Length, m.
    pub length_m: f32,
    /// Inner diameter, m.
    pub diameter_m: f32,
}

impl Settings {
    /// How the axis is connected.
    pub fn connection(&self) -> Connection {
        Connection {
            wiring: self.wiring,
            sensors: self.sensors,
        }
    }

    /// The paper's axis and the controller's standard gains: what a board without settings of its own falls back
    /// on. It is nobody's rig: a board that runs on it says so by a fault.
    /// Apart: in every place that asks they take a kilobyte of code more.
    #[inline(never)]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the paper's numbers, to the nearest f32"
    )]
    pub fn built_in() -> Self {
        let column = |points: &[f64]| points.iter().map(|point| *point as f32).collect();
        let chamber = Chamber {
            area_m2: paper::PISTON_AREA_M2 as f32,
            dead_volume_m3: paper::DEAD_VOLUME_M3 as f32,
            length_at_zero_m: (0.5 * paper::STROKE_M) as f32,
            bore_m: paper::BORE_M as f32,
            temperature_memory: 0.0,
            wall_conductance_w_per_k: 0.0,
            leak_laminar_kg_per_s_pa2: 0.0,
            leak_orifice_m2: 0.0,
        };
        Self {
            gas: Gas {
                heat_capacity_ratio: 1.4,
                gas_constant_j_per_kg_k: 287.0,
            },
            ambient: Ambient {
                pressure_pa: paper::AMBIENT_PRESSURE_PA as f32,
                temperature_k: paper::AMBIENT_TEMPERATURE_K as f32,
            },
            valve: Valve {
                null_v: paper::NULL_V as f32,
                feeds_a_above_null: true,
                critical_pressure_ratio: paper::CRITICAL_PRESSURE_RATIO as f32,
                laminar_pressure_ratio: paper::LAMINAR_PRESSURE_RATIO as f32,
                discharge_slope: paper::DISCHARGE_SLOPE as f32,
                openings_v: column(&paper::OPENING_V),
                supply_areas_m2: column(&paper::AREA_M2),
                exhaust_areas_m2: column(&paper::AREA_M2),
                opening_stretch: 1.0,
                supply_area_scale: 1.0,
                exhaust_area_scale: 1.0,
            },
            command_path: CommandPath {
                delay_s: 0.0,
                hysteresis_width_v: 0.0,
                rising_v_per_s: 0.0,
                falling_v_per_s: 0.0,
                natural_frequency_hz: 0.0,
                damping_ratio: 1.0,
            },
            chambers: Chambers {
                thermal: Thermal::EnergyBalance,
                heat_transfer_charging_w_per_m2_k: paper::HEAT_TRANSFER_CHARGING_W_PER_M2_K as f32,
                heat_transfer_discharging_w_per_m2_k: paper::HEAT_TRANSFER_DISCHARGING_W_PER_M2_K
                    as f32,
            },
            chamber_a: chamber,
            chamber_b: chamber,
            tube: Tube {
                length_m: 0.0,
                diameter_m: 0.004,
            },
            carriage: Carriage {
                mass_kg: paper::MOVING_MASS_KG as f32,
                external_force_n: 0.0,
            },
            friction: Friction {
                bristle_stiffness_n_per_m: paper::BRISTLE_STIFFNESS_N_PER_M as f32,
                bristle_damping_n_s_per_m: paper::BRISTLE_DAMPING_N_S_PER_M as f32,
                stribeck_velocity_m_per_s: paper::STRIBECK_VELOCITY_M_PER_S as f32,
                coulomb_n: paper::COULOMB_N as f32,
                static_n: paper::STATIC_N as f32,
                viscous_n_s_per_m: paper::VISCOUS_N_S_PER_M as f32,
            },
            friction_terms: FrictionTerms {
                coulomb_n: 0.0,
                stribeck_n: 0.0,
                viscous_n_s_per_m: 0.0,
                per_mean_pressure_n_per_pa: 0.0,
                per_pressure_difference_n_per_pa: 0.0,
                static_rise_per_mean_pressure_n_per_pa: 0.0,
                constant_force_n: 0.0,
            },
            pneumatic_effects: PneumaticEffects::neutral(),
            mechanical_effects: MechanicalEffects::neutral(),
            controller: Gains::default(),
            wiring: Wiring::Unchecked,
            sensors: Sensors::STANDARD,
        }
    }
}
