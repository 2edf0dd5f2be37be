//! The pneumatic effects that the paper leaves out: neutral, at their limits, in
//! balance, against known answers.

use model_core::axis::{Axis, AxisInputs, AxisState, PneumaticState, Pneumatics, ValveDrive};
use model_core::chamber::{Chamber, ChamberState};
use model_core::left_out::{
    EndCushion, ExhaustBackPressure, PistonLeakage, SupplyDroop, TankState, VariableHeatTransfer,
    WallTemperature,
};
use model_core::paper;
use model_core::real::{Dual, Real};
use model_core::valve::{GasState, PathAreas};

const AMBIENT_K: f64 = paper::AMBIENT_TEMPERATURE_K;
const AMBIENT_PA: f64 = paper::AMBIENT_PRESSURE_PA;
const SUPPLY_PA: f64 = 7e5;
const GAS_CONSTANT: f64 = 287.0;

fn gas<R: Real>(pressure_pa: f64) -> GasState<R> {
    GasState {
        pressure_pa: R::from_f64(pressure_pa),
        temperature_k: R::from_f64(AMBIENT_K),
    }
}

fn paper_pneumatics() -> Pneumatics<f64> {
    paper::axis::<f64>().pneumatics
}

fn adiabatic<R: Real>(pneumatics: &mut Pneumatics<R>) {
    for chamber in [&mut pneumatics.chamber_a, &mut pneumatics.chamber_b] {
        chamber.heat_transfer_charging_w_per_m2_k = R::ZERO;
        chamber.heat_transfer_discharging_w_per_m2_k = R::ZERO;
    }
}

fn drive<R: Real>(areas_m2: [f64; 4]) -> ValveDrive<R> {
    let [supply_a, exhaust_a, supply_b, exhaust_b] = areas_m2.map(R::from_f64);
    ValveDrive {
        areas: PathAreas {
            supply_a_m2: supply_a,
            exhaust_a_m2: exhaust_a,
            supply_b_m2: supply_b,
            exhaust_b_m2: exhaust_b,
        },
        supply: gas(SUPPLY_PA),
    }
}

fn mass_kg(chamber: &Chamber<f64>, state: &ChamberState<f64>, position_m: f64) -> f64 {
    state.pressure_pa.value * chamber.geometry.volume_m3(position_m)
        / (GAS_CONSTANT * state.temperature_k.value)
}

fn energy_j(chamber: &Chamber<f64>, state: &ChamberState<f64>, position_m: f64) -> f64 {
    state.pressure_pa.value * chamber.geometry.volume_m3(position_m) / 0.4
}

// neutral

/// Hard motion for a second, in steps of `dt_s`; the six states at the end.
fn run<R: Real>(dt_s: f64, switch: impl Fn(&mut Axis<R>)) -> [R; 6] {
    let mut axis = paper::axis::<R>();
    axis.dt_s = R::from_f64(dt_s);
    switch(&mut axis);
    let number = R::from_f64;
    let mut state = AxisState::at_rest(
        number(-0.05),
        number(4e5),
        number(5e5),
        number(290.0),
        number(5.0),
    );
    for step in 0..1000_u32 {
        let command_v = if (step / 90) % 2 == 0 { 6.5 } else { 3.2 };
        let inputs = AxisInputs {
            command_v: number(command_v),
            supply_pressure_pa: number(SUPPLY_PA),
        };
        axis.step(&mut state, &inputs);
    }
    let gas = &state.pneumatics;
    [
        gas.a.pressure_pa.value,
        gas.a.temperature_k.value,
        gas.b.pressure_pa.value,
        gas.b.temperature_k.value,
        state.carriage.position_m.value,
        state.carriage.velocity_m_per_s,
    ]
}

#[test]
fn regress_the_neutral_axis_keeps_its_bits() {
    // Of the step of second order, written down when it came.
    let narrow = run::<f32>(1e-3, |_| ()).map(f32::to_bits);
    let wide = run::<f64>(1e-3, |_| ()).map(f64::to_bits);
    assert_eq!(
        narrow,
        [
            0x48eb_b5e1,
            0x438f_3966,
            0x48e3_f4c7,
            0x438d_aa7c,
            0xbe01_9c4e,
            0x3f6b_94d2,
        ]
    );
    assert_eq!(
        wide,
        [
            0x411d_76bc_5512_d6e8,
            0x4071_e72c_c579_4191,
            0x411c_7e98_cdfb_f979,
            0x4071_b54f_8e2a_0f3c,
            0xbfc0_3389_8036_7ee0,
            0x3fed_7298_2378_e398,
        ]
    );
}

// limits

