//! The effects of the carriage's own motion, in its step: known answers,
//! conservation, stability in `f32`, derivatives.

#![expect(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use model_core::carriage::CarriageEffects;
use model_core::carriage::{Carriage, CarriageState};
use model_core::friction::FrictionLevels;
use model_core::left_out::{
    DirectionDependentFriction, DwellStiction, ElasticBuffer, ForceEquation, ForceVariable,
    FrictionZone, LoadCoupling, PositionDependentFriction,
};
use model_core::paper;
use model_core::real::{Dual, Real};
use std::f64::consts::TAU;

type Change<R> = fn(&mut CarriageEffects<R>);

fn carriage<R: Real>(effects: Option<CarriageEffects<R>>) -> Carriage<R> {
    Carriage {
        effects,
        ..paper::axis().carriage
    }
}

fn with<R: Real>(change: impl FnOnce(&mut CarriageEffects<R>)) -> Carriage<R> {
    let mut effects = CarriageEffects::neutral();
    change(&mut effects);
    carriage(Some(effects))
}

/// Neither friction nor a bristle's damping.
fn frictionless(mut carriage: Carriage<f64>) -> (Carriage<f64>, FrictionLevels<f64>) {
    carriage.bristle.damping_n_s_per_m = 0.0;
    let none = FrictionLevels {
        coulomb_n: 0.0,
        static_n: 0.0,
        viscous_n_s_per_m: 0.0,
    };
    (carriage, none)
}

/// A drive that reverses hard, N, with stops in between.
fn hard_n(time_s: f64) -> f64 {
    let gate = if (time_s * 0.7).fract() < 0.8 {
        1.0
    } else {
        0.0
    };
    gate * (180.0 * (TAU * 2.0 * time_s).sin() + 60.0 * (TAU * 17.0 * time_s).sin())
}

fn run<R: Real>(carriage: &Carriage<R>, seconds: f64, dt_s: f64) -> Vec<CarriageState<R>> {
    let levels = paper::friction_levels::<R>();
    let mut state = CarriageState::new(R::ZERO, R::ZERO);
    (0..(seconds / dt_s) as u32)
        .map(|step| {
            let drive = R::from_f64(hard_n(f64::from(step) * dt_s));
            carriage.step(&mut state, &levels, drive, R::from_f64(dt_s));
            state
        })
        .collect()
}

fn bits<R: Real>(states: &[CarriageState<R>]) -> Vec<[u64; 4]> {
    let one = |state: &CarriageState<R>| {
        [
            state.position_m.value,
            state.velocity_m_per_s,
            state.deflection_m,
            state.friction_n,
        ]
        .map(|number| number.value().to_bits())
    };
    states.iter().map(one).collect()
}

#[test]
fn prop_neutral_effects_leave_the_carriage_bit_identical() {
    let neutral = CarriageEffects::<f32>::neutral();
    assert!(neutral.if_any().is_none());
    let (with, without) = (carriage(Some(neutral)), carriage::<f32>(None));
    assert_eq!(
        bits(&run(&with, 2.0, 1e-3)),
        bits(&run(&without, 2.0, 1e-3))
    );
    let (with, without) = (
        carriage(Some(CarriageEffects::<f64>::neutral())),
        carriage::<f64>(None),
    );
    assert_eq!(
        bits(&run(&with, 2.0, 1e-3)),
        bits(&run(&without, 2.0, 1e-3))
    );
}

