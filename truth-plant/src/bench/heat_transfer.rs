//! Heat transfer by the stop method (figures 8 and 9 of the seed paper): the
//! chamber is charged or discharged for a time and closed; the pressure that
//! it settles at tells the temperature at the stop.

use super::recording::{Noises, Recording, command_v, rows, time_s};
use super::rig::Rig;
use super::{BenchCase, Setup, truth};
use crate::case::nameplate::{AMBIENT, STROKE_M};
use crate::plant::network::{Gas, Motion, Network};
use crate::random::Random;

const ROWS_PER_S: f64 = 1000.0;
const STEPS_PER_ROW: usize = 10;
/// Times of flow.
const FLOWING_S: [f64; 6] = [0.05, 0.1, 0.15, 0.25, 0.4, 0.8];
const REST_S: f64 = 0.5;
/// Shortest and longest wait after the stop, and the temperature difference
/// that ends it: 0.1 %, more than the leak of the shut valve keeps up.
const SETTLING_S: [f64; 2] = [6.0, 20.0];
const SETTLED_K: f64 = 0.3;
/// The piston stands where chamber A is largest.
const STANDING: Motion = Motion {
    position_m: 0.5 * STROKE_M,
    speed_m_per_s: 0.0,
};
const HEAT_DEVIATION: f64 = 0.4;

pub(super) fn draw(setup: &mut Setup) -> BenchCase {
    let plate = &mut setup.axis.nameplate;
    // A shut-off valve between valve and port: next to no leak.
    plate.curve.leak_m2 = setup.random.between(0.0, 2e-9);
    let (charging, discharging) = (plate.charging_w_per_m2_k, plate.discharging_w_per_m2_k);
    let null_v = command_v(plate.null_v + setup.random.between(-0.02, 0.02));
    let opening_v = setup.random.between(0.8, 1.2);
    let mut recordings = Vec::new();
    for (way, sign, start_pa) in [
        ("charging", 1.0, AMBIENT.pressure_pa),
        ("discharging", -1.0, setup.axis.nameplate.supply_pa),
    ] {
        for (number, flowing_s) in FLOWING_S.into_iter().enumerate() {
            let run = Run {
                null_v,
                flowing_v: command_v(null_v + sign * opening_v),
                flowing_s,
                start_pa,
            };
            let name = format!("{way}-{}.csv", number + 1);
            recordings.push(record(setup, recordings.len(), name, &run));
        }
    }
    BenchCase {
        rig_toml: rig(setup, null_v),
        recordings,
        truth: truth([
            ("chambers.heat_transfer_charging_W_m2K", charging),
            ("chambers.heat_transfer_discharging_W_m2K", discharging),
        ]),
    }
}

/// One stopped run.
struct Run {
    null_v: f64,
    flowing_v: f64,
    flowing_s: f64,
    start_pa: f64,
}

impl Run {
    fn command_v(&self, row: usize) -> f64 {
        let from = rows(REST_S, ROWS_PER_S);
        let to = from + rows(self.flowing_s, ROWS_PER_S);
        if (from..to).contains(&row) {
            self.flowing_v
        } else {
            self.null_v
        }
    }

    /// The gas at each row, with the network that it is in.
    fn history(&self, setup: &Setup) -> (Network, Vec<Gas>) {
        let network = setup.axis.network();
        let step_s = 1.0 / (ROWS_PER_S * STEPS_PER_ROW as f64);
        let stopped = rows(REST_S + self.flowing_s, ROWS_PER_S);
        let [shortest, longest] = SETTLING_S.map(|wait_s| stopped + rows(wait_s, ROWS_PER_S));
        let pressures_pa = [self.start_pa, AMBIENT.pressure_pa];
        let mut gas = network.at_rest(STANDING.position_m, pressures_pa);
        let mut history = Vec::with_capacity(longest);
        for row in 0..longest {
            history.push(gas);
            let paths = setup.axis.paths(self.command_v(row));
            for step in 0..STEPS_PER_ROW {
                let now_s = time_s(row, ROWS_PER_S) + step as f64 * step_s;
                gas = network.advance(&gas, &paths, STANDING, now_s, step_s);
            }
            let node = network.chamber(&gas, 0, STANDING.position_m);
            let off_k = (node.temperature_k - AMBIENT.temperature_k).abs();
            if row >= shortest && off_k < SETTLED_K {
                break;
            }
        }
        (network, history)
    }
}

