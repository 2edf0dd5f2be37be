//! Dead volumes: both ports plugged, the piston pushed from place to place.

use super::recording::{Noises, Recording, rows, time_s};
use super::rig::{Rig, wrong};
use super::travel::{Piece, Travel};
use super::{BenchCase, Setup, truth};
use crate::case::nameplate::{AMBIENT, STROKE_M};
use crate::plant::network::{Motion, Network};
use crate::plant::valve::Paths;
use crate::random::Random;

const ROWS_PER_S: f64 = 100.0;
const STEPS_PER_ROW: usize = 20;
const GAUGE_PA: f64 = 3e5;
/// Time at each place.
const HELD_S: f64 = 8.0;
/// Places over half the stroke. Beyond 0.63 the smaller chamber would leave
/// the range of a transmitter for 10 bar gauge, and the strength of a hand.
const PLACES: [f64; 6] = [0.2, 0.4, 0.6, -0.2, -0.4, -0.6];
/// Time of a push: slow enough for most of the heat to leave on the way.
const PUSH_S: [f64; 2] = [2.0, 3.5];
/// Each place is met to within this share of half the stroke.
const MISSED: f64 = 0.03;

pub(super) fn draw(setup: &mut Setup) -> BenchCase {
    let plate = &setup.axis.nameplate;
    let mut network = setup.axis.network();
    network.piston_leak.orifice_m2 = setup.axis.piston_leak_m2;
    let travel = travel(&mut setup.random);
    let recording = record(setup.noises, &network, &travel);
    let truth = truth([
        ("cylinder.dead_volume_a_m3", plate.dead_volume_m3[0]),
        ("cylinder.dead_volume_b_m3", plate.dead_volume_m3[1]),
    ]);
    BenchCase {
        rig_toml: rig(setup),
        recordings: vec![recording],
        truth,
    }
}

fn travel(random: &mut Random) -> Travel {
    let mut pieces = vec![hold(2.0)];
    let mut before_m = 0.0;
    for place in PLACES {
        let place_m = 0.5 * STROKE_M * (place + random.between(-MISSED, MISSED));
        let push_s = random.between(PUSH_S[0], PUSH_S[1]);
        // A change up and the change down that begins the hold take half of
        // their time each.
        let change_s = 0.4 * push_s;
        pieces.push(Piece::Speed {
            duration_s: push_s,
            speed_m_per_s: (place_m - before_m) / push_s,
            change_s,
        });
        pieces.push(Piece::Speed {
            duration_s: HELD_S + change_s,
            speed_m_per_s: 0.0,
            change_s,
        });
        before_m = place_m;
    }
    Travel::new(0.0, &pieces)
}

fn hold(duration_s: f64) -> Piece {
    Piece::Speed {
        duration_s,
        speed_m_per_s: 0.0,
        change_s: 0.1,
    }
}

fn record(noises: Noises, network: &Network, travel: &Travel) -> (String, String) {
    let mut position = noises.position(0, 0);
    let mut pressures = [1, 2].map(|channel| noises.pressure(0, channel));
    let step_s = 1.0 / (ROWS_PER_S * STEPS_PER_ROW as f64);
    let start_m = travel.position_m(0.0);
    let mut gas = network.at_rest(start_m, [AMBIENT.pressure_pa + GAUGE_PA; 2]);
    let mut file = Recording::new("pushed.csv", "t_s,p_a_Pa,p_b_Pa,x_m");
    for row in 0..rows(travel.duration_s(), ROWS_PER_S) {
        let now_s = time_s(row, ROWS_PER_S);
        let place_m = travel.position_m(now_s);
        let [a_pa, b_pa] = [0, 1].map(|port| {
            let true_pa = network.chamber(&gas, port, place_m).pressure_pa;
            pressures[port].reads(now_s, true_pa)
        });
        let shown_m = position.reads(now_s, place_m);
        file.row([(now_s, 4), (a_pa, 1), (b_pa, 1), (shown_m, 8)]);
        for step in 0..STEPS_PER_ROW {
            let from_s = now_s + step as f64 * step_s;
            let from_m = travel.position_m(from_s);
            let motion = Motion {
                position_m: from_m,
                speed_m_per_s: (travel.position_m(from_s + step_s) - from_m) / step_s,
            };
            gas = network.advance(&gas, &Paths::default(), motion, from_s, step_s);
        }
    }
    file.finish()
}

fn rig(setup: &mut Setup) -> String {
    const DEVIATION: f64 = 0.3;
    // Right, but measured while gas flowed: with plugged ports there is neither
    // charging nor discharging.
    const HEAT_DEVIATION: f64 = 0.3;
    let plate = &setup.axis.nameplate;
    let typed_m3 = plate
        .dead_volume_m3
        .map(|truth_m3| wrong(&mut setup.random, truth_m3, DEVIATION));
    let mut rig = Rig::new();
    rig.pressure("p_a");
    rig.pressure("p_b");
    rig.position("x_m", "m");
    rig.surroundings();
    rig.cylinder(typed_m3);
    rig.chambers(plate.charging_w_per_m2_k, plate.discharging_w_per_m2_k);
    rig.uncertain("cylinder.dead_volume_a_m3", DEVIATION);
    rig.uncertain("cylinder.dead_volume_b_m3", DEVIATION);
    rig.uncertain("chambers.heat_transfer_charging_W_m2K", HEAT_DEVIATION);
    rig.uncertain("chambers.heat_transfer_discharging_W_m2K", HEAT_DEVIATION);
    rig.finish()
}

#[cfg(test)]
mod tests {
    use super::super::Experiment;
    use super::*;

    #[test]
    fn val_a_tight_piston_leaves_pressure_times_volume_as_it_was() {
        let setup = Setup::new(Experiment::DeadVolume, 1);
        let network = setup.axis.network();
        let travel = travel(&mut Random::new(1, crate::random::Purpose::Bench(0)));
        let (_, text) = record(setup.noises, &network, &travel);
        let last = text.lines().last().unwrap();
        let values: Vec<f64> = last
            .split(',')
            .map(|value| value.parse().unwrap())
            .collect();
        for port in 0..2 {
            let start = (AMBIENT.pressure_pa + GAUGE_PA) * network.cylinder.volume_m3(port, 0.0);
            let end = values[1 + port] * network.cylinder.volume_m3(port, values[3]);
            // Four deviations of the gauge at the lower pressure.
            assert!((end / start - 1.0).abs() < 5e-3, "{port}: {end} J");
        }
    }
}
