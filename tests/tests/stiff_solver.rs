//! The step schemes of `model-core` against an independent stiff solver.
//!
//! The equations (1)-(5) and (8)-(10) of Meng and others are written here a
//! second time, as the paper's continuous differential equations, without a
//! function of `model-core` (only its parameter values), and integrated by
//! diffsol with tight tolerances. Two independent methods of diffsol must agree
//! far below the errors that are measured with them.
//!
//! The model holds its inputs over each step. A command or force that varies
//! is therefore given to it as its value in the middle of the step, the mean of
//! a smooth signal to second order; what remains is the scheme's own error.

#![expect(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use diffsol::{MatrixCommon, NalgebraLU, NalgebraMat, OdeBuilder, OdeSolverMethod};
use model_core::axis::{Axis, AxisInputs, AxisState, PneumaticState, ValveDrive};
use model_core::carriage::CarriageState;
use model_core::paper;
use model_core::valve::GasState;
use std::f64::consts::{PI, TAU};

const SUPPLY_PA: f64 = paper::SUPPLY_PRESSURE_PA;
const AMBIENT_PA: f64 = paper::AMBIENT_PRESSURE_PA;
const AMBIENT_K: f64 = paper::AMBIENT_TEMPERATURE_K;
const GAMMA: f64 = 1.4;
const GAS_CONSTANT: f64 = 287.0;
/// Where both chambers start: 3/4 of the supply, where the valve's leakage
/// paths about balance each other.
const START_PA: f64 = 5.25e5;

/// Tolerances of the reference: relative, and absolute per kind of state (Pa, K,
/// m, m/s, m). Three and more orders below the errors measured with it.
const RELATIVE_TOLERANCE: f64 = 1e-9;
const PRESSURE_TOLERANCE_PA: f64 = 1e-3;
const TEMPERATURE_TOLERANCE_K: f64 = 1e-6;
const POSITION_TOLERANCE_M: f64 = 1e-10;
const VELOCITY_TOLERANCE_M_PER_S: f64 = 1e-8;
const DEFLECTION_TOLERANCE_M: f64 = 1e-13;

// ---- the paper's equations, once more ----

/// (1) and (2): flow from a gas at (pressure, temperature) into another.
fn orifice_kg_per_s(area_m2: f64, from: (f64, f64), into: (f64, f64)) -> f64 {
    if from.0 < into.0 {
        return -orifice_kg_per_s(area_m2, into, from);
    }
    let (b, lambda) = (
        paper::CRITICAL_PRESSURE_RATIO,
        paper::LAMINAR_PRESSURE_RATIO,
    );
    let r = into.0 / from.0;
    let ellipse = |r: f64| (1.0 - ((r - b) / (1.0 - b)).powi(2)).sqrt();
    let psi = match r {
        r if r <= b => 1.0,
        r if r < lambda => ellipse(r),
        r => (1.0 - r) / (1.0 - lambda) * ellipse(lambda),
    };
    let cd = 0.8153 + 0.0933 * r - 0.1038 * r * r;
    let critical = (2.0 / (GAMMA + 1.0)).powf((GAMMA + 1.0) / (GAMMA - 1.0));
    let c1 = (GAMMA / GAS_CONSTANT * critical).sqrt();
    area_m2 * cd * c1 * from.0 / from.1.sqrt() * psi
}

/// Area of a path opened by this much, V: the three points of the paper's table.
fn area_m2(opening_v: f64) -> f64 {
    let [_, overlap_v, full_v] = paper::OPENING_V;
    let [leak_m2, _, full_m2] = paper::AREA_M2;
    let share = ((opening_v - overlap_v) / (full_v - overlap_v)).clamp(0.0, 1.0);
    leak_m2 + share * (full_m2 - leak_m2)
}