const EXTREMES: [(&str, Change<f32>); 8] = [
    ("a strong short wave", |effects| {
        effects.position_friction.cosine = 0.9;
        effects.position_friction.sine = 0.9;
        effects.position_friction.wavelength_m = 5e-3;
    }),
    ("a steep trend", |effects| {
        effects.position_friction.slope_per_m = 30.0;
        effects.position_friction.curvature_per_m2 = -100.0;
    }),
    ("a one-way seal", |effects| {
        effects.direction_friction.asymmetry = 2.0;
        effects.direction_friction.viscous_asymmetry = -2.0;
    }),
    ("a fast and large growth", |effects| {
        effects.dwell_stiction.rise_n = 200.0;
        effects.dwell_stiction.time_constant_s = 1e-3;
    }),
    ("a stiff light load", |effects| {
        effects.load = load(0.05, 1e7, 0.0, 0.0);
    }),
    ("a stiff heavy load", |effects| {
        effects.load = load(1.9, 1e6, 2000.0, 0.0);
    }),
    ("a stiff load with little play", |effects| {
        effects.load = load(1.0, 1e6, 0.0, 20e-6);
    }),
    ("a loose load before hard buffers", |effects| {
        effects.load = load(1.5, 1e6, 50.0, 5e-3);
        effects.elastic_buffer = buffers(0.05, 1e7, 0.0);
    }),
];

fn load<R: Real>(mass_kg: f64, stiffness: f64, damping: f64, gap_m: f64) -> LoadCoupling<R> {
    LoadCoupling {
        load_mass_kg: R::from_f64(mass_kg),
        stiffness_n_per_m: R::from_f64(stiffness),
        damping_n_s_per_m: R::from_f64(damping),
        gap_m: R::from_f64(gap_m),
    }
}

fn buffers<R: Real>(edge_m: f64, stiffness: f64, damping: f64) -> ElasticBuffer<R> {
    ElasticBuffer {
        low_m: R::from_f64(-edge_m),
        high_m: R::from_f64(edge_m),
        stiffness_n_per_m: R::from_f64(stiffness),
        damping_n_s_per_m: R::from_f64(damping),
    }
}

#[test]
fn prop_every_effect_is_stable_at_1_khz_in_f32() {
    let gentle = run(&carriage::<f32>(None), 10.0, 1e-3);
    let fastest = |states: &[CarriageState<f32>]| {
        states.iter().fold(0.0_f32, |most, state| {
            most.max(state.velocity_m_per_s.abs())
        })
    };
    for (name, change) in EXTREMES {
        let states = run(&with(change), 10.0, 1e-3);
        assert!(
            states.iter().all(|state| state.velocity_m_per_s.is_finite()
                && state.load.ahead_m.is_finite()
                && (0.0..=1.0).contains(&state.contact_age)),
            "{name}"
        );
        // A light carriage before a loose load is faster, but not by much.
        assert!(
            fastest(&states) < 4.0 * fastest(&gentle),
            "{name}: {} against {}",
            fastest(&states),
            fastest(&gentle)
        );
        let apart = states
            .iter()
            .fold(0.0_f32, |most, state| most.max(state.load.ahead_m.abs()));
        assert!(apart < 0.01, "{name}: the load is {apart} m away");
    }
}

#[test]
fn val_two_masses_swing_at_their_eigenfrequency() {
    let (spring, own) = (2e5, 0.8);
    let (carriage, none) = frictionless(with(|e| e.load = load(own, spring, 0.0, 0.0)));
    let rest_kg = carriage.mass_kg - own;
    let expected_hz = (spring * carriage.mass_kg / (rest_kg * own)).sqrt() / TAU;
    let dt_s = 5e-5;
    let mut state = CarriageState::new(0.0, 0.0);
    state.load.ahead_m = 1e-3;
    let mut crossings = Vec::new();
    for step in 0..20_000_u32 {
        let before = state.load.ahead_m;
        carriage.step(&mut state, &none, 0.0, dt_s);
        if before < 0.0 && state.load.ahead_m >= 0.0 {
            crossings.push(f64::from(step) - before / (state.load.ahead_m - before));
        }
    }
    let periods = (crossings.len() - 1) as f64;
    let found_hz = periods / ((crossings[crossings.len() - 1] - crossings[0]) * dt_s);
    // The trapezoidal rule is slow by (w dt)^2/12: 1e-4 here.
    assert!(
        (found_hz / expected_hz - 1.0).abs() < 2e-4,
        "{found_hz} Hz, expected {expected_hz}"
    );
}

