//! The step is total: whatever finite numbers go in, no panic and finite numbers
//! come out; and what goes in as NaN is not lost.

use model_core::axis::{Axis, AxisInputs, AxisState, CommandPath};
use model_core::chamber::ThermalModel;
use model_core::left_out::{
    SlewLimit, SpoolDynamics, ValveDelay, ValveHysteresis, VariableHeatTransfer, WallTemperature,
};
use model_core::paper;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Parameters at and beyond the edges of what a rig file admits.
fn any_axis() -> impl Strategy<Value = Axis<f32>> {
    let thermal = prop_oneof![
        Just(ThermalModel::EnergyBalance),
        (0.5_f32..2.0).prop_map(|index| ThermalModel::PolytropicProcess { index }),
        (0.5_f32..2.0, 0.5_f32..2.0, 1e4_f32..1e7).prop_map(|(e, c, p)| {
            ThermalModel::Polytropic {
                expansion_index: e,
                compression_index: c,
                reference_pressure_pa: p,
            }
        }),
    ];
    let chambers = (
        thermal,
        0.0_f32..1e-4,
        0.0_f32..1.0,
        0.0_f32..1e4,
        0.0_f32..10.0,
    );
    let valve = (0.0_f32..=1.0, 0.0_f32..=1.0, 0.01_f32..10.0, 0.0_f32..100.0);
    let carriage = (
        1e-3_f32..1e3,
        0.0_f32..1e3,
        0.0_f32..1e3,
        1e3_f32..1e8,
        0.0_f32..1e5,
    );
    let effects = (
        0.0_f32..0.2,
        0.0_f32..2.0,
        0.0_f32..1e3,
        0.0_f32..1e3,
        0.0_f32..3.0,
    );
    let leaks = (
        0.0_f32..1e-12,
        0.0_f32..1e-4,
        prop_oneof![Just(0.0_f32), 1e-4_f32..10.0],
    );
    let nodes = (
        prop_oneof![Just(0.0_f32), 1e-12_f32..1e3],
        0.0_f32..1.0,
        prop_oneof![Just(0.0_f32), 1e-12_f32..1.0],
        0.0_f32..1.0,
    );
    let piston_and_cushion = (
        0.0_f32..1e-12,
        0.0_f32..1e-2,
        prop_oneof![Just(0.0_f32), 0.0_f32..1.0],
        0.0_f32..1e-2,
    );
    let wall = (
        -1e3_f32..1e3,
        prop_oneof![Just(0.0_f32), 1e-9_f32..1e6],
        0.0_f32..1e6,
        0.0_f32..3.0,
        0.0_f32..1e4,
    );
    let added = (nodes, piston_and_cushion, wall);
    (
        chambers,
        valve,
        carriage,
        effects,
        leaks,
        added,
        1e-6_f32..0.1,
    )
        .prop_map(
            |(chambers, valve, carriage, effects, leaks, (nodes, piston, wall), dt_s)| {
                let mut axis = paper::axis::<f32>();
                axis.dt_s = dt_s;
                let pneumatics = &mut axis.pneumatics;
                for chamber in [&mut pneumatics.chamber_a, &mut pneumatics.chamber_b] {
                    chamber.thermal = chambers.0;
                    chamber.geometry.dead_volume_m3 = chambers.1;
                    chamber.temperature_memory = chambers.2;
                    chamber.heat_transfer_discharging_w_per_m2_k = chambers.3;
                    chamber.wall_conductance_w_per_k = chambers.4;
                    chamber.wall = WallTemperature {
                        offset_k: wall.0,
                        heat_capacity_j_per_k: wall.1,
                        outer_w_per_k: wall.2,
                    };
                    chamber.heat_variation = VariableHeatTransfer {
                        density_exponent: wall.3,
                        flow_w_per_m2_k: wall.4,
                    };
                }
                pneumatics.law.critical_pressure_ratio = valve.0;
                pneumatics.law.laminar_pressure_ratio = valve.1;
                axis.valve.supply.opening_stretch = valve.2;
                axis.valve.exhaust.area_scale = valve.3;
                axis.carriage.mass_kg = carriage.0;
                axis.friction.coulomb_n = carriage.1;
                axis.friction.static_n = carriage.2;
                axis.carriage.bristle.stiffness_n_per_m = carriage.3;
                axis.carriage.bristle.damping_n_s_per_m = carriage.4;
                pneumatics.leak_a.laminar_kg_per_s_pa2 = leaks.0;
                pneumatics.leak_b.orifice_area_m2 = leaks.1;
                pneumatics.tube.length_m = leaks.2;
                pneumatics.supply_droop.tank_volume_m3 = nodes.0;
                pneumatics.supply_droop.feed_area_m2 = nodes.1;
                pneumatics.back_pressure.silencer_area_m2 = nodes.2;
                pneumatics.back_pressure.volume_m3 = nodes.3;
                pneumatics.piston_leak.laminar_kg_per_s_pa2 = piston.0;
                pneumatics.piston_leak.orifice_area_m2 = piston.1;
                pneumatics.cushion.length_m = piston.2;
                pneumatics.cushion.needle_area_m2 = piston.3;
                let spool = SpoolDynamics {
                    natural_frequency_hz: effects.2,
                    damping_ratio: effects.4,
                };
                axis.command_path = CommandPath::new(
                    ValveDelay { delay_s: effects.0 },
                    ValveHysteresis { width: effects.1 },
                    SlewLimit {
                        rising_per_s: effects.3,
                        falling_per_s: 0.0,
                    },
                    &spool,
                    dt_s,
                );
                axis
            },
        )
}