/// (3)-(5): pressure and temperature rates of a chamber of length `length_m`
/// growing at `growth_m_per_s`, its ports opened by this much towards filling.
fn chamber_rates(
    pressure_pa: f64,
    temperature_k: f64,
    length_m: f64,
    growth_m_per_s: f64,
    opening_v: f64,
) -> (f64, f64) {
    let (p, t) = (pressure_pa, temperature_k);
    let volume = paper::DEAD_VOLUME_M3 + paper::PISTON_AREA_M2 * length_m;
    let volume_rate = paper::PISTON_AREA_M2 * growth_m_per_s;
    let surface = 2.0 * paper::PISTON_AREA_M2 + PI * paper::BORE_M * length_m;
    let filling = orifice_kg_per_s(area_m2(opening_v), (SUPPLY_PA, AMBIENT_K), (p, t));
    let emptying = orifice_kg_per_s(area_m2(-opening_v), (p, t), (AMBIENT_PA, AMBIENT_K));
    // A path that runs backwards (pressure above the supply or below ambient)
    // changes sides in the balance.
    let m_in = filling.max(0.0) + (-emptying).max(0.0);
    let m_out = emptying.max(0.0) + (-filling).max(0.0);
    let h = if m_in >= m_out {
        paper::HEAT_TRANSFER_CHARGING_W_PER_M2_K
    } else {
        paper::HEAT_TRANSFER_DISCHARGING_W_PER_M2_K
    };
    let heat = h * surface * (AMBIENT_K - t);
    let pressure_rate = (-GAMMA * p * volume_rate
        + GAMMA * GAS_CONSTANT * (m_in * AMBIENT_K - m_out * t)
        + (GAMMA - 1.0) * heat)
        / volume;
    let temperature_rate = (1.0 - GAMMA) * t * volume_rate / volume
        + GAS_CONSTANT * t / (p * volume)
            * (m_in * (GAMMA * AMBIENT_K - t) - m_out * (GAMMA - 1.0) * t)
        + (GAMMA - 1.0) * t / (p * volume) * heat;
    (pressure_rate, temperature_rate)
}

/// (9), (10): friction force and bristle rate.
fn friction(velocity: f64, deflection: f64) -> (f64, f64) {
    let stribeck = (-(velocity / paper::STRIBECK_VELOCITY_M_PER_S).powi(2)).exp();
    let g = paper::COULOMB_N + (paper::STATIC_N - paper::COULOMB_N) * stribeck;
    let rate = velocity - paper::BRISTLE_STIFFNESS_N_PER_M * velocity.abs() / g * deflection;
    let force = paper::BRISTLE_STIFFNESS_N_PER_M * deflection
        + paper::BRISTLE_DAMPING_N_S_PER_M * rate
        + paper::VISCOUS_N_S_PER_M * velocity;
    (force, rate)
}

/// (8) with [x, v, z] under a force without friction.
fn carriage_rates(state: &[f64], drive_n: f64) -> [f64; 3] {
    let (force, deflection_rate) = friction(state[1], state[2]);
    [
        state[1],
        (drive_n - force) / paper::MOVING_MASS_KG,
        deflection_rate,
    ]
}

/// The whole axis: [pa, Ta, pb, Tb, x, v, z].
fn axis_rates(state: &[f64], command_v: f64) -> [f64; 7] {
    let (x, v) = (state[4], state[5]);
    let half = 0.5 * paper::STROKE_M;
    let opening = command_v - paper::NULL_V;
    let (pa, ta) = chamber_rates(state[0], state[1], half + x, v, opening);
    let (pb, tb) = chamber_rates(state[2], state[3], half - x, -v, -opening);
    let drive = (state[0] - state[2]) * paper::PISTON_AREA_M2;
    let [x_rate, v_rate, z_rate] = carriage_rates(&state[4..], drive);
    [pa, ta, pb, tb, x_rate, v_rate, z_rate]
}

// ---- the reference solution ----