/// Momentum and energy of carriage and load without friction and drive.
fn balance(carriage: &Carriage<f64>, state: &CarriageState<f64>) -> (f64, f64) {
    let (load, mass_kg) = carriage.load();
    let load = load.unwrap();
    let (v1, v2) = (
        state.velocity_m_per_s,
        state.velocity_m_per_s - state.load.faster_m_per_s,
    );
    let pressed = (state.load.ahead_m.abs() - 0.5 * load.gap_m).max(0.0);
    let momentum = mass_kg * v1 + load.load_mass_kg * v2;
    let energy = 0.5 * mass_kg * v1 * v1
        + 0.5 * load.load_mass_kg * v2 * v2
        + 0.5 * load.stiffness_n_per_m * pressed * pressed;
    (momentum, energy)
}

#[test]
fn prop_contact_keeps_momentum_and_never_gives_energy() {
    for (stiffness, damping, gap_m) in [
        (2e5, 0.0, 1.2e-3),
        (1e6, 0.0, 20e-6),
        (1e8, 0.0, 1e-4),
        (1e6, 500.0, 1e-3),
        (2e5, 0.0, 0.0),
        (1e5, 3000.0, 5e-6),
    ] {
        for dt_s in [1e-3, 2.5e-4, 3e-5] {
            let loaded = with(|e| e.load = load(0.7, stiffness, damping, gap_m));
            let (carriage, none) = frictionless(loaded);
            let mut state = CarriageState::new(0.0, 0.3);
            state.load.faster_m_per_s = 0.5;
            let (momentum, mut energy) = balance(&carriage, &state);
            for _ in 0..20_000 {
                carriage.step(&mut state, &none, 0.0, dt_s);
                let (now, left) = balance(&carriage, &state);
                let case = format!("k {stiffness}, d {damping}, gap {gap_m}, dt {dt_s}");
                // The least friction level takes 1e-6 N.
                assert!((now - momentum).abs() < 1e-4, "{case}: momentum {now}");
                assert!(
                    left <= energy * (1.0 + 1e-9),
                    "{case}: {left} over {energy}"
                );
                energy = left;
            }
        }
    }
}

/// Share of the energy that one passage through contact takes by the scheme.
fn taken_by_a_bounce(dt_s: f64) -> f64 {
    let (carriage, none) = frictionless(with(|e| e.load = load(0.7, 2e5, 0.0, 2e-3)));
    let mut state = CarriageState::new(0.0, 0.0);
    state.load.faster_m_per_s = 0.5;
    let (_, before) = balance(&carriage, &state);
    while state.load.faster_m_per_s > 0.0 || state.load.ahead_m > 0.0 {
        carriage.step(&mut state, &none, 0.0, dt_s);
    }
    1.0 - balance(&carriage, &state).1 / before
}

#[test]
fn val_a_bounce_takes_less_energy_with_the_step_squared() {
    // The phase of the steps against the contact decides too: the mean of many.
    let mean = |dt_s: f64| {
        let cases = (0..40_u32).map(|k| taken_by_a_bounce(dt_s * (1.0 + 1e-3 * f64::from(k))));
        cases.sum::<f64>() / 40.0
    };
    let (coarse, fine) = (mean(2e-4), mean(5e-5));
    println!("a bounce takes {coarse:.2e} at 0.2 ms, {fine:.2e} at 0.05 ms");
    assert!(coarse > 0.0 && coarse < 0.02);
    let order = (coarse / fine).log2() / 2.0;
    assert!((1.5..2.5).contains(&order), "order {order}");
}

#[test]
fn val_a_stiff_coupling_is_a_rigid_mass() {
    let stiff = with(|e| e.load = load(0.9, 1e8, 1e4, 0.0));
    let (rigid, loaded) = (carriage::<f64>(None), stiff);
    let ends = [rigid, loaded].map(|one| run(&one, 1.0, 1e-4).pop().unwrap());
    let apart = ends[0].position_m.value - ends[1].position_m.value;
    assert!(apart.abs() < 1e-4, "{apart} m apart");
}

