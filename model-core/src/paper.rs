//! Parameter values of the paper, in one place, each with its source.
//!
//! Meng and others give friction, heat transfer and polytropic indices. Moving
//! mass, dead volumes, valve areas and critical ratios stand only in its
//! figures or nowhere; the values used here for those are assumptions, marked
//! so, and no result that depends on them is a result of the paper.

use crate::axis::{Axis, CommandPath, Pneumatics};
use crate::carriage::Carriage;
use crate::chamber::{Chamber, ChamberGeometry, ThermalModel};
use crate::friction::{Bristle, FrictionLevels};
use crate::gas::Gas;
use crate::left_out::{
    ChamberLeakage, EndCushion, ExhaustBackPressure, FrictionTerms, PistonLeakage, PortThrottle,
    SlewLimit, SpoolDynamics, SupplyDroop, TubeLine, ValveDelay, ValveHysteresis,
    VariableHeatTransfer, WallTemperature,
};
use crate::real::Real;
use crate::valve::{AreaTable, FlowLaw, GasState, Valve};

/// Cylinder stroke, m: DGPIL-25-500.
pub const STROKE_M: f64 = 0.5;
/// Bore, m: DGPIL-25-500.
pub const BORE_M: f64 = 0.025;
/// Piston area pi/4 bore^2, m2, both sides.
pub const PISTON_AREA_M2: f64 = 4.909e-4;
/// Supply pressure, Pa absolute: 7 bar of figures 4 and 5 (gauge or absolute is
/// not stated; taken as absolute).
pub const SUPPLY_PRESSURE_PA: f64 = 7e5;
/// Ambient pressure, Pa: standard atmosphere (assumption).
pub const AMBIENT_PRESSURE_PA: f64 = 101_325.0;
/// Ambient, wall and supply temperature, K (assumption).
pub const AMBIENT_TEMPERATURE_K: f64 = 293.15;
/// sigma0, N/m.
pub const BRISTLE_STIFFNESS_N_PER_M: f64 = 9.14e5;
/// sigma1, N s/m.
pub const BRISTLE_DAMPING_N_S_PER_M: f64 = 1327.0;
/// sigma2, N s/m, ports open to the air, up to 0.1 m/s.
pub const VISCOUS_N_S_PER_M: f64 = 64.5;
/// FC, N, ports open to the air.
pub const COULOMB_N: f64 = 20.2;
/// FS, N, ports open to the air.
pub const STATIC_N: f64 = 28.9;
/// v_s, m/s.
pub const STRIBECK_VELOCITY_M_PER_S: f64 = 5.03e-3;
/// h while charging, W/(m2 K).
pub const HEAT_TRANSFER_CHARGING_W_PER_M2_K: f64 = 50.0;
/// h while discharging, W/(m2 K).
pub const HEAT_TRANSFER_DISCHARGING_W_PER_M2_K: f64 = 20.0;
/// n in expansion (from Beater).
pub const EXPANSION_INDEX: f64 = 1.11;
/// n in compression (from Beater).
pub const COMPRESSION_INDEX: f64 = 1.18;
/// b: "smaller than the published 0.29" at large openings; 0.29 taken.
pub const CRITICAL_PRESSURE_RATIO: f64 = 0.29;
/// lambda: "close to 1"; 0.98 taken (not identifiable in servo motion).
pub const LAMINAR_PRESSURE_RATIO: f64 = 0.98;
/// Linear term of the discharge coefficient (2).
pub const DISCHARGE_SLOPE: f64 = 0.0933;
/// Moving mass, kg (assumption: carriage and piston of a 25 mm guided slide).
pub const MOVING_MASS_KG: f64 = 2.0;
/// Dead volume of each chamber with ports and fittings, m3 (assumption).
pub const DEAD_VOLUME_M3: f64 = 2.5e-5;
/// Null command, V: data sheet 5.0 +- 0.1.
pub const NULL_V: f64 = 5.0;
/// Opening of the area table, V (assumption: overlap of 0.3 V, then linear).
pub const OPENING_V: [f64; 3] = [0.0, 0.3, 5.0];
/// Area over the opening, m2 (assumption: 0.1 mm2 of leakage; fully open as the
/// nominal flow of 700 l/min asks for with b = 0.29).
pub const AREA_M2: [f64; 3] = [1e-7, 1e-7, 16.7e-6];

/// The bristle of the paper.
pub fn bristle<R: Real>() -> Bristle<R> {
    Bristle {
        stiffness_n_per_m: R::from_f64(BRISTLE_STIFFNESS_N_PER_M),
        damping_n_s_per_m: R::from_f64(BRISTLE_DAMPING_N_S_PER_M),
        stribeck_velocity_m_per_s: R::from_f64(STRIBECK_VELOCITY_M_PER_S),
    }
}