/// An effect with the parameters of its scale: 0 hardly there, 1 usual, 2 absurd.
type Scaled = (&'static str, fn(&mut Axis<f32>, usize));

const SCALED: [Scaled; 8] = [
    ("piston leak, orifice", |axis, scale| {
        axis.pneumatics.piston_leak.orifice_area_m2 = [1e-12, 1e-7, 1.0][scale];
    }),
    ("piston leak, gap", |axis, scale| {
        axis.pneumatics.piston_leak.laminar_kg_per_s_pa2 = [1e-22, 1e-16, 1e-3][scale];
    }),
    ("supply droop, feed", |axis, scale| {
        axis.pneumatics.supply_droop = SupplyDroop {
            tank_volume_m3: 2e-4,
            feed_area_m2: [1e-9, 1e-5, 1.0][scale],
        };
    }),
    ("supply droop, tank", |axis, scale| {
        axis.pneumatics.supply_droop = SupplyDroop {
            tank_volume_m3: [1e-12, 1e-3, 1e3][scale],
            feed_area_m2: 1e-5,
        };
    }),
    ("silencer, area", |axis, scale| {
        axis.pneumatics.back_pressure = ExhaustBackPressure {
            silencer_area_m2: [1e-10, 2e-5, 1.0][scale],
            volume_m3: 2e-5,
        };
    }),
    ("silencer, volume", |axis, scale| {
        axis.pneumatics.back_pressure = ExhaustBackPressure {
            silencer_area_m2: 2e-5,
            volume_m3: [0.0, 2e-5, 10.0][scale],
        };
    }),
    ("heat transfer and wall", |axis, scale| {
        for chamber in [
            &mut axis.pneumatics.chamber_a,
            &mut axis.pneumatics.chamber_b,
        ] {
            chamber.heat_variation = VariableHeatTransfer {
                density_exponent: [1e-3, 0.7, 2.0][scale],
                flow_w_per_m2_k: [1e-3, 50.0, 300.0][scale],
            };
            chamber.wall = WallTemperature {
                offset_k: [1e-3, 8.0, -60.0][scale],
                heat_capacity_j_per_k: [1e-9, 1e3, 1e9][scale],
                outer_w_per_k: [0.0, 0.5, 1e6][scale],
            };
        }
    }),
    ("end cushion", |axis, scale| {
        axis.pneumatics.cushion = EndCushion {
            length_m: [1e-6, 0.02, 10.0][scale],
            needle_area_m2: [1e-9, 1e-6, 1.0][scale],
        };
    }),
];

/// Ten seconds of bang-bang, the carriage stopped at the ends of the stroke.
fn hard_motion(axis: &Axis<f32>) -> ([f32; 2], AxisState<f32>) {
    let mut state = AxisState::at_rest(0.0, 4e5, 4e5, 293.15, 5.0);
    let mut range_pa = [f32::MAX, f32::MIN];
    for step in 0..10_000_u32 {
        let command_v = [10.0, 0.0, 7.0, 3.0][(step / 130) as usize % 4];
        let inputs = AxisInputs {
            command_v,
            supply_pressure_pa: 7e5,
        };
        axis.step(&mut state, &inputs);
        let carriage = &mut state.carriage;
        let x = carriage.position_m.value;
        if x.abs() > 0.25 {
            *carriage = model_core::carriage::CarriageState::new(0.25 * x.signum(), 0.0);
        }
        for gas in [&state.pneumatics.a, &state.pneumatics.b] {
            range_pa[0] = range_pa[0].min(gas.pressure_pa.value);
            range_pa[1] = range_pa[1].max(gas.pressure_pa.value);
        }
        let tank_pa = state.pneumatics.tank.pressure_pa(7e5);
        assert!((0.9e5..=7.6e5).contains(&tank_pa), "tank at {tank_pa}");
        let excess_pa = state.pneumatics.silencer.excess_pa();
        assert!((-1e3..=6.5e5).contains(&excess_pa), "silencer {excess_pa}");
    }
    (range_pa, state)
}

#[test]
fn prop_stable_at_1_khz_in_f32_from_hardly_there_to_absurd() {
    for tube_length_m in [0.0, 0.5] {
        for (name, switch) in SCALED {
            for scale in 0..3 {
                let mut axis = paper::axis::<f32>();
                axis.pneumatics.tube.length_m = tube_length_m;
                switch(&mut axis, scale);
                let ([least, most], state) = hard_motion(&axis);
                assert!(state.is_finite(), "{name} {scale}: {state:?}");
                assert!(
                    least > 0.3e5 && most < 2.5e6,
                    "{name} {scale}, tube {tube_length_m}: {least} to {most} Pa"
                );
            }
        }
    }
}

/// One way to switch an effect on.
type Switch = (&'static str, fn(&mut Axis<f64>));

#[test]
fn prop_an_effect_that_is_hardly_there_is_hardly_seen() {
    let without = run::<f64>(1e-3, |_| ());
    let cases: [Switch; 6] = [
        ("piston leak", |axis| {
            axis.pneumatics.piston_leak.orifice_area_m2 = 1e-14;
        }),
        ("tank", |axis| {
            axis.pneumatics.supply_droop.tank_volume_m3 = 1e3;
        }),
        ("feed", |axis| {
            axis.pneumatics.supply_droop = SupplyDroop {
                tank_volume_m3: 1e-9,
                feed_area_m2: 1e3,
            };
        }),
        ("silencer", |axis| {
            axis.pneumatics.back_pressure.silencer_area_m2 = 1e3;
        }),
        ("wall", |axis| {
            axis.pneumatics.chamber_a.wall.heat_capacity_j_per_k = 1e9;
        }),
        ("cushion", |axis| {
            axis.pneumatics.cushion = EndCushion {
                length_m: 1.0,
                needle_area_m2: 1.0,
            };
        }),
    ];
    for (name, switch) in cases {
        let with = run::<f64>(1e-3, switch);
        for (one, other) in without.iter().zip(with) {
            assert!(
                (one - other).abs() < 1e-5 * one.abs(),
                "{name}: {one} {other}"
            );
        }
    }
}

// piston leakage

/// Two chambers and nothing but the leak, piston held off the middle.
fn levelled(leak: PistonLeakage<f64>, dt_s: f64, time_s: f64) -> PneumaticState<f64> {
    let mut pneumatics = paper_pneumatics();
    pneumatics.piston_leak = leak;
    adiabatic(&mut pneumatics);
    let mut state = PneumaticState::at_rest(gas(6e5), gas(4e5));
    let steps = (time_s / dt_s).round() as u32;
    for _ in 0..steps {
        pneumatics.step(&mut state, None, 0.1, 0.1, dt_s);
    }
    state
}

#[test]
fn prop_what_one_chamber_loses_the_other_gets() {
    let pneumatics = paper_pneumatics();
    let (a, b) = (&pneumatics.chamber_a, &pneumatics.chamber_b);
    let begin = PneumaticState::at_rest(gas(6e5), gas(4e5));
    let total = |of: fn(&Chamber<f64>, &ChamberState<f64>, f64) -> f64,
                 state: &PneumaticState<f64>| {
        of(a, &state.a, 0.1) + of(b, &state.b, 0.1)
    };
    for orifice_area_m2 in [0.0, 1e-8, 1e-6, 1e-3] {
        for laminar_kg_per_s_pa2 in [1e-16, 1e-10] {
            let leak = PistonLeakage {
                laminar_kg_per_s_pa2,
                orifice_area_m2,
            };
            let end = levelled(leak, 1e-3, 2.0);
            assert!((total(mass_kg, &end) / total(mass_kg, &begin) - 1.0).abs() < 1e-12);
            assert!((total(energy_j, &end) / total(energy_j, &begin) - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn val_a_leaking_piston_levels_the_pressures_as_the_closed_form() {
    // Adiabatic: the energy, so the mean of p V, stays; both end there.
    let pneumatics = paper_pneumatics();
    let volume_a = pneumatics.chamber_a.geometry.volume_m3(0.1);
    let volume_b = pneumatics.chamber_b.geometry.volume_m3(0.1);
    let mean = (6e5 * volume_a + 4e5 * volume_b) / (volume_a + volume_b);
    let leak = PistonLeakage {
        laminar_kg_per_s_pa2: 0.0,
        orifice_area_m2: 1e-6,
    };
    let end = levelled(leak, 1e-3, 20.0);
    assert!((end.a.pressure_pa.value / mean - 1.0).abs() < 1e-6);
    assert!((end.b.pressure_pa.value / mean - 1.0).abs() < 1e-6);
    // A laminar gap, before the temperatures part: the difference decays at
    // gamma R T K (pa + pb) (1/Va + 1/Vb).
    let leak = PistonLeakage {
        laminar_kg_per_s_pa2: 1e-14,
        orifice_area_m2: 0.0,
    };
    let time_s = 2e-3;
    let end = levelled(leak, 1e-4, time_s);
    let sum_pa = end.a.pressure_pa.value + end.b.pressure_pa.value;
    let rate = 1.4 * GAS_CONSTANT * AMBIENT_K * 1e-14 * sum_pa * (1.0 / volume_a + 1.0 / volume_b);
    let apart_pa = end.a.pressure_pa.value - end.b.pressure_pa.value;
    assert!((apart_pa / (2e5 * (-rate * time_s).exp()) - 1.0).abs() < 3e-4);
}

// supply droop

#[test]
fn prop_the_tank_loses_what_the_chambers_get() {
    // Without a feed; exhausts shut, so the gas is in tank and chambers.
    let mut pneumatics = paper_pneumatics();
    let tank_volume_m3 = 2e-4;
    pneumatics.supply_droop = SupplyDroop {
        tank_volume_m3,
        feed_area_m2: 0.0,
    };
    for tube_length_m in [0.0, 0.5] {
        pneumatics.tube.length_m = tube_length_m;
        let mut state = PneumaticState::at_rest(gas(1.5e5), gas(2e5));
        let total = |state: &PneumaticState<f64>, x: f64| {
            let tube_m3 = core::f64::consts::FRAC_PI_4 * 1.6e-5 * tube_length_m;
            let per_pa = 1.0 / (GAS_CONSTANT * AMBIENT_K);
            let tubes = (state.tube_a.mean_pa() + state.tube_b.mean_pa()) * tube_m3;
            let tank = state.tank.pressure_pa(SUPPLY_PA) * tank_volume_m3;
            mass_kg(&pneumatics.chamber_a, &state.a, x)
                + mass_kg(&pneumatics.chamber_b, &state.b, x)
                + (tubes + tank) * per_pa
        };
        let begin = total(&state, 0.0);
        let mut x = 0.0;
        for step in 0..2000 {
            let next = 0.1 * libm::sin(f64::from(step + 1) * 6e-3);
            let areas = [1.67e-5, 0.0, 4e-6 * f64::from(step % 2), 0.0];
            pneumatics.step_behind_regulator(&mut state, &drive(areas), x, next, 1e-3);
            x = next;
        }
        let drift = total(&state, x) / begin - 1.0;
        assert!(drift.abs() < 1e-11, "tube {tube_length_m}: {drift}");
        assert!(state.tank.pressure_pa(SUPPLY_PA) < 5.5e5);
    }
}

/// The tank emptied through a choked orifice into a chamber that is all but a
/// vacuum: exponential.
#[test]
fn val_a_tank_empties_as_the_closed_form() {
    let mut pneumatics = paper_pneumatics();
    let (tank_volume_m3, area_m2) = (2e-3, 1e-5);
    pneumatics.supply_droop = SupplyDroop {
        tank_volume_m3,
        feed_area_m2: 0.0,
    };
    // A chamber so large that its pressure does not rise; Cd(r) is then Cd(0).
    pneumatics.chamber_a.geometry.dead_volume_m3 = 1e6;
    let end_after = |steps: u32, dt_s: f64| {
        let mut state = PneumaticState::at_rest(gas(200.0), gas(2e5));
        for _ in 0..steps {
            let drive = drive([area_m2, 0.0, 0.0, 0.0]);
            pneumatics.step_behind_regulator(&mut state, &drive, 0.0, 0.0, dt_s);
        }
        state.tank.pressure_pa(SUPPLY_PA)
    };
    let c = 0.8153 * pneumatics.gas.flow_coefficient * area_m2 / AMBIENT_K.sqrt();
    let rate_per_s = c * GAS_CONSTANT * AMBIENT_K / tank_volume_m3;
    let expected_pa = SUPPLY_PA * (-rate_per_s * 2.0).exp();
    let end_pa = end_after(2000, 1e-3);
    assert!(
        (end_pa / expected_pa - 1.0).abs() < 2e-4,
        "{end_pa} {expected_pa}"
    );
    let errors = [200, 400]
        .map(|steps: u32| (end_after(steps, 2.0 / f64::from(steps)) - end_after(4000, 5e-4)).abs());
    let order = (errors[0] / errors[1]).log2();
    assert!((order - 2.0).abs() < 0.1, "order {order}");
}

#[test]
fn val_a_drawn_tank_settles_where_feed_and_draw_balance() {
    // Two equal orifices in series, steady: what the feed lets in, the valve takes.
    let mut pneumatics = paper_pneumatics();
    pneumatics.supply_droop = SupplyDroop {
        tank_volume_m3: 2e-4,
        feed_area_m2: 1e-5,
    };
    pneumatics.chamber_a.geometry.dead_volume_m3 = 1e6;
    let mut state = PneumaticState::at_rest(gas(2e5), gas(2e5));
    state.tank = TankState::at(3e5);
    for _ in 0..3000 {
        let drive = drive([1e-5, 0.0, 0.0, 0.0]);
        pneumatics.step_behind_regulator(&mut state, &drive, 0.0, 0.0, 1e-3);
    }
    let tank = gas(state.tank.pressure_pa(SUPPLY_PA));
    let law = &pneumatics.law;
    let fed = law.flow(1e-5, gas(SUPPLY_PA), tank).mass_flow_kg_per_s;
    let drawn = law.flow(1e-5, tank, state.a.gas_state()).mass_flow_kg_per_s;
    assert!((fed / drawn - 1.0).abs() < 1e-6, "{fed} {drawn}");
}

#[test]
fn prop_a_measured_supply_drives_past_the_tank() {
    let plain = paper_pneumatics();
    let mut fed = plain;
    fed.supply_droop.tank_volume_m3 = 1e-3;
    let mut states = [PneumaticState::at_rest(gas(3e5), gas(3e5)); 2];
    for _ in 0..100 {
        let drive = drive([1e-5, 0.0, 0.0, 1e-5]);
        plain.step(&mut states[0], Some(&drive), 0.0, 0.0, 1e-3);
        fed.step(&mut states[1], Some(&drive), 0.0, 0.0, 1e-3);
    }
    assert_eq!(states[0], states[1]);
}

// exhaust back pressure

#[test]
fn val_a_silencer_settles_as_two_orifices_in_series() {
    // A chamber that does not fall feeds exhaust and silencer for ever.
    let mut pneumatics = paper_pneumatics();
    pneumatics.chamber_a.geometry.dead_volume_m3 = 1e6;
    for (silencer_area_m2, volume_m3) in [(1.67e-5, 2e-5), (1.67e-5, 0.0), (5e-6, 1e-3)] {
        pneumatics.back_pressure = ExhaustBackPressure {
            silencer_area_m2,
            volume_m3,
        };
        let mut state = PneumaticState::at_rest(gas(5e5), gas(AMBIENT_PA));
        for _ in 0..2000 {
            let drive = drive([0.0, 1.67e-5, 0.0, 0.0]);
            pneumatics.step(&mut state, Some(&drive), 0.0, 0.0, 1e-3);
        }
        let chamber = state.a.gas_state();
        let law = &pneumatics.law;
        let (mut low, mut high) = (AMBIENT_PA, 5e5);
        for _ in 0..60 {
            let between: GasState<f64> = gas(0.5 * (low + high));
            let into = law.flow(1.67e-5, chamber, between).mass_flow_kg_per_s;
            let out = law
                .flow(silencer_area_m2, between, gas(AMBIENT_PA))
                .mass_flow_kg_per_s;
            if into > out {
                low = between.pressure_pa;
            } else {
                high = between.pressure_pa;
            }
        }
        let found = AMBIENT_PA + state.silencer.excess_pa();
        assert!((found / low - 1.0).abs() < 1e-6, "{found} for {low}");
    }
}

/// Both chambers blow off at once, from unlike pressures; returns the gas and both excesses.
fn blown_off(separate: bool, silencer_area_m2: f64, volume_m3: f64) -> PneumaticState<f64> {
    let mut pneumatics = paper::axis::<f64>().pneumatics;
    pneumatics.separate_exhausts = separate;
    pneumatics.back_pressure = ExhaustBackPressure {
        silencer_area_m2,
        volume_m3,
    };
    let drive = drive([0.0, 1e-5, 0.0, 4e-6]);
    let mut state = PneumaticState::at_rest(gas(6e5), gas(3e5));
    for _ in 0..40 {
        pneumatics.step(&mut state, Some(&drive), 0.0, 0.0, 1e-3);
    }
    state
}

fn pressures_pa(state: &PneumaticState<f64>) -> [f64; 2] {
    [state.a.pressure_pa.value, state.b.pressure_pa.value]
}

#[test]
fn val_two_silencers_are_none_when_wide_and_do_not_couple_the_chambers() {
    let open = pressures_pa(&blown_off(false, 0.0, 2e-5));
    let wide = pressures_pa(&blown_off(true, 1e3, 2e-5));
    for (open_pa, wide_pa) in open.iter().zip(wide) {
        assert!((open_pa - wide_pa).abs() < 1e-2, "{open_pa} {wide_pa}");
    }
    // A silencer at each port holds back the gas of its own chamber, a common one of that
    // area both; one for both that is as wide as two is none of these.
    let (two, one) = (blown_off(true, 6e-6, 2e-5), blown_off(false, 6e-6, 2e-5));
    let excess =
        |state: &PneumaticState<f64>| [state.silencer.excess_pa(), state.silencer_b.excess_pa()];
    assert!(excess(&two)[0] > 2.0 * excess(&two)[1] && excess(&two)[1] > 1e3);
    assert!(
        excess(&one)[1].abs() < 1e-9,
        "a common one has no second state"
    );
    let (two_pa, one_pa) = (pressures_pa(&two), pressures_pa(&one));
    // A common one lets the gas of chamber a into chamber b.
    assert!(
        one_pa[1] > 3.2e5 && two_pa[1] < 2.5e5,
        "{one_pa:?} {two_pa:?}"
    );
}

#[test]
fn prop_two_silencers_let_out_what_their_chambers_gave() {
    let volume_m3 = 2e-4;
    let (before, after) = (
        PneumaticState::at_rest(gas(6e5), gas(3e5)),
        blown_off(true, 1e-15, volume_m3),
    );
    let pneumatics = paper::axis::<f64>().pneumatics;
    let sides = [
        (&pneumatics.chamber_a, &before.a, &after.a, after.silencer),
        (&pneumatics.chamber_b, &before.b, &after.b, after.silencer_b),
    ];
    for (chamber, before, after, silencer) in sides {
        let stored_kg = |state: &ChamberState<f64>| {
            state.pressure_pa.value * chamber.geometry.volume_m3(0.0)
                / (GAS_CONSTANT * state.temperature_k.value)
        };
        let given_kg = stored_kg(before) - stored_kg(after);
        let caught_kg = silencer.excess_pa() * volume_m3 / (GAS_CONSTANT * AMBIENT_K);
        assert!(given_kg > 1e-5 && (caught_kg / given_kg - 1.0).abs() < 1e-8);
    }
}

#[test]
fn prop_a_silencer_lets_out_what_the_chambers_gave() {
    // So large that nothing gets out in time: it holds what the chambers lost.
    let mut pneumatics = paper_pneumatics();
    pneumatics.back_pressure = ExhaustBackPressure {
        silencer_area_m2: 1e-15,
        volume_m3: 2e-4,
    };
    let mut state = PneumaticState::at_rest(gas(6e5), gas(5e5));
    let total = |state: &PneumaticState<f64>| {
        mass_kg(&pneumatics.chamber_a, &state.a, 0.0)
            + mass_kg(&pneumatics.chamber_b, &state.b, 0.0)
            + state.silencer.excess_pa() * 2e-4 / (GAS_CONSTANT * AMBIENT_K)
    };
    let begin = total(&state);
    for _ in 0..500 {
        let drive = drive([0.0, 1.67e-5, 0.0, 4e-6]);
        pneumatics.step(&mut state, Some(&drive), 0.0, 0.0, 1e-3);
    }
    // What leaks through the closed silencer is under 1e-9 of it.
    assert!((total(&state) / begin - 1.0).abs() < 1e-8);
    assert!(state.silencer.excess_pa() > 1e5);
}

// wall

#[test]
fn val_a_sealed_chamber_settles_at_the_walls_temperature() {
    let mut chamber = paper_pneumatics().chamber_a;
    chamber.wall.offset_k = 8.0;
    let mut state = ChamberState::new(5e5, AMBIENT_K);
    let stroke = chamber.stroke(0.0, 0.0);
    for _ in 0..60_000 {
        chamber.step(
            &mut state,
            &stroke,
            |_| model_core::chamber::ChamberFlow::NONE,
            1e-3,
        );
    }
    assert!((state.temperature_k.value - AMBIENT_K - 8.0).abs() < 1e-6);
    assert!((state.pressure_pa.value / 5e5 - 1.0 - 8.0 / AMBIENT_K).abs() < 1e-8);
}

#[test]
fn val_gas_and_wall_share_their_heat_and_the_wall_cools_in_its_own_time() {
    let mut chamber = paper_pneumatics().chamber_a;
    chamber.wall = WallTemperature {
        offset_k: 0.0,
        heat_capacity_j_per_k: 2.0,
        outer_w_per_k: 0.0,
    };
    let step = |chamber: &Chamber<f64>, state: &mut ChamberState<f64>| {
        let stroke = chamber.stroke(0.0, 0.0);
        chamber.step(
            state,
            &stroke,
            |_| model_core::chamber::ChamberFlow::NONE,
            1e-3,
        );
    };
    let mut state = ChamberState::new(5e5, 340.0);
    let begin = energy_j(&chamber, &state, 0.0);
    for _ in 0..60_000 {
        step(&chamber, &mut state);
    }
    let gained = 2.0 * state.wall_rise_k.value;
    assert!((energy_j(&chamber, &state, 0.0) + gained - begin).abs() < 1e-9 * begin);
    assert!((state.temperature_k.value - AMBIENT_K - state.wall_rise_k.value).abs() < 1e-6);
    // No gas heat to speak of: the wall's own exponential.
    chamber.heat_transfer_charging_w_per_m2_k = 0.0;
    chamber.wall.outer_w_per_k = 0.5;
    chamber.wall.offset_k = 10.0;
    let mut state = ChamberState::new(5e5, AMBIENT_K);
    for _ in 0..4000 {
        step(&chamber, &mut state);
    }
    let left = 10.0 + state.wall_rise_k.value;
    assert!((left / (10.0 * (-1.0_f64).exp()) - 1.0).abs() < 1e-6);
}

// end cushion

#[test]
fn prop_a_cushion_brakes_only_the_shrinking_chamber() {
    let mut pneumatics = paper_pneumatics();
    pneumatics.cushion = EndCushion {
        length_m: 0.02,
        needle_area_m2: 5e-7,
    };
    for tube_length_m in [0.0, 0.3] {
        pneumatics.tube.length_m = tube_length_m;
        let after = |pneumatics: &Pneumatics<f64>, steps, areas, begin_pa: f64, position_m| {
            let mut state = PneumaticState::at_rest(gas(begin_pa), gas(begin_pa));
            for _ in 0..steps {
                let drive = drive(areas);
                pneumatics.step(&mut state, Some(&drive), position_m, position_m, 1e-3);
            }
            state.a.pressure_pa.value
        };
        let mut open = pneumatics;
        open.cushion = EndCushion::neutral();
        let (out, into) = ([0.0, 1e-5, 0.0, 0.0], [1e-5, 0.0, 0.0, 0.0]);
        let held = after(&pneumatics, 30, out, 5e5, -0.245);
        let freed = after(&open, 30, out, 5e5, -0.245);
        assert!(held > freed + 5e4, "tube {tube_length_m}: {held} {freed}");
        // Inflow is free as long as it flows in, and so is everything away from the
        // end. (What the gas in a tube has pushed in beyond the supply's pressure
        // comes out through the needle again.)
        for (steps, areas, begin_pa, position_m) in [(5, into, 2e5, -0.245), (30, out, 5e5, -0.2)] {
            let with = after(&pneumatics, steps, areas, begin_pa, position_m);
            let without = after(&open, steps, areas, begin_pa, position_m);
            assert!((with / without - 1.0).abs() < 1e-12, "{with} {without}");
            assert!(with < 0.95 * begin_pa || with > 1.2 * begin_pa, "{with}");
        }
        // Gas that the piston has braked to more than the supply's pressure leaves by the
        // needle as well.
        let held = after(&pneumatics, 10, into, 1.5 * SUPPLY_PA, -0.245);
        let freed = after(&open, 10, into, 1.5 * SUPPLY_PA, -0.245);
        assert!(held > freed + 5e4, "tube {tube_length_m}: {held} {freed}");
    }
}

// derivatives and order

/// One parameter of one effect, by a factor.
type Parameter<R> = fn(&mut Axis<R>, R);

fn parameters<R: Real>() -> [(&'static str, f64, Parameter<R>); 13] {
    fn chambers<R: Real>(axis: &mut Axis<R>) -> [&mut Chamber<R>; 2] {
        [
            &mut axis.pneumatics.chamber_a,
            &mut axis.pneumatics.chamber_b,
        ]
    }
    [
        ("piston orifice", 1e-7, |axis, value| {
            axis.pneumatics.piston_leak.orifice_area_m2 = value;
        }),
        ("piston gap", 3e-16, |axis, value| {
            axis.pneumatics.piston_leak.laminar_kg_per_s_pa2 = value;
        }),
        ("tank volume", 1e-3, |axis, value| {
            axis.pneumatics.supply_droop.tank_volume_m3 = value;
        }),
        ("feed area", 5e-6, |axis, value| {
            axis.pneumatics.supply_droop = SupplyDroop {
                tank_volume_m3: R::from_f64(1e-3),
                feed_area_m2: value,
            };
        }),
        ("silencer area", 1e-5, |axis, value| {
            axis.pneumatics.back_pressure.silencer_area_m2 = value;
        }),
        ("silencer volume", 5e-5, |axis, value| {
            axis.pneumatics.back_pressure = ExhaustBackPressure {
                silencer_area_m2: R::from_f64(1e-5),
                volume_m3: value,
            };
        }),
        ("density exponent", 0.7, |axis, value| {
            for chamber in chambers(axis) {
                chamber.heat_variation.density_exponent = value;
            }
        }),
        ("heat by flow", 40.0, |axis, value| {
            for chamber in chambers(axis) {
                chamber.heat_variation.flow_w_per_m2_k = value;
            }
        }),
        ("wall offset", 8.0, |axis, value| {
            for chamber in chambers(axis) {
                chamber.wall.offset_k = value;
            }
        }),
        ("wall capacity", 3.0, |axis, value| {
            for chamber in chambers(axis) {
                chamber.wall.heat_capacity_j_per_k = value;
            }
        }),
        ("wall conductance", 2.0, |axis, value| {
            for chamber in chambers(axis) {
                chamber.wall.heat_capacity_j_per_k = R::from_f64(3.0);
                chamber.wall.outer_w_per_k = value;
            }
        }),
        ("cushion length", 0.245_25, |axis, value| {
            axis.pneumatics.cushion.length_m = value;
        }),
        ("needle", 1e-6, |axis, value| {
            axis.pneumatics.cushion = EndCushion {
                length_m: R::from_f64(0.5),
                needle_area_m2: value,
            };
        }),
    ]
}

/// Chambers under a given motion, with the valve through its null: the last
/// pressures and temperatures.
fn driven<R: Real>(
    steps_per_ms: u32,
    tube_length_m: f64,
    command_v: impl Fn(f64) -> f64,
    switch: impl Fn(&mut Axis<R>),
) -> [R; 4] {
    let mut axis = paper::axis::<R>();
    axis.pneumatics.tube.length_m = R::from_f64(tube_length_m);
    switch(&mut axis);
    let number = R::from_f64;
    let dt_s = 1e-3 / f64::from(steps_per_ms);
    let mut state = PneumaticState::at_rest(gas(5.5e5), gas(4e5));
    let position = |time_s: f64| number(0.02 * libm::sin(12.0 * time_s));
    for step in 0..300 * steps_per_ms {
        let from_s = f64::from(step) * dt_s;
        let command_v = number(command_v(from_s + 0.5 * dt_s));
        let drive = ValveDrive {
            areas: axis.valve.areas(command_v),
            supply: gas(SUPPLY_PA),
        };
        let (from_m, to_m) = (position(from_s), position(from_s + dt_s));
        let dt_s = number(dt_s);
        axis.pneumatics
            .step_behind_regulator(&mut state, &drive, from_m, to_m, dt_s);
    }
    [
        state.a.pressure_pa.value,
        state.a.temperature_k.value,
        state.b.pressure_pa.value,
        state.b.temperature_k.value,
    ]
}

#[test]
fn val_derivatives_by_every_parameter_agree_with_differences() {
    const STEP: f64 = 5e-7;
    for tube_length_m in [0.0, 0.4] {
        let duals = parameters::<Dual<1>>();
        for ((name, value, set), (_, _, set_dual)) in parameters::<f64>().into_iter().zip(duals) {
            let through_null = |time_s: f64| 5.0 + 1.7 * libm::sin(25.0 * time_s + 0.4);
            let exact = driven(1, tube_length_m, through_null, |axis| {
                set_dual(axis, Dual::parameter(value, 0));
            });
            let at = |factor: f64| {
                driven(1, tube_length_m, through_null, |axis| {
                    set(axis, value * factor);
                })
            };
            let (up, down) = (at(1.0 + STEP), at(1.0 - STEP));
            for (state, size) in [1e3, 1.0, 1e3, 1.0].into_iter().enumerate() {
                let by_dual = exact[state].gradient[0] * value / size;
                let by_difference = (up[state] - down[state]) / (2.0 * STEP) / size;
                let margin = 1e-4 * by_difference.abs() + 1e-5;
                assert!(
                    (by_dual - by_difference).abs() < margin,
                    "{name}, tube {tube_length_m}, state {state}: {by_dual} {by_difference}"
                );
            }
            let acts = exact.iter().any(|state| state.gradient[0].abs() > 0.0);
            assert!(acts, "{name} does nothing");
        }
    }
}

#[test]
fn val_orders_of_the_effects() {
    // Chamber b under a valve open one way, so that every path stays in one branch
    // of its law (but for the entry of the cushion). The piston leak takes the
    // pressures of the step's start: of first order, and small.
    let one_way = |time_s: f64| 6.0 + 0.3 * libm::sin(25.0 * time_s);
    for (name, value, set) in parameters::<f64>() {
        let expected = if name.starts_with("piston") { 1.0 } else { 2.0 };
        let ends = [1, 2, 4, 8].map(|n| driven(n, 0.0, one_way, |axis| set(axis, value)));
        let change = |i: usize| (ends[i + 1][2] - ends[i][2]).abs();
        let order = (change(1) / change(2)).log2();
        println!("{name}: {:.1e} Pa, order {order:.2}", change(0));
        assert!((order - expected).abs() < 0.45, "{name}: {order}");
        assert!(change(0) < 10.0, "{name}: {} Pa", change(0));
    }
}