/// A differential equation with the sizes and tolerances of its states.
struct Problem<F, const N: usize> {
    rates: F,
    start: [f64; N],
    sizes: [f64; N],
    tolerances: [f64; N],
}

impl<F: Fn(f64, &[f64]) -> [f64; N] + Copy, const N: usize> Problem<F, N> {
    /// Derivative of the rates along a direction, by a central difference: the
    /// solver's Newton iteration needs no more.
    fn directional(&self) -> impl Fn(&[f64], &[f64], f64, &[f64], &mut [f64]) + use<F, N> {
        let (rates, sizes) = (self.rates, self.sizes);
        move |state, _, time, direction, out| {
            let largest = direction
                .iter()
                .zip(sizes)
                .fold(0.0_f64, |most, (d, size)| most.max(d.abs() / size));
            if largest <= 0.0 {
                out.fill(0.0);
                return;
            }
            let step = 1e-6 / largest;
            let shifted = |sign: f64| -> [f64; N] {
                let at: [f64; N] = std::array::from_fn(|i| state[i] + sign * step * direction[i]);
                rates(time, &at)
            };
            let (up, down) = (shifted(1.0), shifted(-1.0));
            for (slot, (up, down)) in out.iter_mut().zip(up.iter().zip(down)) {
                *slot = (up - down) / (2.0 * step);
            }
        }
    }

    /// States at these times, by BDF or by the third-order SDIRK.
    fn solve(&self, times_s: &[f64], by_bdf: bool) -> Vec<[f64; N]> {
        let (rates, start) = (self.rates, self.start);
        let problem = OdeBuilder::<NalgebraMat<f64>>::new()
            .rtol(RELATIVE_TOLERANCE)
            .atol(self.tolerances)
            .h0(1e-6)
            .rhs_implicit(
                move |state, _, time, out| out.copy_from_slice(&rates(time, state)),
                self.directional(),
            )
            .init(move |_, _, state| state.copy_from_slice(&start), N)
            .build()
            .unwrap();
        let (solution, _) = if by_bdf {
            problem
                .bdf::<NalgebraLU<f64>>()
                .unwrap()
                .solve_dense(times_s)
        } else {
            problem
                .esdirk34::<NalgebraLU<f64>>()
                .unwrap()
                .solve_dense(times_s)
        }
        .unwrap();
        let matrix = solution.inner();
        (0..times_s.len())
            .map(|column| std::array::from_fn(|row| matrix[(row, column)]))
            .collect()
    }
}

/// Largest difference per state.
fn largest<const N: usize>(one: &[[f64; N]], other: &[[f64; N]]) -> [f64; N] {
    assert_eq!(one.len(), other.len());
    let mut most = [0.0_f64; N];
    for (a, b) in one.iter().zip(other) {
        for (slot, (a, b)) in most.iter_mut().zip(a.iter().zip(b)) {
            *slot = slot.max((a - b).abs());
        }
    }
    most
}

/// Instants at which solutions are compared: every millisecond.
fn instants(duration_s: f64) -> Vec<f64> {
    (1..=(duration_s * 1e3).round() as u32)
        .map(|step| f64::from(step) * 1e-3)
        .collect()
}

fn axis_problem<F: Fn(f64) -> f64 + Copy>(
    command_v: F,
    position_m: f64,
) -> Problem<impl Fn(f64, &[f64]) -> [f64; 7] + Copy, 7> {
    Problem {
        rates: move |time: f64, state: &[f64]| axis_rates(state, command_v(time)),
        start: [
            START_PA, AMBIENT_K, START_PA, AMBIENT_K, position_m, 0.0, 0.0,
        ],
        sizes: [1e5, 300.0, 1e5, 300.0, 0.1, 0.1, 2e-5],
        tolerances: [
            PRESSURE_TOLERANCE_PA,
            TEMPERATURE_TOLERANCE_K,
            PRESSURE_TOLERANCE_PA,
            TEMPERATURE_TOLERANCE_K,
            POSITION_TOLERANCE_M,
            VELOCITY_TOLERANCE_M_PER_S,
            DEFLECTION_TOLERANCE_M,
        ],
    }
}