fn record(setup: &Setup, recording: usize, name: String, run: &Run) -> (String, String) {
    let noises: Noises = setup.noises;
    let mut chamber = noises.pressure(recording, 0);
    let mut supply = noises.pressure(recording, 1);
    let mut position = noises.position(recording, 2);
    let (network, history) = run.history(setup);
    let mut file = Recording::new(name, "t_s,u_V,p_a_Pa,p_s_Pa,x_m");
    for (row, gas) in history.iter().enumerate() {
        let now_s = time_s(row, ROWS_PER_S);
        let true_pa = network.chamber(gas, 0, STANDING.position_m).pressure_pa;
        file.row([
            (now_s, 4),
            (run.command_v(row), 4),
            (chamber.reads(now_s, true_pa), 1),
            (supply.reads(now_s, setup.axis.nameplate.supply_pa), 1),
            (position.reads(now_s, STANDING.position_m), 8),
        ]);
    }
    file.finish()
}

/// A coefficient wrong by 30 to 50 %.
fn far_off(random: &mut Random, truth: f64) -> f64 {
    truth * (1.0 + random.sign() * random.between(0.3, 0.5))
}

fn rig(setup: &mut Setup, null_v: f64) -> String {
    let plate = &setup.axis.nameplate;
    let charging = far_off(&mut setup.random, plate.charging_w_per_m2_k);
    let discharging = far_off(&mut setup.random, plate.discharging_w_per_m2_k);
    let mut rig = Rig::new();
    rig.command();
    rig.pressure("p_a");
    rig.pressure("p_s");
    rig.position("x_m", "m");
    rig.surroundings();
    rig.supply(&setup.axis);
    rig.table_valve(&setup.axis, &mut setup.random, null_v);
    rig.cylinder(setup.axis.nameplate.dead_volume_m3);
    rig.chambers(charging, discharging);
    rig.uncertain("valve.null_V", 0.02);
    rig.uncertain("chambers.heat_transfer_charging_W_m2K", HEAT_DEVIATION);
    rig.uncertain("chambers.heat_transfer_discharging_W_m2K", HEAT_DEVIATION);
    rig.finish()
}

#[cfg(test)]
mod tests {
    use super::super::Experiment;
    use super::*;

    #[test]
    fn val_the_temperature_after_the_stop_relaxes_to_that_of_the_wall() {
        let setup = Setup::new(Experiment::HeatTransfer, 2);
        let null_v = setup.axis.nameplate.null_v;
        for (opening_v, start_pa) in [(1.0, AMBIENT.pressure_pa), (-1.0, 7e5)] {
            let run = Run {
                null_v,
                flowing_v: null_v + opening_v,
                flowing_s: 0.25,
                start_pa,
            };
            let (network, history) = run.history(&setup);
            let off_k = |row: usize| {
                let node = network.chamber(&history[row], 0, STANDING.position_m);
                node.temperature_k - AMBIENT.temperature_k
            };
            let stopped = rows(REST_S + run.flowing_s, ROWS_PER_S);
            let at_stop_k = off_k(stopped);
            assert!(at_stop_k * opening_v > 10.0, "{at_stop_k} K at the stop");
            let end_k = off_k(history.len() - 1);
            // The nameplate's leak of 0.1 mm2 keeps a stream of warm or cold gas.
            assert!(end_k.abs() < 0.1 * at_stop_k.abs(), "{end_k} K at the end");
        }
    }
}
