//! Settings to the laws and the controller.

use super::field::SettingsFault;
use super::parameters::{self, Settings, Thermal};
use model_core::axis::{self, Axis, Pneumatics};
use model_core::carriage::Carriage;
use model_core::chamber::{Chamber, ChamberGeometry, ThermalModel};
use model_core::controller::Controller;
use model_core::friction::{Bristle, FrictionLevels};
use model_core::gas::Gas;
use model_core::left_out::{
    ChamberLeakage, FrictionTerms, SlewLimit, SpoolDynamics, TubeLine, ValveDelay, ValveHysteresis,
};
use model_core::valve::{AreaTable, FlowLaw, GasState, TABLE_CAPACITY, Valve};

impl Settings {
    /// The controller for ticks of `dt_s`. It takes many ticks' time: build off
    /// the control path, then swap.
    pub fn try_build(&self, dt_s: f32) -> Result<Controller<f32>, SettingsFault> {
        let axis = self.axis(dt_s)?;
        Ok(Controller::with_gains(axis, self.controller.into()))
    }

    /// The axis, for steps of `dt_s`; every number is judged before.
    pub fn axis(&self, dt_s: f32) -> Result<Axis<f32>, SettingsFault> {
        self.check(dt_s)?;
        Ok(Axis {
            command_path: self.command_path(dt_s),
            valve: self.valve()?,
            pneumatics: self.pneumatics(),
            carriage: self.carriage(),
            friction: FrictionLevels {
                coulomb_n: self.friction.coulomb_n,
                static_n: self.friction.static_n,
                viscous_n_s_per_m: self.friction.viscous_n_s_per_m,
            },
            friction_terms: self.friction_terms(),
            supply_temperature_k: self.ambient.temperature_k,
            dt_s,
        })
    }

    fn gas(&self) -> Gas<f32> {
        Gas::new(
            self.gas.heat_capacity_ratio,
            self.gas.gas_constant_j_per_kg_k,
        )
    }

    fn ambient(&self) -> GasState<f32> {
        GasState {
            pressure_pa: self.ambient.pressure_pa,
            temperature_k: self.ambient.temperature_k,
        }
    }

    fn flow_law(&self) -> FlowLaw<f32> {
        FlowLaw {
            critical_pressure_ratio: self.valve.critical_pressure_ratio,
            laminar_pressure_ratio: self.valve.laminar_pressure_ratio,
            discharge_slope: self.valve.discharge_slope,
            flow_coefficient: self.gas().flow_coefficient,
        }
    }

    fn command_path(&self, dt_s: f32) -> axis::CommandPath<f32> {
        let path = &self.command_path;
        axis::CommandPath::new(
            ValveDelay {
                delay_s: path.delay_s,
            },
            ValveHysteresis {
                width: path.hysteresis_width_v,
            },
            SlewLimit {
                rising_per_s: path.rising_v_per_s,
                falling_per_s: path.falling_v_per_s,
            },
            &SpoolDynamics {
                natural_frequency_hz: path.natural_frequency_hz,
                damping_ratio: path.damping_ratio,
            },
            dt_s,
        )
    }

    fn valve(&self) -> Result<Valve<f32>, SettingsFault> {
        let valve = &self.valve;
        let table = |name, areas: &[f32], scale| {
            let table = area_table(&valve.openings_v, areas);
            let mut table = table.map_err(|fault| SettingsFault::Table(name, fault))?;
            table.opening_stretch = valve.opening_stretch;
            table.area_scale = scale;
            Ok(table)
        };
        let supply = ("valve.supply_areas_m2", valve.supply_area_scale);
        let exhaust = ("valve.exhaust_areas_m2", valve.exhaust_area_scale);
        Ok(Valve {
            null_v: valve.null_v,
            feeds_a_above_null: valve.feeds_a_above_null,
            law: self.flow_law(),
            supply: table(supply.0, &valve.supply_areas_m2, supply.1)?,
            exhaust: table(exhaust.0, &valve.exhaust_areas_m2, exhaust.1)?,
        })
    }