/// The model's axis over the same time, every millisecond.
fn axis_run(
    command_v: impl Fn(f64) -> f64,
    position_m: f64,
    duration_s: f64,
    steps_per_ms: u32,
) -> Vec<[f64; 7]> {
    let dt_s = 1e-3 / f64::from(steps_per_ms);
    let axis = Axis {
        dt_s,
        ..paper::axis::<f64>()
    };
    let mut state = AxisState::at_rest(position_m, START_PA, START_PA, AMBIENT_K, command_v(0.0));
    let mut step = 0_u32;
    let mut one_step = || {
        let inputs = AxisInputs {
            command_v: command_v((f64::from(step) + 0.5) * dt_s),
            supply_pressure_pa: SUPPLY_PA,
        };
        axis.step(&mut state, &inputs);
        step += 1;
        [
            state.pneumatics.a.pressure_pa.value,
            state.pneumatics.a.temperature_k.value,
            state.pneumatics.b.pressure_pa.value,
            state.pneumatics.b.temperature_k.value,
            state.carriage.position_m.value,
            state.carriage.velocity_m_per_s,
            state.carriage.deflection_m,
        ]
    };
    sampled(duration_s, steps_per_ms, &mut one_step)
}

/// Bounds on the largest difference from the reference at 1 kHz, per kind of
/// state; at finer steps they shrink by the order of the scheme.
struct Bounds {
    pressure_pa: f64,
    temperature_k: f64,
    position_m: f64,
    velocity_m_per_s: f64,
    deflection_m: f64,
}

/// Twice what was measured on 4 V step and sine: 6.2 Pa, 2.4 mK, 3.1 um, 0.33 mm/s, 0.55 um.
const AXIS_AT_1_KHZ: Bounds = Bounds {
    pressure_pa: 12.5,
    temperature_k: 4.8e-3,
    position_m: 6.1e-6,
    velocity_m_per_s: 0.66e-3,
    deflection_m: 1.1e-6,
};

/// Steps per millisecond with the share of the error that is left. The scheme is of second
/// order where the law is smooth; where valve, heat transfer and flow direction switch
/// within steps, measured shares are 1/4 and 1/13.
const SHARES: [(u32, f64); 3] = [(1, 1.0), (4, 0.25), (16, 0.08)];

/// The two methods of the reference agree this much better than the bounds at the finest
/// step (measured: 17 times).
const REFERENCE_MARGIN: f64 = 4.0;

fn axis_bounds(share: f64) -> [f64; 7] {
    let Bounds {
        pressure_pa: p,
        temperature_k: t,
        position_m: x,
        velocity_m_per_s: v,
        deflection_m: z,
    } = AXIS_AT_1_KHZ;
    [p, t, p, t, x, v, z].map(|bound| bound * share)
}

fn assert_within(what: &str, differences: &[f64], bounds: &[f64]) {
    println!("{what}: {}", shown(differences));
    for (state, (difference, bound)) in differences.iter().zip(bounds).enumerate() {
        assert!(
            difference <= bound,
            "{what}: state {state} differs by {difference:.3e}, admitted {bound:.3e}"
        );
    }
}

fn shown(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|value| format!("{value:.2e}")).collect();
    all.join(" ")
}