/// Mass and velocity have the middle rule, which a stiff bristle could make ring.
#[test]
fn prop_a_carriage_that_sticks_is_at_rest_after_20_steps() {
    let levels = paper::friction_levels::<f32>();
    // Heavier ones ring by nature: 30 kg on this bristle have a damping ratio of 0.13.
    for mass_kg in [0.3_f32, 1.0, 3.0] {
        let mut carriage = carriage::<f32>(None);
        carriage.mass_kg = mass_kg;
        // It comes to rest out of 1 mm/s, held by 10 N of a drive below stiction.
        let mut state = CarriageState::new(0.0, 1e-3);
        for _ in 0..2000 {
            carriage.step(&mut state, &levels, 10.0, 1e-3);
        }
        state.velocity_m_per_s += 1e-3;
        let from_m = state.position_m.value;
        for _ in 0..20 {
            carriage.step(&mut state, &levels, 10.0, 1e-3);
        }
        let (v, way_m) = (state.velocity_m_per_s, state.position_m.value - from_m);
        assert!(v.abs() < 3e-5, "{mass_kg} kg: {v} m/s");
        assert!(way_m.abs() < 1e-5, "{mass_kg} kg: {way_m} m");
    }
}

/// The place after 0.2 s under a smooth drive without stops, less that of very short steps, m, for
/// steps of 0.8 ms and shorter.
fn errors_of_steps(carriage: &Carriage<f64>) -> [f64; 5] {
    let end = |dt_s: f64| {
        let levels = paper::friction_levels::<f64>();
        let mut state = CarriageState::new(0.0, 0.0);
        for step in 0..(0.2 / dt_s).round() as u32 {
            let drive = 90.0 * (TAU * 2.0 * (f64::from(step) + 0.5) * dt_s).sin();
            carriage.step(&mut state, &levels, drive, dt_s);
        }
        state.position_m.value
    };
    let exact = end(1e-6);
    let errors = [8e-4, 4e-4, 2e-4, 1e-4, 5e-5].map(|dt_s| (end(dt_s) - exact).abs());
    println!("errors {errors:?}");
    errors
}

#[test]
fn val_steps_converge_with_a_force_equation() {
    let errors = errors_of_steps(&with(|effects| effects.force_equation = equation()));
    assert!(errors[0] < 1.2e-6, "{} m at 0.8 ms", errors[0]);
    assert!(errors[4] < errors[0] / 150.0);
}

#[test]
fn val_steps_converge_with_every_effect() {
    // Contact of load and buffers comes within steps.
    let errors = errors_of_steps(&with(|effects| {
        everything(effects);
        effects.force_equation = ForceEquation::neutral();
    }));
    // Where in a step the play closes is as good as drawn by lot: less than order 2 is seen,
    // and more than the factor of 16 that order 1 gives. The zone's borders double the error.
    assert!(errors[0] < 3e-6, "{} m at 0.8 ms", errors[0]);
    assert!(errors[4] < errors[0] / 30.0);
}

/// A frictionless carriage with a force equation.
fn under(equation: ForceEquation<f64>) -> (Carriage<f64>, FrictionLevels<f64>) {
    frictionless(with(|effects| effects.force_equation = equation))
}

/// On its spring it swings with the period 2 pi sqrt(m / k) about the rest.
#[test]
fn val_a_spring_s_period_is_that_of_its_mass() {
    let (carriage, levels) = under(ForceEquation {
        spring_n_per_m: 200.0,
        rest_m: 0.05,
        ..ForceEquation::neutral()
    });
    let period_s = TAU * (carriage.mass_kg / 200.0).sqrt();
    let mut state = CarriageState::new(0.15, 0.0);
    let dt_s = period_s / 4000.0;
    for _ in 0..2000 {
        carriage.step(&mut state, &levels, 0.0, dt_s);
    }
    assert!((state.position_m.value + 0.05).abs() < 1e-4, "{state:?}");
    assert!(state.velocity_m_per_s.abs() < 1e-3, "{state:?}");
}

