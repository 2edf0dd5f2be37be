//! The laws with a plant's true parameters must predict its recordings to the
//! noise of the sensors.
//!
//! Practice case p01 is a simulated plant without any left-out effect, made by
//! another program (its own integrator, its own sensor models); its true
//! parameters stand beside the recordings. What is left after putting them in
//! is noise, quantisation and the error of our own schemes.
//!
//! The recordings are not part of the repository; where they are missing the test says so and
//! passes ([`tests::recordings`]).

#![expect(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use host_sim::fit::law_problem::LawProblem;
use host_sim::fit::{Options, solve};
use host_sim::laws::{Law, Track, View};
use host_sim::model::Values;
use host_sim::recording::Recording;
use host_sim::rig::Rig;
use std::path::Path;
use tests::rms;

const RECORDINGS: [&str; 6] = [
    "train-1", "train-2", "train-3", "train-4", "held-1", "held-2",
];

/// The rig's declared tables are the true ones, falsified by these factors:
/// stretch of the openings, scale of the supply and of the exhaust areas.
const DECLARED_OVER_TRUE: [(&str, f64); 3] = [
    ("valve.opening_V", 0.935),
    ("valve.supply_area_m2", 0.99535),
    ("valve.exhaust_area_m2", 0.955_097),
];

/// What the pressure sensor adds: 250 Pa of noise, and 244 Pa / sqrt(12) by
/// quantisation.
const SENSOR_PA: f64 = 259.7;
/// Rms error of a pressure. Measured 255-268 Pa: the sensor, and at the worst
/// 66 Pa beside it. Much under the sensor's own error it would be no law.
const PRESSURE_ERROR_PA: [f64; 2] = [250.0, 280.0];

/// Rms error of the position in windows, twice the 64 um measured: it comes
/// from the noise of the velocity that a window starts with (0.5 mm/s) and of
/// the pressures (0.17 N).
const WINDOW_ERROR_M: f64 = 0.12e-3;
/// Largest error of the position over a whole recording of 6-10 s (measured:
/// 0.45 mm): the recorded pressures'
/// noise, 0.17 N a sample, walks to 0.17 N / 70 N s/m * 1 ms * sqrt(10000) = 0.24 mm.
/// (With the step of second order 0.27 to 0.56 mm in the four runs, over six seconds.)
const WHOLE_ERROR_M: f64 = 0.6e-3;

/// Median error of the balance while sliding, N. The pressures' noise is 0.18 N a sample and 0.04 N
/// rms under the bump, of which the median is 0.67.
const BALANCE_ERROR_N: f64 = 0.04;

/// Where the true value of a rig's key stands in `truth.json`.
const TRUE_NAMES: [(&str, &str); 12] = [
    ("carriage.mass_kg", "M"),
    ("cylinder.dead_volume_a_m3", "V0a"),
    ("cylinder.dead_volume_b_m3", "V0b"),
    ("supply.pressure_Pa", "ps"),
    ("valve.null_V", "null"),
    ("friction.coulomb_N", "FC"),
    ("friction.static_N", "FS"),
    ("friction.viscous_Ns_m", "s2"),
    ("friction.stribeck_velocity_m_s", "vs"),
    ("chambers.heat_transfer_charging_W_m2K", "hc"),
    ("chambers.heat_transfer_discharging_W_m2K", "hd"),
    ("valve.critical_pressure_ratio", "b"),
];

/// The rig of the case with the plant's true values, the supply constant at its
/// true pressure.
fn true_rig(folder: &Path) -> Rig {
    let mut rig = Rig::read(folder.join("rig.toml")).unwrap();
    let text = std::fs::read_to_string(folder.join("truth.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_str(&text).unwrap();
    for (key, name) in TRUE_NAMES {
        let value = truth["plant"][name].as_f64().unwrap();
        rig.set_value(key, value).unwrap();
    }
    for (key, factor) in DECLARED_OVER_TRUE {
        rig.set_value(key, 1.0 / factor).unwrap();
    }
    // The laws take the supply from the recording where the rig records it; the
    // sensor's noise would then enter through the valve.
    rig.signals.by_name.remove("p_s");
    rig
}

fn recordings(folder: &Path, rig: &Rig) -> Vec<Recording> {
    RECORDINGS
        .iter()
        .map(|name| Recording::read(folder.join(format!("{name}.csv")), &rig.signals).unwrap())
        .collect()
}

#[test]
fn val_chambers_predict_the_practice_plant_to_its_noise() {
    let Some(folder) = tests::recordings("practice/p01") else {
        return;
    };
    let rig = true_rig(&folder);
    for recording in recordings(&folder, &rig) {
        for (signal, error_pa) in pressure_errors(&rig, &recording) {
            println!("{} {signal}: {error_pa:.1} Pa rms", recording.name);
            let [least, most] = PRESSURE_ERROR_PA;
            assert!((least..most).contains(&error_pa));
        }
    }
}

/// A law with the rig's values and nothing to fit but initial states.
fn unfitted<'a>(
    law: Law,
    rig: &'a Rig,
    tracks: &'a [Track<'a>],
    sigma: &'a [f64],
) -> LawProblem<'a> {
    LawProblem {
        law,
        rig,
        tracks,
        free: &[],
        sigma,
        left_out: None,
        presence: None,
    }
}