    fn pneumatics(&self) -> Pneumatics<f32> {
        let leak = |chamber: &parameters::Chamber| ChamberLeakage {
            laminar_kg_per_s_pa2: chamber.leak_laminar_kg_per_s_pa2,
            orifice_area_m2: chamber.leak_orifice_m2,
        };
        let effects = &self.pneumatic_effects;
        let [throttle_a, throttle_b] = effects.throttles();
        Pneumatics {
            gas: self.gas(),
            law: self.flow_law(),
            ambient: self.ambient(),
            chamber_a: self.chamber(&self.chamber_a, 1.0),
            chamber_b: self.chamber(&self.chamber_b, -1.0),
            leak_a: leak(&self.chamber_a),
            leak_b: leak(&self.chamber_b),
            piston_leak: effects.piston_leak(),
            tube: TubeLine {
                length_m: self.tube.length_m,
                diameter_m: self.tube.diameter_m,
            },
            supply_droop: effects.supply_droop(),
            back_pressure: effects.back_pressure(),
            separate_exhausts: effects.separate_exhausts,
            cushion: effects.cushion(),
            throttle_a,
            throttle_b,
        }
    }

    fn chamber(&self, chamber: &parameters::Chamber, length_per_position: f32) -> Chamber<f32> {
        let shared = &self.chambers;
        Chamber {
            gas: self.gas(),
            geometry: ChamberGeometry {
                area_m2: chamber.area_m2,
                dead_volume_m3: chamber.dead_volume_m3,
                length_at_zero_m: chamber.length_at_zero_m,
                length_per_position,
                bore_m: chamber.bore_m,
            },
            thermal: self.chambers.thermal.into(),
            temperature_memory: chamber.temperature_memory,
            heat_transfer_charging_w_per_m2_k: shared.heat_transfer_charging_w_per_m2_k,
            heat_transfer_discharging_w_per_m2_k: shared.heat_transfer_discharging_w_per_m2_k,
            wall_conductance_w_per_k: chamber.wall_conductance_w_per_k,
            wall_temperature_k: self.ambient.temperature_k,
            wall: self.pneumatic_effects.wall(),
            heat_variation: self.pneumatic_effects.heat_variation(),
        }
    }

    fn carriage(&self) -> Carriage<f32> {
        Carriage {
            mass_kg: self.carriage.mass_kg,
            external_force_n: self.carriage.external_force_n,
            area_a_m2: self.chamber_a.area_m2,
            area_b_m2: self.chamber_b.area_m2,
            ambient_pressure_pa: self.ambient.pressure_pa,
            bristle: Bristle {
                stiffness_n_per_m: self.friction.bristle_stiffness_n_per_m,
                damping_n_s_per_m: self.friction.bristle_damping_n_s_per_m,
                stribeck_velocity_m_per_s: self.friction.stribeck_velocity_m_per_s,
            },
            effects: self.mechanical_effects.if_any(),
        }
    }

    fn friction_terms(&self) -> FrictionTerms<f32> {
        let terms = &self.friction_terms;
        FrictionTerms {
            coulomb_n: terms.coulomb_n,
            stribeck_n: terms.stribeck_n,
            viscous_n_s_per_m: terms.viscous_n_s_per_m,
            per_mean_pressure_n_per_pa: terms.per_mean_pressure_n_per_pa,
            per_pressure_difference_n_per_pa: terms.per_pressure_difference_n_per_pa,
            static_rise_per_mean_pressure_n_per_pa: terms.static_rise_per_mean_pressure_n_per_pa,
            constant_force_n: terms.constant_force_n,
        }
    }
}

/// The table of these points; `f64` holds every `f32` and gives it back.
fn area_table(
    openings_v: &[f32],
    areas_m2: &[f32],
) -> Result<AreaTable<f32>, model_core::valve::TableFault> {
    let wide = |points: &[f32]| -> heapless::Vec<f64, TABLE_CAPACITY> {
        points.iter().map(|point| f64::from(*point)).collect()
    };
    AreaTable::new(&wide(openings_v), &wide(areas_m2))
}

impl From<Thermal> for ThermalModel<f32> {
    fn from(thermal: Thermal) -> Self {
        match thermal {
            Thermal::EnergyBalance => Self::EnergyBalance,
            Thermal::Polytropic {
                expansion_index,
                compression_index,
                reference_pressure_pa,
            } => Self::Polytropic {
                expansion_index,
                compression_index,
                reference_pressure_pa,
            },
            Thermal::PolytropicProcess { index } => Self::PolytropicProcess { index },
        }
    }
}

impl From<ThermalModel<f32>> for Thermal {
    fn from(model: ThermalModel<f32>) -> Self {
        match model {
            ThermalModel::EnergyBalance => Self::EnergyBalance,
            ThermalModel::Polytropic {
                expansion_index,
                compression_index,
                reference_pressure_pa,
            } => Self::Polytropic {
                expansion_index,
                compression_index,
                reference_pressure_pa,
            },
            ThermalModel::PolytropicProcess { index } => Self::PolytropicProcess { index },
        }
    }
}