/// Under a constant force it nears sqrt(F / d) as v = v1 tanh(t v1 d / m), in steps of a
/// millisecond and of many times its time constant.
#[test]
fn val_drag_ends_at_its_terminal_speed() {
    let (carriage, levels) = under(ForceEquation {
        drag_n_s2_per_m2: 40.0,
        ..ForceEquation::neutral()
    });
    let mut state = CarriageState::new(0.0, 0.0);
    for step in 1..=1000 {
        carriage.step(&mut state, &levels, 10.0, 1e-4);
        if step == 500 {
            let expected = 0.5 * (0.05 * 0.5 * 40.0 / carriage.mass_kg).tanh();
            assert!(
                (state.velocity_m_per_s - expected).abs() < 1e-3,
                "{state:?}"
            );
        }
    }
    let mut state = CarriageState::new(0.0, 300.0);
    for _ in 0..2000 {
        carriage.step(&mut state, &levels, 10.0, 1e-2);
        assert!(state.velocity_m_per_s.abs() <= 300.0);
    }
    assert!((state.velocity_m_per_s - 0.5).abs() < 1e-3, "{state:?}");
}

/// What trails is pulled along: a carriage that is pushed once comes to rest short of where it
/// stood, and the work that is missing went into the way there and back.
#[test]
fn prop_what_trails_takes_energy() {
    let (carriage, levels) = under(ForceEquation {
        trailing_n: 5.0,
        path_m: 0.01,
        spring_n_per_m: 100.0,
        ..ForceEquation::neutral()
    });
    let mut state = CarriageState::new(0.2, 0.0);
    let mut highest_j = f64::INFINITY;
    for round in 0..40 {
        let mut most_j = 0.0_f64;
        for _ in 0..500 {
            carriage.step(&mut state, &levels, 0.0, 1e-3);
            let speed = state.velocity_m_per_s;
            let of_spring_j = 50.0 * state.position_m.value.powi(2);
            most_j = most_j.max(0.5 * carriage.mass_kg * speed * speed + of_spring_j);
        }
        assert!(
            most_j <= highest_j * 1.001 || most_j < 0.05,
            "{most_j} J in round {round}"
        );
        highest_j = most_j;
    }
    assert!(highest_j < 0.1, "{highest_j} J are left");
}

fn everything<R: Real>(effects: &mut CarriageEffects<R>) {
    let number = R::from_f64;
    effects.position_friction = PositionDependentFriction {
        cosine: number(0.2),
        sine: number(-0.15),
        wavelength_m: number(0.07),
        slope_per_m: number(0.4),
        curvature_per_m2: number(2.0),
        zone: FrictionZone {
            share: number(0.3),
            middle_m: number(0.02),
            length_m: number(0.1),
        },
    };
    effects.direction_friction = DirectionDependentFriction {
        asymmetry: number(0.15),
        viscous_asymmetry: number(-0.1),
    };
    effects.dwell_stiction = DwellStiction {
        rise_n: number(20.0),
        time_constant_s: number(0.3),
        forgetting_way_m: number(5e-5),
    };
    effects.load = load(0.6, 2e5, 120.0, 2e-4);
    effects.elastic_buffer = buffers(0.03, 2e4, 80.0);
    effects.unknown_force.over = ForceVariable::Velocity;
    effects.unknown_force.at_knot_n[5] = R::from_f64(2.0);
    effects.force_equation = equation();
}

fn equation<R: Real>() -> ForceEquation<R> {
    let number = R::from_f64;
    ForceEquation {
        spring_n_per_m: number(150.0),
        stiffening_n_per_m3: number(2e4),
        rest_m: number(0.01),
        drag_n_s2_per_m2: number(30.0),
        sine_n: number(3.0),
        cosine_n: number(-2.0),
        pitch_m: number(0.05),
        trailing_n: number(6.0),
        path_m: number(0.01),
    }
}