/// Rms error of each pressure, free-running over the whole recording from
/// estimated initial states.
fn pressure_errors(rig: &Rig, recording: &Recording) -> Vec<(&'static str, f64)> {
    let tracks = [Track::new(recording)];
    let mut problem = unfitted(Law::Chambers, rig, &tracks, &[SENSOR_PA, SENSOR_PA]);
    let parameters = problem.parameters();
    let fit = solve(&mut problem, &parameters, &Options::default()).unwrap();
    assert!(fit.converged.is_converged());
    let predicted = &problem.predict(&fit.values)[0].0;
    let outputs = problem.law.outputs(rig);
    outputs
        .iter()
        .zip(predicted.iter().zip(problem.recorded(0)))
        .map(|(output, (predicted, recorded))| {
            let errors = predicted.iter().zip(recorded).map(|(p, r)| p - r);
            (output.signal, rms(errors))
        })
        .collect()
}

#[test]
fn val_carriage_predicts_the_practice_plant() {
    let Some(folder) = tests::recordings("practice/p01") else {
        return;
    };
    let rig = true_rig(&folder);
    for recording in recordings(&folder, &rig) {
        let windows_m = window_error_m(&rig, &recording);
        let whole_m = farthest_error_m(&rig, &recording);
        println!(
            "{}: {:.1} um rms in windows, {:.0} um at the most over the whole",
            recording.name,
            windows_m * 1e6,
            whole_m * 1e6
        );
        assert!(windows_m < WINDOW_ERROR_M);
        assert!(whole_m < WHOLE_ERROR_M);
    }
}

#[test]
fn val_balance_of_the_practice_plant_closes_to_its_noise() {
    let Some(folder) = tests::recordings("practice/p01") else {
        return;
    };
    let rig = true_rig(&folder);
    for recording in recordings(&folder, &rig) {
        let tracks = [Track::new(&recording)];
        let problem = unfitted(Law::Balance, &rig, &tracks, &[1.0; 3]);
        let sliding_n = &problem.predict(&[])[0].0[0];
        let mut errors_n: Vec<f64> = sliding_n.iter().map(|error| error.abs()).collect();
        errors_n.retain(|error| error.is_finite());
        let middle = errors_n.len() / 2;
        let (_, &mut error_n, _) = errors_n.select_nth_unstable_by(middle, f64::total_cmp);
        println!(
            "{}: {error_n:.4} N, the median while sliding",
            recording.name
        );
        assert!(error_n < BALANCE_ERROR_N);
    }
}

/// Rms error of the position in windows of 0.25 s, each from states that are
/// estimated at its start.
fn window_error_m(rig: &Rig, recording: &Recording) -> f64 {
    let tracks = [Track::new(recording)];
    let problem = unfitted(Law::Carriage, rig, &tracks, &[1.0]);
    let predicted = &problem.predict(&[])[0].0[0];
    let errors = predicted.iter().zip(problem.recorded(0)[0]);
    rms(errors
        .map(|(predicted, recorded)| predicted - recorded)
        .filter(|error| error.is_finite()))
}

/// Largest error of the position over the whole recording in one run.
fn farthest_error_m(rig: &Rig, recording: &Recording) -> f64 {
    let states = Law::Carriage.initial_states(rig, recording, 0, View::Centred);
    let initial: Vec<f64> = states.iter().map(|state| state.guess).collect();
    let values = Values {
        rig,
        keys: &[],
        replaced: &[],
    };
    let position_m = recording.signal("x").unwrap();
    let mut farthest = 0.0_f64;
    let mut sink = |row: usize, outputs: &[f64], _: &[f64]| {
        farthest = farthest.max((outputs[0] - position_m[row]).abs());
    };
    let track = Track::new(recording);
    Law::Carriage.predict(&values, &track, 0..recording.len(), &initial, &mut sink);
    farthest
}
