//! The spool: displacement over command, slowly for gain, null and play, and
//! with sines of four amplitudes (figures 2 and 3 of the seed paper).

use super::axis::STEP_S;
use super::recording::{Channel, Noises, Recording, command_v, rows, time_s};
use super::rig::Rig;
use super::{BenchCase, Setup, truth};
use crate::plant::valve::{CommandPath, CommandState};

/// What the engineer takes for the null.
const NULL_V: f64 = 5.0;
const FULL_V: f64 = 10.0;
/// Rows per second of the slow triangle and of the sines.
const SLOW_ROWS_PER_S: f64 = 1000.0;
const FAST_ROWS_PER_S: f64 = 5000.0;
const TRIANGLE_HZ: f64 = 0.2;
const TRIANGLES: f64 = 2.0;
const REST_S: f64 = 0.1;
const AMPLITUDES_V: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
const FREQUENCIES_HZ: [f64; 9] = [5.0, 10.0, 20.0, 40.0, 60.0, 80.0, 100.0, 140.0, 200.0];
/// Each sine has this many periods or lasts this long, whichever is longer.
const PERIODS: f64 = 8.0;
const SHORTEST_S: f64 = 0.25;
/// The displacement transducer.
const NOISE_M: f64 = 1e-6;
const RESOLUTION_M: f64 = 0.5e-6;

pub(super) fn draw(setup: &mut Setup) -> BenchCase {
    let axis = &setup.axis;
    let fastest_v_per_s = axis.spool.fastest_v_per_s;
    let truth = truth([
        ("valve.null_V", axis.nameplate.null_v),
        ("spool_gain_m_V", axis.spool_m_per_v),
        (
            "effects.spool-dynamics.natural_frequency_Hz",
            axis.spool.frequency_hz,
        ),
        ("effects.spool-dynamics.damping_ratio", axis.spool.damping),
        ("effects.valve-hysteresis.width", axis.play.width_v),
        ("effects.valve-delay.delay_s", axis.delay_s),
        ("effects.slew-limit.rising_per_s", fastest_v_per_s),
        ("effects.slew-limit.falling_per_s", fastest_v_per_s),
    ]);
    let recordings = vec![
        record(setup, 0, "staircase.csv", SLOW_ROWS_PER_S, &triangle()),
        record(setup, 1, "sines.csv", FAST_ROWS_PER_S, &sines()),
    ];
    BenchCase {
        rig_toml: rig(setup),
        recordings,
        truth,
    }
}

/// The command over the whole range, from its middle up, down and back.
fn triangle() -> Vec<f64> {
    let rest = rows(REST_S, SLOW_ROWS_PER_S);
    let moving = rows(TRIANGLES / TRIANGLE_HZ, SLOW_ROWS_PER_S);
    let half_v = 0.5 * FULL_V;
    let at = |row: usize| {
        let turns = TRIANGLE_HZ * time_s(row, SLOW_ROWS_PER_S) + 0.25;
        let phase = turns - libm::floor(turns);
        // Falls from 1 at phase 0.5 to -1 at phases 0 and 1.
        let value = 1.0 - 4.0 * (phase - 0.5).abs();
        command_v(half_v + half_v * value)
    };
    let mut commands_v = vec![half_v; rest];
    commands_v.extend((0..moving).map(at));
    commands_v.resize(moving + 2 * rest, half_v);
    commands_v
}

/// Sines about what is taken for the null, with rests between.
fn sines() -> Vec<f64> {
    let rest = rows(REST_S, FAST_ROWS_PER_S);
    let mut commands_v = vec![NULL_V; rest];
    for amplitude_v in AMPLITUDES_V {
        for frequency_hz in FREQUENCIES_HZ {
            let count = rows((PERIODS / frequency_hz).max(SHORTEST_S), FAST_ROWS_PER_S);
            let turn_rad = 2.0 * core::f64::consts::PI * frequency_hz;
            commands_v.extend((0..count).map(|row| {
                let angle_rad = turn_rad * time_s(row, FAST_ROWS_PER_S);
                command_v(NULL_V + amplitude_v * libm::sin(angle_rad))
            }));
            commands_v.resize(commands_v.len() + rest, NULL_V);
        }
    }
    commands_v
}