/// Largest friction while the force rises slowly after a dwell, the age of the
/// contact then, and the way from there to where friction is back to within 5 %
/// of the Coulomb level.
fn break_away(dwell_s: f64, static_n: f64, stiction: DwellStiction<f64>) -> [f64; 3] {
    let carriage = with(|effects| effects.dwell_stiction = stiction);
    let levels = FrictionLevels {
        viscous_n_s_per_m: 0.0,
        static_n,
        ..paper::friction_levels::<f64>()
    };
    let dt_s = 1e-4;
    let mut state = CarriageState::new(0.0, 0.0);
    let dwell_steps = (dwell_s / dt_s).round() as u32;
    let (mut peak, mut age, mut at_peak) = (0.0, 0.0, 0.0);
    for step in 0..dwell_steps + 100_000 {
        let ramp = 20.0 * dt_s * f64::from(step.saturating_sub(dwell_steps));
        carriage.step(&mut state, &levels, ramp, dt_s);
        if state.friction_n > peak {
            (peak, age, at_peak) = (state.friction_n, state.contact_age, state.position_m.value);
        }
        let slid = state.position_m.value - at_peak;
        if slid > 1e-6 && state.friction_n < 1.05 * levels.coulomb_n {
            return [peak, age, slid];
        }
    }
    panic!("it never breaks away");
}

#[test]
fn val_break_away_force_grows_with_the_dwell() {
    let stiction = DwellStiction {
        rise_n: 45.0,
        time_constant_s: 20.0,
        forgetting_way_m: 5e-5,
    };
    let [plain, ..] = break_away(0.0, paper::STATIC_N, DwellStiction::neutral());
    let mut before = plain;
    for dwell_s in [0.0, 5.0, 20.0, 100.0] {
        let [peak, age, slid] = break_away(dwell_s, paper::STATIC_N, stiction);
        // The seal ages on while the force rises by 20 N/s; the bristle's creep on
        // the way to break-away takes some of it.
        let stood_s = dwell_s + peak / 20.0;
        let grown = 1.0 - (-stood_s / stiction.time_constant_s).exp();
        let level = paper::STATIC_N + stiction.rise_n * grown;
        let left = paper::STATIC_N + stiction.rise_n * age;
        println!(
            "{dwell_s} s: {peak:.2} N, grown to {level:.2} N, {left:.2} N left at the peak, gone after {slid:.2e} m"
        );
        assert!(age < grown && peak < level, "after {dwell_s} s");
        assert!(
            peak > before,
            "{peak} N after {dwell_s} s, {before} N before"
        );
        assert!(slid < 2.5e-4, "gone after {slid} m only");
        before = peak;
    }
}

#[test]
fn val_friction_over_a_pass_follows_the_wave() {
    let mut carriage = with(|effects| {
        effects.position_friction.cosine = 0.3;
        effects.position_friction.wavelength_m = 0.05;
    });
    // So heavy that its speed stays.
    carriage.mass_kg = 1e6;
    let levels = paper::friction_levels::<f64>();
    let speed = 0.05;
    let mut state = CarriageState::new(-0.1, speed);
    for step in 0..40_000_u32 {
        carriage.step(&mut state, &levels, 0.0, 1e-4);
        if step < 100 {
            continue;
        }
        let angle = TAU * state.position_m.value / 0.05;
        let expected = paper::COULOMB_N * (1.0 + 0.3 * angle.cos()) + 64.5 * speed;
        assert!(
            (state.friction_n - expected).abs() < 0.05,
            "{} N at {} m, expected {expected}",
            state.friction_n,
            state.position_m.value
        );
    }
}