fn finite_in_finite_out(
    axis: &Axis<f32>,
    start: &AxisState<f32>,
    drive: &[(f32, f32)],
) -> Result<(), TestCaseError> {
    let mut state = *start;
    for &(command_v, supply_pressure_pa) in drive {
        let inputs = AxisInputs {
            command_v,
            supply_pressure_pa,
        };
        let before = state;
        axis.step(&mut state, &inputs);
        prop_assert!(state.is_finite(), "{before:?} became {state:?}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1000,
        // The same cases on every run; 400 000 others were tried by hand.
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn prop_finite_in_is_finite_out(
        axis in any_axis(),
        position_m in -1.0_f32..1.0,
        velocity_m_per_s in -100.0_f32..100.0,
        pressures_pa in (-1e6_f32..1e8, -1e6_f32..1e8),
        temperature_k in 0.0_f32..1e4,
        drive in prop::collection::vec((-1e6_f32..1e6, -1e6_f32..1e8), 50),
    ) {
        let (a, b) = pressures_pa;
        let mut start = AxisState::at_rest(position_m, a, b, temperature_k, 5.0);
        start.carriage.velocity_m_per_s = velocity_m_per_s;
        finite_in_finite_out(&axis, &start, &drive)?;
    }

    #[test]
    fn prop_a_usual_axis_with_a_wild_command_stays_finite_past_its_stroke(
        drive in prop::collection::vec((0.0_f32..10.0, 2e5_f32..1.1e6), 4000),
        held in 1_usize..2000,
    ) {
        let held: Vec<_> = (0..drive.len()).map(|step| drive[step / held]).collect();
        let start = AxisState::at_rest(0.0, 5e5, 5e5, 293.15, 5.0);
        finite_in_finite_out(&paper::axis(), &start, &held)?;
    }
}

#[test]
fn prop_nan_that_goes_in_comes_out() {
    let axis = paper::axis::<f32>();
    let rest = AxisState::at_rest(0.0, 5e5, 5e5, 293.15, 5.0);
    let inputs = AxisInputs {
        command_v: 5.0,
        supply_pressure_pa: 7e5,
    };
    let after = |state: &AxisState<f32>, inputs: &AxisInputs<f32>| {
        let mut state = *state;
        axis.step(&mut state, inputs);
        state
    };
    assert!(after(&rest, &inputs).is_finite());
    let nan = f32::NAN;
    let (mut command, mut supply) = (inputs, inputs);
    command.command_v = nan;
    supply.supply_pressure_pa = nan;
    assert!(!after(&rest, &command).is_finite(), "command");
    assert!(!after(&rest, &supply).is_finite(), "supply");
    let spoilers: [fn(&mut AxisState<f32>, f32); 7] = [
        |state, nan| state.pneumatics.a.pressure_pa.value = nan,
        |state, nan| state.pneumatics.a.temperature_k.value = nan,
        |state, nan| state.pneumatics.b.pressure_pa.value = nan,
        |state, nan| state.pneumatics.b.temperature_k.value = nan,
        |state, nan| state.carriage.position_m.value = nan,
        |state, nan| state.carriage.velocity_m_per_s = nan,
        |state, nan| state.carriage.deflection_m = nan,
    ];
    for (number, spoil) in spoilers.iter().enumerate() {
        let mut state = rest;
        spoil(&mut state, nan);
        assert!(!after(&state, &inputs).is_finite(), "state {number}");
    }
}
