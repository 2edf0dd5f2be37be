//! Areas of the valve without a flow meter: a vessel of known volume at port A
//! is charged from the supply and discharged to the surroundings.

use super::recording::{Recording, command_v, rows, time_s};
use super::rig::Rig;
use super::{BenchCase, Setup};
use crate::case::nameplate::AMBIENT;
use crate::plant::network::{Cylinder, Gas, Motion, Network};

const ROWS_PER_S: f64 = 1000.0;
const STEPS_PER_ROW: usize = 10;
const OPENINGS_V: [f64; 4] = [1.0, 2.0, 3.0, 4.5];
const VOLUME_M3: f64 = 1e-3;
/// Inner surface: a bottle, a quarter more than a sphere of its volume.
const SURFACE_M2: f64 = 0.06;
/// A flow ends this near to its end pressure, or after this time.
const ENDED: f64 = 0.01;
const LONGEST_S: f64 = 5.0;
const REST_S: f64 = 0.5;
const SHUT_S: f64 = 3.0;

pub(super) fn draw(setup: &mut Setup) -> BenchCase {
    let null_v = command_v(setup.axis.nameplate.null_v);
    let recordings = OPENINGS_V
        .iter()
        .enumerate()
        .map(|(recording, opening_v)| record(setup, recording, null_v, *opening_v))
        .collect();
    let mut truth = super::truth([(
        "valve.critical_pressure_ratio",
        setup.axis.nameplate.critical_ratio,
    )]);
    truth.extend(setup.axis.named_areas(&OPENINGS_V));
    BenchCase {
        rig_toml: rig(setup, null_v),
        recordings,
        truth,
    }
}

/// The vessel as a chamber of no length.
fn vessel(setup: &Setup) -> Network {
    Network {
        cylinder: Cylinder {
            stroke_m: 0.0,
            bore_m: 0.0,
            // Both faces together are the surface that exchanges heat.
            area_m2: [0.5 * SURFACE_M2; 2],
            dead_volume_m3: [VOLUME_M3; 2],
        },
        ..setup.axis.network()
    }
}

/// Command and gas at each row: rest, charge, shut, discharge, shut.
fn history(setup: &Setup, network: &Network, null_v: f64, opening_v: f64) -> Vec<(f64, Gas)> {
    let step_s = 1.0 / (ROWS_PER_S * STEPS_PER_ROW as f64);
    let mut gas = network.at_rest(0.0, [AMBIENT.pressure_pa; 2]);
    let mut history: Vec<(f64, Gas)> = Vec::new();
    let supply_pa = setup.axis.nameplate.supply_pa;
    for (command_v, longest_s, end_pa) in [
        (null_v, REST_S, None),
        (null_v + opening_v, LONGEST_S, Some(supply_pa)),
        (null_v, SHUT_S, None),
        (null_v - opening_v, LONGEST_S, Some(AMBIENT.pressure_pa)),
        (null_v, SHUT_S, None),
    ] {
        let paths = setup.axis.paths(command_v);
        for _ in 0..rows(longest_s, ROWS_PER_S) {
            let now_s = time_s(history.len(), ROWS_PER_S);
            history.push((command_v, gas));
            for step in 0..STEPS_PER_ROW {
                let from_s = now_s + step as f64 * step_s;
                gas = network.advance(&gas, &paths, Motion::default(), from_s, step_s);
            }
            let now_pa = network.chamber(&gas, 0, 0.0).pressure_pa;
            if end_pa.is_some_and(|end_pa| (now_pa - end_pa).abs() < ENDED * end_pa) {
                break;
            }
        }
    }
    history
}

fn record(setup: &Setup, recording: usize, null_v: f64, opening_v: f64) -> (String, String) {
    let mut pressure = setup.noises.pressure(recording, 0);
    let mut supply = setup.noises.pressure(recording, 1);
    let network = vessel(setup);
    let name = format!("opening-{opening_v}V.csv");
    let mut file = Recording::new(name, "t_s,u_V,p_a_Pa,p_s_Pa");
    let history = history(setup, &network, null_v, opening_v);
    for (row, (command_v, gas)) in history.iter().enumerate() {
        let now_s = time_s(row, ROWS_PER_S);
        let true_pa = network.chamber(gas, 0, 0.0).pressure_pa;
        file.row([
            (now_s, 4),
            (*command_v, 4),
            (pressure.reads(now_s, true_pa), 1),
            (supply.reads(now_s, setup.axis.nameplate.supply_pa), 1),
        ]);
    }
    file.finish()
}

fn rig(setup: &mut Setup, null_v: f64) -> String {
    let mut rig = Rig::new();
    rig.command();
    rig.pressure("p_a");
    rig.pressure("p_s");
    rig.surroundings();
    rig.supply(&setup.axis);
    rig.data_sheet_valve(&setup.axis, &mut setup.random, null_v);
    rig.section("vessel");
    rig.right("volume_m3", VOLUME_M3);
    rig.right("surface_m2", SURFACE_M2);
    let plate = &setup.axis.nameplate;
    rig.chambers(plate.charging_w_per_m2_k, plate.discharging_w_per_m2_k);
    rig.finish()
}

#[cfg(test)]
mod tests {
    use super::super::Experiment;
    use super::*;

    #[test]
    fn val_the_vessel_gains_what_the_streams_bring() {
        let setup = Setup::new(Experiment::VesselFlow, 4);
        let network = vessel(&setup);
        let null_v = setup.axis.nameplate.null_v;
        let history = history(&setup, &network, null_v, 2.0);
        // Trapezoids over the rows, with the streams worked out from what the
        // vessel holds at each.
        let stream = |(command_v, gas): &(f64, Gas)| {
            let paths = setup.axis.paths(*command_v);
            let node = network.chamber(gas, 0, 0.0);
            let into = network
                .flow
                .stream(paths.supply_m2[0], setup.axis.supply(), node);
            let out = network.flow.stream(paths.exhaust_m2[0], node, AMBIENT);
            into.mass_kg_per_s - out.mass_kg_per_s
        };
        let mut brought_kg = 0.0;
        for pair in history.windows(2) {
            // The command of a row holds up to the next.
            let end = (pair[0].0, pair[1].1);
            brought_kg += 0.5 * (stream(&pair[0]) + stream(&end)) / ROWS_PER_S;
            let gained_kg = pair[1].1.chambers[0].mass_kg - history[0].1.chambers[0].mass_kg;
            assert!((gained_kg - brought_kg).abs() < 1e-8, "{gained_kg} kg");
        }
        let most_kg = history
            .iter()
            .fold(0.0_f64, |most, (_, gas)| most.max(gas.chambers[0].mass_kg));
        assert!(most_kg > 4.0 * history[0].1.chambers[0].mass_kg);
    }
}