#[test]
fn val_buffers_carry_the_drive_at_rest_and_give_no_energy() {
    let buffered = with(|effects| effects.elastic_buffer = buffers(0.01, 1e5, 50.0));
    let levels = paper::friction_levels::<f64>();
    let mut state = CarriageState::new(0.0, 0.5);
    for _ in 0..20_000 {
        buffered.step(&mut state, &levels, 200.0, 1e-3);
    }
    let depth = state.position_m.value - 0.01;
    // Friction holds some of the drive.
    assert!((depth - 2e-3).abs() < paper::STATIC_N / 1e5, "{depth}");
    for stiffness in [1e4, 1e6, 1e8] {
        let buffered = with(|effects| effects.elastic_buffer = buffers(0.01, stiffness, 0.0));
        let (free, none) = frictionless(buffered);
        let mut state = CarriageState::new(0.0, 0.5);
        for _ in 0..2000 {
            free.step(&mut state, &none, 0.0, 1e-3);
            assert!(state.velocity_m_per_s.abs() <= 0.5 * (1.0 + 1e-9));
        }
    }
}

/// A function that names one parameter of the effects.
type Parameter<R> = fn(&mut CarriageEffects<R>) -> &mut R;

fn parameters<R: Real>() -> [Parameter<R>; 25] {
    [
        |e| &mut e.position_friction.cosine,
        |e| &mut e.position_friction.sine,
        |e| &mut e.position_friction.wavelength_m,
        |e| &mut e.position_friction.slope_per_m,
        |e| &mut e.position_friction.curvature_per_m2,
        |e| &mut e.direction_friction.asymmetry,
        |e| &mut e.direction_friction.viscous_asymmetry,
        |e| &mut e.dwell_stiction.rise_n,
        |e| &mut e.dwell_stiction.time_constant_s,
        |e| &mut e.load.load_mass_kg,
        |e| &mut e.load.stiffness_n_per_m,
        |e| &mut e.load.damping_n_s_per_m,
        |e| &mut e.load.gap_m,
        |e| &mut e.elastic_buffer.stiffness_n_per_m,
        |e| &mut e.elastic_buffer.damping_n_s_per_m,
        |e| &mut e.unknown_force.at_knot_n[5],
        |e| &mut e.force_equation.spring_n_per_m,
        |e| &mut e.force_equation.stiffening_n_per_m3,
        |e| &mut e.force_equation.rest_m,
        |e| &mut e.force_equation.drag_n_s2_per_m2,
        |e| &mut e.force_equation.sine_n,
        |e| &mut e.force_equation.cosine_n,
        |e| &mut e.force_equation.pitch_m,
        |e| &mut e.force_equation.trailing_n,
        |e| &mut e.force_equation.path_m,
    ]
}

#[test]
fn val_derivatives_agree_with_differences() {
    let end = |states: Vec<CarriageState<f64>>| states.last().unwrap().velocity_m_per_s;
    for (index, (dual, wide)) in parameters().into_iter().zip(parameters()).enumerate() {
        let mut effects = CarriageEffects::<Dual<1>>::neutral();
        everything(&mut effects);
        let slot = dual(&mut effects);
        let value = slot.value;
        *slot = Dual::parameter(value, 0);
        let states = run(&carriage(Some(effects)), 0.3, 5e-4);
        let exact = states.last().unwrap().velocity_m_per_s.gradient[0] * value;
        let at = |factor: f64| {
            let mut effects = CarriageEffects::<f64>::neutral();
            everything(&mut effects);
            *wide(&mut effects) *= factor;
            end(run(&carriage(Some(effects)), 0.3, 5e-4))
        };
        let by_difference = (at(1.0 + 1e-7) - at(1.0 - 1e-7)) / 2e-7;
        println!("{index}: {exact:e} {by_difference:e}");
        assert!(exact.abs() > 1e-9, "parameter {index} changes nothing");
        assert!(
            (exact - by_difference).abs() < 1e-4 * exact.abs() + 1e-7,
            "parameter {index}: {exact:e}, by differences {by_difference:e}"
        );
    }
}

#[test]
fn prop_a_dual_at_a_neutral_value_has_its_derivative() {
    let mut effects = CarriageEffects::<Dual<1>>::neutral();
    effects.position_friction.cosine = Dual::parameter(0.0, 0);
    let effects = effects.if_any();
    assert!(effects.is_some());
    let states = run(&carriage(effects), 0.1, 1e-3);
    assert!(states.last().unwrap().velocity_m_per_s.gradient[0].abs() > 1e-6);
}
