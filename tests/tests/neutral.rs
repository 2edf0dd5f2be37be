//! Left-out effects: neutral is nothing at all, switched on is something, and
//! the derivatives by every parameter that a fit may free are right.

#![expect(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use host_sim::model::Values;
use host_sim::rig::Rig;
use model_core::axis::{Axis, AxisInputs, AxisState, CommandPath};
use model_core::carriage::CarriageEffects;
use model_core::chamber::ThermalModel;
use model_core::left_out::{
    ChamberLeakage, ElasticBuffer, ForceEquation, FrictionTerms, LoadCoupling, SlewLimit,
    SpoolDynamics, TubeLine, ValveDelay, ValveHysteresis,
};
use model_core::paper;
use model_core::real::{Dual, Real};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::f64::consts::TAU;
use tests::{PlainState, plain_step};

const SUPPLY_PA: f32 = paper::SUPPLY_PRESSURE_PA as f32;
const AMBIENT_K: f32 = paper::AMBIENT_TEMPERATURE_K as f32;

/// Numbers that stand beside a neutral value and must not matter then.
#[derive(Clone, Copy, Debug)]
struct Companions {
    damping_ratio: f32,
    tube_diameter_m: f32,
}

/// The paper's axis with every effect set to its neutral value by hand.
fn neutral_axis(companions: Companions) -> Axis<f32> {
    let mut axis = paper::axis::<f32>();
    let spool = SpoolDynamics {
        natural_frequency_hz: 0.0,
        damping_ratio: companions.damping_ratio,
    };
    axis.command_path = CommandPath::new(
        ValveDelay { delay_s: 0.0 },
        ValveHysteresis { width: 0.0 },
        SlewLimit {
            rising_per_s: 0.0,
            falling_per_s: 0.0,
        },
        &spool,
        axis.dt_s,
    );
    axis.pneumatics.tube = TubeLine {
        length_m: 0.0,
        diameter_m: companions.tube_diameter_m,
    };
    axis.pneumatics.leak_a = ChamberLeakage::NEUTRAL;
    axis.pneumatics.leak_b = ChamberLeakage::NEUTRAL;
    axis.friction_terms = FrictionTerms::NEUTRAL;
    axis.carriage.effects = Some(CarriageEffects::neutral());
    axis
}

fn inputs(command_v: f32) -> AxisInputs<f32> {
    AxisInputs {
        command_v,
        supply_pressure_pa: SUPPLY_PA,
    }
}

fn at_rest(position_m: f32, pressure_pa: f32, command_v: f32) -> AxisState<f32> {
    AxisState::at_rest(position_m, pressure_pa, pressure_pa, AMBIENT_K, command_v)
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn prop_neutral_effects_leave_the_axis_bit_identical(
        commands_v in prop::collection::vec(0.0_f32..10.0, 200),
        position_m in -0.1_f32..0.1,
        pressure_pa in 1.1e5_f32..6.9e5,
        damping_ratio in 0.0_f32..2.0,
        tube_diameter_m in 1e-3_f32..1e-2,
    ) {
        let axis = neutral_axis(Companions { damping_ratio, tube_diameter_m });
        let mut state = at_rest(position_m, pressure_pa, commands_v[0]);
        let mut plain = PlainState::at_rest(position_m, pressure_pa, AMBIENT_K);
        for command_v in commands_v {
            axis.step(&mut state, &inputs(command_v));
            plain_step(&axis, &mut plain, &inputs(command_v));
            prop_assert_eq!(bits(&state), plain_bits(&plain));
        }
    }
}

fn bits(state: &AxisState<f32>) -> [u32; 7] {
    let pneumatics = &state.pneumatics;
    plain_bits(&PlainState {
        a: pneumatics.a,
        b: pneumatics.b,
        carriage: state.carriage,
    })
}

fn plain_bits(state: &PlainState<f32>) -> [u32; 7] {
    [
        state.a.pressure_pa.value,
        state.a.temperature_k.value,
        state.b.pressure_pa.value,
        state.b.temperature_k.value,
        state.carriage.position_m.value,
        state.carriage.velocity_m_per_s,
        state.carriage.friction_n,
    ]
    .map(f32::to_bits)
}

