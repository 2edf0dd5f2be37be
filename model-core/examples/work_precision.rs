//! What the axis' step needs for an accuracy, beside a general stiff solver:
//! `work_precision SCENARIO REFERENCE_FILE` writes one line per step size, with the steps per
//! millisecond, the largest error of the position in m and the best time in s. The reference
//! and the solver are `tests/baselines/work_precision`.

use model_core::axis::{Axis, AxisInputs, AxisState};
use model_core::paper;
use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

const START_PA: f64 = 5.25e5;
const REPETITIONS: u32 = 15;

/// A scenario of `cvode.c`.
#[derive(Clone, Copy, PartialEq)]
enum Scenario {
    /// To 4 V, held.
    Step,
    /// A sine, held over every millisecond.
    Held,
    /// The sine itself.
    Smooth,
}

fn wave_v(time_s: f64) -> f64 {
    paper::NULL_V + 0.9 * (TAU * time_s).sin()
}

/// Positions at every millisecond.
fn run(scenario: Scenario, rows: usize, steps_per_ms: u32) -> Vec<f64> {
    let axis = Axis {
        dt_s: 1e-3 / f64::from(steps_per_ms),
        ..paper::axis::<f64>()
    };
    let start_m = if scenario == Scenario::Step {
        0.18
    } else {
        -0.05
    };
    let kelvin = paper::AMBIENT_TEMPERATURE_K;
    let mut state = AxisState::at_rest(start_m, START_PA, START_PA, kelvin, paper::NULL_V);
    let mut positions_m = Vec::with_capacity(rows);
    for row in 0..rows {
        let begin_s = 1e-3 * row as f64;
        for step in 0..steps_per_ms {
            let command_v = match scenario {
                Scenario::Step => 4.0,
                Scenario::Held => wave_v(begin_s),
                Scenario::Smooth => wave_v(begin_s + (f64::from(step) + 0.5) * axis.dt_s),
            };
            let inputs = AxisInputs {
                command_v,
                supply_pressure_pa: paper::SUPPLY_PRESSURE_PA,
            };
            axis.step(&mut state, &inputs);
        }
        positions_m.push(state.carriage.position_m.value);
    }
    positions_m
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().collect();
    let [_, scenario, reference] = words.as_slice() else {
        return Err("work_precision SCENARIO REFERENCE_FILE".into());
    };
    let scenario = match scenario.as_str() {
        "step" => Scenario::Step,
        "held" => Scenario::Held,
        "smooth" => Scenario::Smooth,
        other => return Err(format!("no scenario {other}").into()),
    };
    let text = std::fs::read_to_string(reference)?;
    let exact: Vec<f64> = text.lines().map(str::parse).collect::<Result<_, _>>()?;
    for steps_per_ms in [1, 2, 3, 4, 6, 8, 12, 16, 24, 32] {
        let mut best_s = f64::INFINITY;
        let mut found = Vec::new();
        for _ in 0..REPETITIONS {
            let begin = Instant::now();
            found = black_box(run(scenario, exact.len(), steps_per_ms));
            best_s = best_s.min(begin.elapsed().as_secs_f64());
        }
        let pairs = found.iter().zip(&exact);
        let error_m = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        println!("{steps_per_ms} {error_m:.3e} {best_s:.6e}");
    }
    Ok(())
}