/// Runs model and reference over one scenario and holds the differences against
/// the bounds, at 1 kHz and at steps 4 and 16 times finer.
fn compare_axis(
    name: &str,
    command_v: impl Fn(f64) -> f64 + Copy,
    position_m: f64,
    duration_s: f64,
) {
    let times = instants(duration_s);
    let problem = axis_problem(command_v, position_m);
    let reference = problem.solve(&times, true);
    let fastest = reference.iter().fold(0.0_f64, |m, s| m.max(s[5].abs()));
    assert!(
        (0.3..1.0).contains(&fastest),
        "{name}: fastest {fastest} m/s"
    );
    for (steps_per_ms, share) in SHARES {
        let run = axis_run(command_v, position_m, duration_s, steps_per_ms);
        let what = format!("{name} at {steps_per_ms} kHz");
        assert_within(&what, &largest(&reference, &run), &axis_bounds(share));
    }
    let second = problem.solve(&times, false);
    let what = format!("{name}, BDF against SDIRK");
    let agreement = axis_bounds(SHARES[2].1 / REFERENCE_MARGIN);
    assert_within(&what, &largest(&reference, &second), &agreement);
}

#[test]
fn val_axis_follows_the_stiff_solver_through_a_4_v_step() {
    // Figure 14's command, from near the end of the stroke.
    compare_axis("4 V step", |_| 4.0, 0.18, 0.55);
}

#[test]
fn val_axis_follows_the_stiff_solver_through_a_sine() {
    compare_axis(
        "sine",
        |t| paper::NULL_V + 0.9 * (TAU * t).sin(),
        -0.05,
        2.0,
    );
}

/// Twice what was measured on the chambers alone: 34 Pa and 37 mK.
const CHAMBERS_AT_1_KHZ: [f64; 4] = [70.0, 75e-3, 70.0, 75e-3];
/// Motion that drives the chambers alone: 0.1 m at 1.5 Hz, 0.94 m/s.
fn prescribed_position_m(time_s: f64) -> f64 {
    0.1 * (TAU * 1.5 * time_s).sin()
}

fn prescribed_velocity_m_per_s(time_s: f64) -> f64 {
    0.1 * TAU * 1.5 * (TAU * 1.5 * time_s).cos()
}

/// Command that drives the chambers alone, through the dead zone and back and
/// against the motion, so that the compressed chamber exceeds the supply
/// pressure and fills it back.
fn prescribed_command_v(time_s: f64) -> f64 {
    paper::NULL_V + 1.2 * (TAU * 2.0 * time_s).cos()
}

fn chambers_run(duration_s: f64, steps_per_ms: u32) -> Vec<[f64; 4]> {
    let axis = paper::axis::<f64>();
    let dt_s = 1e-3 / f64::from(steps_per_ms);
    let gas = |pressure_pa| GasState {
        pressure_pa,
        temperature_k: AMBIENT_K,
    };
    let mut state = PneumaticState::at_rest(gas(START_PA), gas(START_PA));
    let mut step = 0_u32;
    let mut one_step = || {
        let from_s = f64::from(step) * dt_s;
        step += 1;
        let to_s = f64::from(step) * dt_s;
        let drive = ValveDrive {
            areas: axis
                .valve
                .areas(prescribed_command_v(0.5 * (from_s + to_s))),
            supply: gas(SUPPLY_PA),
        };
        let way = (prescribed_position_m(from_s), prescribed_position_m(to_s));
        axis.pneumatics
            .step(&mut state, Some(&drive), way.0, way.1, dt_s);
        [
            state.a.pressure_pa.value,
            state.a.temperature_k.value,
            state.b.pressure_pa.value,
            state.b.temperature_k.value,
        ]
    };
    sampled(duration_s, steps_per_ms, &mut one_step)
}

/// Every millisecond's state out of so many steps per millisecond.
fn sampled<S>(duration_s: f64, steps_per_ms: u32, one_step: &mut impl FnMut() -> S) -> Vec<S> {
    instants(duration_s)
        .iter()
        .map(|_| {
            for _ in 1..steps_per_ms {
                one_step();
            }
            one_step()
        })
        .collect()
}