/// The friction levels of the paper.
pub fn friction_levels<R: Real>() -> FrictionLevels<R> {
    FrictionLevels {
        coulomb_n: R::from_f64(COULOMB_N),
        static_n: R::from_f64(STATIC_N),
        viscous_n_s_per_m: R::from_f64(VISCOUS_N_S_PER_M),
    }
}

/// The axis of the paper, for steps of 1 ms, with nothing of the left-out physics.
pub fn axis<R: Real>() -> Axis<R> {
    let gas = Gas::new(R::from_f64(1.4), R::from_f64(287.0));
    let law = FlowLaw {
        critical_pressure_ratio: R::from_f64(CRITICAL_PRESSURE_RATIO),
        laminar_pressure_ratio: R::from_f64(LAMINAR_PRESSURE_RATIO),
        discharge_slope: R::from_f64(DISCHARGE_SLOPE),
        flow_coefficient: gas.flow_coefficient,
    };
    let dt_s = R::from_f64(1e-3);
    Axis {
        command_path: CommandPath::new(
            ValveDelay::NEUTRAL,
            ValveHysteresis::NEUTRAL,
            SlewLimit::NEUTRAL,
            &SpoolDynamics::NEUTRAL,
            dt_s,
        ),
        valve: Valve {
            null_v: R::from_f64(NULL_V),
            feeds_a_above_null: true,
            law,
            supply: area_table(),
            exhaust: area_table(),
        },
        pneumatics: Pneumatics {
            gas,
            law,
            ambient: GasState {
                pressure_pa: R::from_f64(AMBIENT_PRESSURE_PA),
                temperature_k: R::from_f64(AMBIENT_TEMPERATURE_K),
            },
            chamber_a: chamber(gas, R::ONE),
            chamber_b: chamber(gas, -R::ONE),
            leak_a: ChamberLeakage::NEUTRAL,
            leak_b: ChamberLeakage::NEUTRAL,
            piston_leak: PistonLeakage::NEUTRAL,
            tube: TubeLine::neutral(),
            supply_droop: SupplyDroop::neutral(),
            back_pressure: ExhaustBackPressure::neutral(),
            separate_exhausts: false,
            cushion: EndCushion::neutral(),
            throttle_a: PortThrottle::NEUTRAL,
            throttle_b: PortThrottle::NEUTRAL,
        },
        carriage: carriage(),
        friction: friction_levels(),
        friction_terms: FrictionTerms::NEUTRAL,
        supply_temperature_k: R::from_f64(AMBIENT_TEMPERATURE_K),
        dt_s,
    }
}

fn carriage<R: Real>() -> Carriage<R> {
    Carriage {
        mass_kg: R::from_f64(MOVING_MASS_KG),
        external_force_n: R::ZERO,
        area_a_m2: R::from_f64(PISTON_AREA_M2),
        area_b_m2: R::from_f64(PISTON_AREA_M2),
        ambient_pressure_pa: R::from_f64(AMBIENT_PRESSURE_PA),
        bristle: bristle(),
        effects: None,
    }
}

fn chamber<R: Real>(gas: Gas<R>, length_per_position: R) -> Chamber<R> {
    Chamber {
        gas,
        geometry: ChamberGeometry {
            area_m2: R::from_f64(PISTON_AREA_M2),
            dead_volume_m3: R::from_f64(DEAD_VOLUME_M3),
            length_at_zero_m: R::from_f64(0.5 * STROKE_M),
            length_per_position,
            bore_m: R::from_f64(BORE_M),
        },
        thermal: ThermalModel::EnergyBalance,
        temperature_memory: R::ZERO,
        heat_transfer_charging_w_per_m2_k: R::from_f64(HEAT_TRANSFER_CHARGING_W_PER_M2_K),
        heat_transfer_discharging_w_per_m2_k: R::from_f64(HEAT_TRANSFER_DISCHARGING_W_PER_M2_K),
        wall_conductance_w_per_k: R::ZERO,
        wall_temperature_k: R::from_f64(AMBIENT_TEMPERATURE_K),
        wall: WallTemperature::NEUTRAL,
        heat_variation: VariableHeatTransfer::NEUTRAL,
    }
}

/// The constants above make a valid table; a fault in them leaves a valve that
/// only leaks, and the tests of this module fail.
fn area_table<R: Real>() -> AreaTable<R> {
    AreaTable::new(&OPENING_V, &AREA_M2).unwrap_or_else(|_| AreaTable::closed())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_area_table_is_the_one_of_the_constants() {
        assert!((area_table::<f64>().area_m2(5.0) - AREA_M2[2]).abs() < 1e-12);
    }
}