/// Where the spool stands at each row, in volts of command.
fn displaced_v(setup: &Setup, rows_per_s: f64, commands_v: &[f64]) -> Vec<f64> {
    let axis = &setup.axis;
    let path = CommandPath {
        delay_s: axis.delay_s,
        plays: vec![axis.play],
        spool: Some(axis.spool),
        ..CommandPath::default()
    };
    let tick_s = 1.0 / rows_per_s;
    let steps = rows(tick_s, 1.0 / STEP_S);
    let mut state = CommandState::at_rest(commands_v[0]);
    let mut displaced_v = Vec::with_capacity(commands_v.len());
    for command_v in commands_v {
        displaced_v.push(state.spool_v());
        state.accept(*command_v);
        for step in 0..steps {
            state.advance(&path, step as f64 * STEP_S, tick_s, STEP_S);
        }
    }
    displaced_v
}

fn record(
    setup: &Setup,
    recording: usize,
    name: &str,
    rows_per_s: f64,
    commands_v: &[f64],
) -> (String, String) {
    let noises: Noises = setup.noises;
    let mut transducer = Channel::new(noises.of(recording, 0), NOISE_M, RESOLUTION_M);
    let mut file = Recording::new(name, "t_s,u_V,spool_mm");
    let displaced_v = displaced_v(setup, rows_per_s, commands_v);
    for (row, (command_v, spool_v)) in commands_v.iter().zip(displaced_v).enumerate() {
        let now_s = time_s(row, rows_per_s);
        let true_m = setup.axis.spool_m_per_v * (spool_v - setup.axis.nameplate.null_v);
        let shown_mm = 1e3 * transducer.reads(now_s, true_m);
        file.row([(now_s, 4), (*command_v, 4), (shown_mm, 4)]);
    }
    file.finish()
}

fn rig(setup: &mut Setup) -> String {
    let mut rig = Rig::new();
    rig.command();
    rig.signal("spool", "spool_mm", "mm", [NOISE_M, RESOLUTION_M]);
    rig.surroundings();
    rig.data_sheet_valve(&setup.axis, &mut setup.random, NULL_V);
    rig.uncertain("valve.null_V", 0.1);
    rig.finish()
}

#[cfg(test)]
mod tests {
    use super::super::Experiment;
    use super::*;

    #[test]
    fn val_the_slow_triangle_shows_the_width_of_the_play() {
        let setup = Setup::new(Experiment::Spool, 1);
        let commands_v = triangle();
        let spool_v = displaced_v(&setup, SLOW_ROWS_PER_S, &commands_v);
        // Where the command crosses the null upwards and downwards, once the
        // first triangle has taken up the play.
        let at = |row: usize| spool_v[row] - commands_v[row];
        let rest = rows(REST_S, SLOW_ROWS_PER_S);
        let gap_v = at(rest + 7500) - at(rest + 5000);
        let spool = &setup.axis.spool;
        // Behind the command by delay and lag, at 4 V/s in either direction.
        let omega = 2.0 * core::f64::consts::PI * spool.frequency_hz;
        let late_s = setup.axis.delay_s + 2.0 * spool.damping / omega;
        let expected_v = setup.axis.play.width_v + 2.0 * 4.0 * late_s;
        // The command is a staircase of 4 mV.
        assert!((gap_v - expected_v).abs() < 5e-3, "{gap_v} V");
    }

    #[test]
    fn prop_the_spool_is_no_faster_than_its_limit() {
        let setup = Setup::new(Experiment::Spool, 1);
        let spool_v = displaced_v(&setup, FAST_ROWS_PER_S, &sines());
        let limit_v = setup.axis.spool.fastest_v_per_s / FAST_ROWS_PER_S;
        let most_v = spool_v
            .windows(2)
            .fold(0.0_f64, |most, pair| most.max((pair[1] - pair[0]).abs()));
        assert!(most_v <= 1.000_001 * limit_v && most_v > 0.5 * limit_v);
    }
}