/// A command path with one of its effects.
fn path(delay_s: f32, width: f32, rate_per_s: f32, natural_frequency_hz: f32) -> CommandPath<f32> {
    CommandPath::new(
        ValveDelay { delay_s },
        ValveHysteresis { width },
        SlewLimit {
            rising_per_s: rate_per_s,
            falling_per_s: rate_per_s,
        },
        &SpoolDynamics {
            natural_frequency_hz,
            damping_ratio: 0.7,
        },
        1e-3,
    )
}

/// One way to switch an effect on.
type Switch = (&'static str, fn(&mut Axis<f32>));

/// One effect of the carriage's own motion.
fn effects(axis: &mut Axis<f32>, change: fn(&mut CarriageEffects<f32>)) {
    let mut effects = CarriageEffects::neutral();
    change(&mut effects);
    axis.carriage.effects = Some(effects);
}

fn load(gap_m: f32) -> LoadCoupling<f32> {
    LoadCoupling {
        load_mass_kg: 0.2,
        stiffness_n_per_m: 1e6,
        damping_n_s_per_m: 10.0,
        gap_m,
    }
}

/// Every parameter of every left-out effect, at the small end of what a rig has.
const SWITCHES: &[Switch] = &[
    ("valve delay", |axis| {
        axis.command_path = path(2e-4, 0.0, 0.0, 0.0)
    }),
    ("valve hysteresis", |axis| {
        axis.command_path = path(0.0, 0.02, 0.0, 0.0)
    }),
    ("slew limit", |axis| {
        axis.command_path = path(0.0, 0.0, 20.0, 0.0)
    }),
    ("spool dynamics", |axis| {
        axis.command_path = path(0.0, 0.0, 0.0, 200.0)
    }),
    ("tube line", |axis| axis.pneumatics.tube.length_m = 0.05),
    ("laminar leak a", |axis| {
        axis.pneumatics.leak_a.laminar_kg_per_s_pa2 = 1e-17
    }),
    ("laminar leak b", |axis| {
        axis.pneumatics.leak_b.laminar_kg_per_s_pa2 = 1e-17
    }),
    ("orifice leak a", |axis| {
        axis.pneumatics.leak_a.orifice_area_m2 = 1e-9
    }),
    ("orifice leak b", |axis| {
        axis.pneumatics.leak_b.orifice_area_m2 = 1e-9
    }),
    ("orifice past the piston", |axis| {
        axis.pneumatics.piston_leak.orifice_area_m2 = 1e-9
    }),
    ("gap past the piston", |axis| {
        axis.pneumatics.piston_leak.laminar_kg_per_s_pa2 = 1e-17
    }),
    ("supply droop", |axis| {
        axis.pneumatics.supply_droop.tank_volume_m3 = 0.02
    }),
    ("silencer", |axis| {
        axis.pneumatics.back_pressure.silencer_area_m2 = 1e-4
    }),
    ("silencers of their own", |axis| {
        axis.pneumatics.back_pressure.silencer_area_m2 = 1e-4;
        axis.pneumatics.separate_exhausts = true;
    }),
    ("end cushion", |axis| {
        axis.pneumatics.cushion.length_m = 0.25
    }),
    ("wall offset", |axis| {
        axis.pneumatics.chamber_a.wall.offset_k = 0.1
    }),
    ("wall capacity", |axis| {
        axis.pneumatics.chamber_a.wall.heat_capacity_j_per_k = 1e3
    }),
    ("heat by density", |axis| {
        axis.pneumatics.chamber_a.heat_variation.density_exponent = 0.1
    }),
    ("heat by flow", |axis| {
        axis.pneumatics.chamber_a.heat_variation.flow_w_per_m2_k = 1.0
    }),
    ("gas temperature memory a", |axis| {
        axis.pneumatics.chamber_a.temperature_memory = 0.1
    }),
    ("gas temperature memory b", |axis| {
        axis.pneumatics.chamber_b.temperature_memory = 0.1
    }),
    ("wall conductance a", |axis| {
        axis.pneumatics.chamber_a.wall_conductance_w_per_k = 0.01
    }),
    ("wall conductance b", |axis| {
        axis.pneumatics.chamber_b.wall_conductance_w_per_k = 0.01
    }),
    ("Coulomb friction", |axis| {
        axis.friction_terms.coulomb_n = 0.1
    }),
    ("Stribeck friction", |axis| {
        axis.friction_terms.stribeck_n = 0.1
    }),
    ("viscous friction", |axis| {
        axis.friction_terms.viscous_n_s_per_m = 0.1
    }),
    ("friction per mean pressure", |axis| {
        axis.friction_terms.per_mean_pressure_n_per_pa = 1e-6;
    }),
    ("friction per pressure difference", |axis| {
        axis.friction_terms.per_pressure_difference_n_per_pa = 1e-6;
    }),
    ("static friction per mean pressure", |axis| {
        axis.friction_terms.static_rise_per_mean_pressure_n_per_pa = 1e-6;
    }),
    ("constant force", |axis| {
        axis.friction_terms.constant_force_n = 0.1
    }),
    ("friction wave, cosine", |axis| {
        effects(axis, |e| e.position_friction.cosine = 0.01);
    }),
    ("friction wave, sine", |axis| {
        effects(axis, |e| e.position_friction.sine = 0.01);
    }),
    ("friction slope", |axis| {
        effects(axis, |e| e.position_friction.slope_per_m = 0.05);
    }),
    ("friction curvature", |axis| {
        effects(axis, |e| e.position_friction.curvature_per_m2 = 1.0);
    }),
    ("friction asymmetry", |axis| {
        effects(axis, |e| e.direction_friction.asymmetry = 0.01);
    }),
    ("viscous asymmetry", |axis| {
        effects(axis, |e| e.direction_friction.viscous_asymmetry = 0.01);
    }),
    ("dwell stiction", |axis| {
        effects(axis, |e| e.dwell_stiction.rise_n = 1.0);
    }),
    ("load compliance", |axis| {
        effects(axis, |e| e.load = load(0.0))
    }),
    ("load backlash", |axis| {
        effects(axis, |e| e.load = load(2e-5))
    }),
    ("buffer stiffness", |axis| {
        effects(axis, |e| {
            e.elastic_buffer = ElasticBuffer {
                stiffness_n_per_m: 1e3,
                ..ElasticBuffer::NEUTRAL
            };
        });
    }),
    ("buffer damping", |axis| {
        effects(axis, |e| {
            e.elastic_buffer = ElasticBuffer {
                damping_n_s_per_m: 1.0,
                ..ElasticBuffer::NEUTRAL
            };
        });
    }),
    ("unknown force", |axis| {
        effects(axis, |e| e.unknown_force.at_knot_n[4] = 1.0);
    }),
    ("force equation", |axis| {
        effects(axis, |e| {
            e.force_equation = ForceEquation {
                drag_n_s2_per_m2: 10.0,
                trailing_n: 1.0,
                ..ForceEquation::neutral()
            };
        });
    }),
];

/// 0.3 s through the null and back; with the reduced model, which alone has a
/// use for the temperature memory.
fn run_with(switch: impl Fn(&mut Axis<f32>)) -> [u32; 7] {
    let mut axis = paper::axis::<f32>();
    for chamber in [
        &mut axis.pneumatics.chamber_a,
        &mut axis.pneumatics.chamber_b,
    ] {
        chamber.thermal = ThermalModel::Polytropic {
            expansion_index: 1.11,
            compression_index: 1.18,
            reference_pressure_pa: 5.25e5,
        };
    }
    switch(&mut axis);
    let mut state = at_rest(0.0, 5.25e5, 5.0);
    for step in 0..300_u32 {
        let phase = TAU * 5.0 * f64::from(step) * 1e-3;
        axis.step(&mut state, &inputs((5.0 + 2.0 * phase.sin()) as f32));
    }
    bits(&state)
}

#[test]
fn prop_every_effect_switched_on_changes_the_axis() {
    let without = run_with(|_| ());
    for (name, switch) in SWITCHES {
        assert_ne!(run_with(switch), without, "{name} changes nothing");
    }
}

/// A rig with every number that a fit may free.
const RIG: &str = r#"
format = "rig/1"
[gas]
gamma = 1.4
gas_constant_J_kgK = 287.0
[environment]
pressure_Pa = 101325.0
temperature_K = 293.15
[supply]
pressure_Pa = 7e5
[valve]
feeds_a_when = "above-null"
null_V = 5.03
critical_pressure_ratio = 0.29
laminar_pressure_ratio = 0.8  # low, so that the laminar branch is met
opening_V = [0.0, 0.3, 1.0, 2.0, 5.0]
supply_area_m2 = [1e-7, 1e-7, 2.2e-6, 6.3e-6, 16.7e-6]
exhaust_area_m2 = [1.1e-7, 1.1e-7, 2.4e-6, 6.6e-6, 17.1e-6]
[cylinder]
stroke_m = 0.5
bore_m = 0.025
area_a_m2 = 4.909e-4
area_b_m2 = 4.8e-4
dead_volume_a_m3 = 2.5e-5
dead_volume_b_m3 = 3.1e-5
position_zero = "mid-stroke"
[chambers]
model = "energy-balance"
heat_transfer_charging_W_m2K = 50.0
heat_transfer_discharging_W_m2K = 20.0
expansion_index = 1.11
compression_index = 1.18
polytropic_index = 1.2
[carriage]
mass_kg = 2.0
external_force_N = 1.0
[friction]
bristle_stiffness_N_m = 9.14e5
bristle_damping_Ns_m = 1327.0
viscous_Ns_m = 64.5
coulomb_N = 20.2
static_N = 28.9
stribeck_velocity_m_s = 5.03e-3
"#;

/// Effects with values off neutral; the delay off a whole number of steps.
const EFFECTS: &[(&str, f64)] = &[
    ("effects.valve-delay.delay_s", 2.3e-3),
    ("effects.valve-hysteresis.width", 0.05),
    ("effects.spool-dynamics.natural_frequency_Hz", 90.0),
    ("effects.spool-dynamics.damping_ratio", 0.7),
    ("effects.slew-limit.rising_per_s", 60.0),
    ("effects.slew-limit.falling_per_s", 50.0),
    ("effects.tube-line.length_m", 0.4),
    ("effects.tube-line.diameter_m", 0.004),
    ("effects.chamber-leakage.laminar_a_kg_s_Pa2", 1e-16),
    ("effects.chamber-leakage.laminar_b_kg_s_Pa2", 2e-16),
    ("effects.chamber-leakage.orifice_a_m2", 1e-8),
    ("effects.chamber-leakage.orifice_b_m2", 2e-8),
    ("effects.piston-leakage.laminar_kg_s_Pa2", 2e-16),
    ("effects.piston-leakage.orifice_m2", 3e-8),
    ("effects.supply-droop.tank_volume_m3", 2e-3),
    ("effects.supply-droop.feed_area_m2", 8e-6),
    ("effects.exhaust-back-pressure.silencer_area_m2", 1.5e-5),
    ("effects.exhaust-back-pressure.volume_m3", 3e-5),
    ("effects.variable-heat-transfer.density_exponent", 0.6),
    ("effects.variable-heat-transfer.flow_W_m2K", 30.0),
    ("effects.wall-temperature.offset_K", 5.0),
    ("effects.wall-temperature.heat_capacity_J_K", 20.0),
    ("effects.wall-temperature.outer_W_K", 3.0),
    // Long, so that the piston begins within its edge.
    ("effects.end-cushion.length_m", 0.2701),
    ("effects.end-cushion.needle_area_m2", 2e-6),
    ("effects.gas-temperature-dynamics.memory_a", 0.3),
    ("effects.gas-temperature-dynamics.memory_b", 0.4),
    ("effects.gas-temperature-dynamics.conductance_a_W_K", 0.2),
    ("effects.gas-temperature-dynamics.conductance_b_W_K", 0.3),
    ("effects.coulomb-friction.coulomb_N", 2.0),
    ("effects.stribeck-friction.static_excess_N", 3.0),
    ("effects.viscous-friction.viscous_Ns_m", 5.0),
    (
        "effects.pressure-dependent-friction.per_mean_pressure_N_Pa",
        3e-5,
    ),
    (
        "effects.pressure-dependent-friction.per_pressure_difference_N_Pa",
        2e-5,
    ),
    (
        "effects.pressure-dependent-friction.static_rise_per_mean_pressure_N_Pa",
        1e-5,
    ),
    ("effects.constant-force.force_N", 1.5),
    ("effects.dead-volume.volume_a_m3", 2e-6),
    ("effects.dead-volume.volume_b_m3", 3e-6),
    ("effects.position-dependent-friction.cosine", 0.2),
    ("effects.position-dependent-friction.sine", 0.1),
    ("effects.position-dependent-friction.wavelength_m", 0.08),
    ("effects.position-dependent-friction.slope_per_m", 0.3),
    ("effects.position-dependent-friction.curvature_per_m2", 0.5),
    // Less friction at the border where the piston begins: more, and it sticks and slips.
    ("effects.position-dependent-friction.zone_share", -0.1),
    ("effects.position-dependent-friction.zone_middle_m", 0.02),
    ("effects.position-dependent-friction.zone_length_m", 0.08),
    ("effects.direction-dependent-friction.asymmetry", 0.1),
    (
        "effects.direction-dependent-friction.viscous_asymmetry",
        -0.05,
    ),
    ("effects.dwell-stiction.rise_N", 10.0),
    ("effects.dwell-stiction.time_constant_s", 0.4),
    ("effects.load-backlash.load_mass_kg", 0.6),
    ("effects.load-backlash.stiffness_N_m", 2e5),
    ("effects.load-backlash.damping_Ns_m", 120.0),
    ("effects.load-backlash.gap_m", 2e-4),
    ("effects.port-throttle.outlet_a_m2", 1e-5),
    ("effects.port-throttle.outlet_b_m2", 8e-6),
    ("effects.end-cushion.buffer_length_m", 0.24),
    ("effects.end-cushion.buffer_stiffness_N_m", 2e3),
    ("effects.end-cushion.buffer_damping_Ns_m", 30.0),
];

/// Relative step of the central differences.
const STEP: f64 = 1e-6;
/// Error of the differences by the third derivative: 1e-12 times its ratio to
/// the first, which friction makes large.
const RELATIVE_MARGIN: f64 = 1e-6;
/// Rounding of the differences: 1e-16 over the step of 1e-6, times the ratio of
/// a state to its size (50), times what 200 steps add (measured: 5e-8 in all).
const ROUNDING_MARGIN: f64 = 1e-7;

/// The whole axis out of a rig's numbers, some replaced.
fn rig_axis<R: Real>(values: &Values<'_, R>) -> (Axis<R>, R) {
    let dt_s = 1e-3;
    let axis = Axis {
        command_path: values.command_path(dt_s),
        valve: values.valve().unwrap().unwrap(),
        pneumatics: values.pneumatics().unwrap(),
        carriage: values.carriage(),
        friction: values.friction_levels(),
        friction_terms: values.friction_terms(),
        supply_temperature_k: values.ambient().temperature_k,
        dt_s: R::from_f64(dt_s),
    };
    (axis, values.get("supply.pressure_Pa").unwrap())
}

/// Sizes by which states are compared: Pa, K, Pa, K, m, m/s.
const SIZES: [f64; 6] = [1e4, 1.0, 1e4, 1.0, 1e-2, 1e-1];

/// 200 ms of the whole axis, from states that no parameter changes.
fn simulate<R: Real>(values: &Values<'_, R>) -> [R; 6] {
    let (axis, supply_pressure_pa) = rig_axis(values);
    let number = R::from_f64;
    let mut state = AxisState::at_rest(
        number(-0.02),
        number(5.1e5),
        number(4.9e5),
        number(295.0),
        number(5.0),
    );
    for step in 0..200_u32 {
        let phase = TAU * 4.0 * f64::from(step) * 1e-3;
        let command_v = number(5.0 + 2.5 * phase.sin());
        axis.step(
            &mut state,
            &AxisInputs {
                command_v,
                supply_pressure_pa,
            },
        );
    }
    let pneumatics = &state.pneumatics;
    [
        pneumatics.a.pressure_pa.value,
        pneumatics.a.temperature_k.value,
        pneumatics.b.pressure_pa.value,
        pneumatics.b.temperature_k.value,
        state.carriage.position_m.value,
        state.carriage.velocity_m_per_s,
    ]
}

/// Keys that a model has no use for: their derivatives are nought.
fn is_unused(model: &str, key: &str) -> bool {
    match model {
        "energy-balance" => key.contains("_index") || key.contains("memory"),
        "polytropic" => key.contains("polytropic_index"),
        _ => key.contains("expansion_index") || key.contains("compression_index"),
    }
}

#[test]
fn val_gradients_of_the_axis_agree_with_differences() {
    for model in ["energy-balance", "polytropic", "polytropic-process"] {
        let rig = Rig::parse(&RIG.replace("energy-balance", model), "rig.toml").unwrap();
        let mut keys = rig.value_keys();
        let mut base: Vec<f64> = keys.iter().map(|key| rig.value(key).unwrap()).collect();
        keys.extend(EFFECTS.iter().map(|(key, _)| (*key).to_owned()));
        base.extend(EFFECTS.iter().map(|(_, value)| value));
        let mut worst = 0.0_f64;
        for (index, key) in keys.iter().enumerate() {
            let exact = exact_gradient(&rig, &keys, &base, index);
            let by_difference = differences(&rig, &keys, &base, index);
            let largest = exact.iter().fold(0.0_f64, |most, g| most.max(g.abs()));
            let pairs = exact.iter().zip(&by_difference);
            let apart = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            assert_eq!(largest > 0.0, !is_unused(model, key), "{model}: {key}");
            let share = apart / (largest * RELATIVE_MARGIN + ROUNDING_MARGIN);
            assert!(share < 1.0, "{model}: {key} is {apart:e} off {largest:e}");
            worst = worst.max(share);
        }
        println!(
            "{model}: {} parameters, worst at {worst:.2} of the bound",
            keys.len()
        );
    }
}

#[test]
fn regress_a_run_with_duals_has_the_bits_of_one_in_f64() {
    let rig = Rig::parse(RIG, "rig.toml").unwrap();
    let wide = simulate(&Values::<f64> {
        rig: &rig,
        keys: &[],
        replaced: &[],
    });
    let dual = simulate(&Values::<Dual<1>> {
        rig: &rig,
        keys: &[],
        replaced: &[],
    });
    assert_eq!(
        wide.map(f64::to_bits),
        dual.map(|state| state.value.to_bits())
    );
}

/// Change of each state, in its size, per relative change of one parameter.
fn exact_gradient(rig: &Rig, keys: &[String], base: &[f64], index: usize) -> [f64; 6] {
    let replaced: Vec<Dual<1>> = base
        .iter()
        .enumerate()
        .map(|(at, &value)| {
            if at == index {
                Dual::parameter(value, 0)
            } else {
                Dual::constant(value)
            }
        })
        .collect();
    let values = Values {
        rig,
        keys,
        replaced: &replaced,
    };
    let states = simulate(&values);
    std::array::from_fn(|i| states[i].gradient[0] * base[index] / SIZES[i])
}

fn differences(rig: &Rig, keys: &[String], base: &[f64], index: usize) -> [f64; 6] {
    let at = |factor: f64| {
        let mut replaced = base.to_vec();
        replaced[index] *= factor;
        simulate(&Values {
            rig,
            keys,
            replaced: &replaced,
        })
    };
    let (up, down) = (at(1.0 + STEP), at(1.0 - STEP));
    std::array::from_fn(|i| (up[i] - down[i]) / (2.0 * STEP) / SIZES[i])
}