fn chamber_reference(times_s: &[f64]) -> Vec<[f64; 4]> {
    let rates = |time: f64, state: &[f64]| {
        let (x, v) = (
            prescribed_position_m(time),
            prescribed_velocity_m_per_s(time),
        );
        let half = 0.5 * paper::STROKE_M;
        let opening = prescribed_command_v(time) - paper::NULL_V;
        let (pa, ta) = chamber_rates(state[0], state[1], half + x, v, opening);
        let (pb, tb) = chamber_rates(state[2], state[3], half - x, -v, -opening);
        [pa, ta, pb, tb]
    };
    let problem = Problem {
        rates,
        start: [START_PA, AMBIENT_K, START_PA, AMBIENT_K],
        sizes: [1e5, 300.0, 1e5, 300.0],
        tolerances: [
            PRESSURE_TOLERANCE_PA,
            TEMPERATURE_TOLERANCE_K,
            PRESSURE_TOLERANCE_PA,
            TEMPERATURE_TOLERANCE_K,
        ],
    };
    problem.solve(times_s, true)
}

#[test]
fn val_chambers_alone_follow_the_stiff_solver() {
    let reference = chamber_reference(&instants(1.0));
    let highest = reference.iter().fold(0.0_f64, |m, s| m.max(s[0].max(s[2])));
    assert!(
        highest > SUPPLY_PA,
        "the scenario no longer reverses a flow"
    );
    for (steps_per_ms, share) in SHARES {
        let run = chambers_run(1.0, steps_per_ms);
        let what = format!("chambers at {steps_per_ms} kHz");
        let bounds = CHAMBERS_AT_1_KHZ.map(|bound| bound * share);
        assert_within(&what, &largest(&reference, &run), &bounds);
    }
}

/// Twice what was measured on the friction alone: 0.77 um, 0.34 mm/s, 0.61 um
/// (the latter while the bristle turns over, within two steps).
const FRICTION_AT_1_KHZ: [f64; 3] = [1.6e-6, 0.7e-3, 1.3e-6];

/// Force that drives friction and mass alone: through stiction both ways, to
/// about 0.75 m/s.
fn prescribed_force_n(time_s: f64) -> f64 {
    70.0 * (TAU * time_s).sin()
}

fn carriage_run(duration_s: f64, steps_per_ms: u32) -> Vec<[f64; 3]> {
    let axis = paper::axis::<f64>();
    let dt_s = 1e-3 / f64::from(steps_per_ms);
    let mut state = CarriageState::new(0.0, 0.0);
    let mut step = 0_u32;
    let mut one_step = || {
        let middle_s = (f64::from(step) + 0.5) * dt_s;
        step += 1;
        let force = prescribed_force_n(middle_s);
        axis.carriage.step(&mut state, &axis.friction, force, dt_s);
        [
            state.position_m.value,
            state.velocity_m_per_s,
            state.deflection_m,
        ]
    };
    sampled(duration_s, steps_per_ms, &mut one_step)
}

#[test]
fn val_friction_alone_follows_the_stiff_solver() {
    let problem = Problem {
        rates: |time: f64, state: &[f64]| carriage_rates(state, prescribed_force_n(time)),
        start: [0.0; 3],
        sizes: [0.1, 0.1, 2e-5],
        tolerances: [
            POSITION_TOLERANCE_M,
            VELOCITY_TOLERANCE_M_PER_S,
            DEFLECTION_TOLERANCE_M,
        ],
    };
    let reference = problem.solve(&instants(2.0), true);
    let fastest = reference.iter().fold(0.0_f64, |m, s| m.max(s[1].abs()));
    assert!((0.5..1.0).contains(&fastest), "fastest {fastest} m/s");
    for (steps_per_ms, share) in SHARES {
        let run = carriage_run(2.0, steps_per_ms);
        let what = format!("friction at {steps_per_ms} kHz");
        let bounds = FRICTION_AT_1_KHZ.map(|bound| bound * share);
        assert_within(&what, &largest(&reference, &run), &bounds);
    }
}
