//! Mass and energy close, and the scheme is of the order that it claims.

mod common;

use common::axis;
use truth_plant::Plant;
use truth_plant::plant::gas::Content;
use truth_plant::plant::heat::Wall;
use truth_plant::plant::line::Line;
use truth_plant::plant::network::{Gas, Network, Silencer, Tank};
use truth_plant::plant::{Physics, Start};

const START: Start = Start {
    position_m: 0.02,
    pressure_pa: [420e3; 2],
    seed: 1,
    recording: 0,
};

/// Moves of some 0.2 m with reversals, away from the stops: a bounce off a stop
/// is a jump that no scheme converges on.
fn driven(physics: Physics, steps_per_tick: usize, ticks: usize) -> Plant {
    let mut plant = Plant::with_steps(physics, None, START, steps_per_tick);
    for tick in 0..ticks {
        let time_s = tick as f64 * 1e-3;
        plant.advance(5.0 + 1.5 * (2.0 * core::f64::consts::PI * 4.0 * time_s).cos());
    }
    assert!(plant.motion().position_m.abs() < 0.24);
    plant
}

fn sum(contents: impl IntoIterator<Item = Content>) -> Content {
    contents
        .into_iter()
        .fold(Content::default(), |sum, part| Content {
            mass_kg: sum.mass_kg + part.mass_kg,
            energy_j: sum.energy_j + part.energy_j,
        })
}

fn content(network: &Network, gas: &Gas) -> Content {
    let cells = network.line.map_or(0, |line| line.cells());
    let lines = gas.lines.iter().flat_map(|line| &line.cells[..cells]);
    sum(lines
        .chain(&gas.chambers)
        .chain([&gas.tank, &gas.silencer])
        .copied())
}

#[test]
fn prop_mass_and_energy_close_with_everything_in_the_way() {
    let mut physics = axis();
    let network = &mut physics.network;
    network.line = Some(Line::new(1.5, 0.004));
    network.supply.tank = Some(Tank {
        volume_m3: 0.8e-3,
        feed_area_m2: 4.5e-6,
        feed_kg_per_s_pa: 0.0,
    });
    network.silencer = Some(Silencer {
        volume_m3: 50e-6,
        area_m2: 5e-6,
    });
    network.piston_leak.orifice_m2 = 1e-7;
    network.chamber_leak[1].laminar_kg_per_s_pa2 = 5e-16;
    network.wall = Some(Wall {
        capacity_j_per_k: 300.0,
        outward_w_per_k: 0.3,
        warmer_k: 10.0,
    });
    let network = network.clone();
    let before = content(
        &network,
        &network.at_rest(START.position_m, START.pressure_pa),
    );
    let plant = driven(physics, 40, 1000);
    let gas = plant.gas();
    let after = content(&network, gas);
    let ledger = &gas.ledger;
    // The chambers' gas has been exchanged.
    assert!(ledger.supplied.mass_kg > 1e-3, "{ledger:?}");
    let mass_kg =
        after.mass_kg - before.mass_kg - ledger.supplied.mass_kg + ledger.released.mass_kg;
    let energy_j = after.energy_j - before.energy_j - ledger.supplied.energy_j
        + ledger.released.energy_j
        - ledger.heat_j
        + ledger.work_j;
    // 160 000 additions of rounded numbers.
    const ROUNDING: f64 = 1e-11;
    assert!(mass_kg.abs() < ROUNDING * before.mass_kg, "{mass_kg} kg");
    assert!(energy_j.abs() < ROUNDING * before.energy_j, "{energy_j} J");
}

/// A shut, adiabatic, frictionless axis that swings on its gas.
fn swing() -> Physics {
    let mut physics = axis();
    physics.areas.supply_m2 = vec![0.0; 19];
    physics.network.heat.charging_w_per_m2_k = 0.0;
    physics.network.heat.discharging_w_per_m2_k = 0.0;
    let friction = &mut physics.mechanics.friction;
    friction.stiffness_n_per_m = 0.0;
    friction.damping_n_s_per_m = 0.0;
    friction.viscous_n_s_per_m = 0.0;
    physics
}

/// What the swing's energy has gained after 0.2 s.
fn energy_gained_j(steps_per_tick: usize) -> f64 {
    let physics = swing();
    let mass_kg = physics.mechanics.mass_kg;
    let energy_j = |plant: &Plant| {
        let speed = plant.motion().speed_m_per_s;
        let gas_j = sum(plant.gas().chambers).energy_j;
        gas_j + 0.5 * mass_kg * speed * speed
    };
    let start = Start {
        pressure_pa: [600e3, 350e3],
        ..START
    };
    let mut plant = Plant::with_steps(physics, None, start, steps_per_tick);
    let start_j = energy_j(&plant);
    for _ in 0..200 {
        plant.advance(5.0);
    }
    energy_j(&plant) - start_j
}

#[test]
fn prop_a_swing_on_gas_keeps_its_energy_to_the_second_order() {
    let [coarse_j, fine_j] = [5, 10].map(energy_gained_j);
    let ratio = coarse_j / fine_j;
    assert!((3.5..4.5).contains(&ratio), "{coarse_j} J, {fine_j} J");
    // Of some 10 J that swing between gas and carriage.
    let default_j = energy_gained_j(40);
    assert!(default_j.abs() < 1e-5, "{default_j} J");
}

#[test]
fn val_a_swing_has_the_frequency_of_its_gas_springs() {
    // K = gamma p A^2 (1 / V_a + 1 / V_b) about the middle, small amplitude.
    let mut physics = swing();
    physics.network.cylinder.dead_volume_m3 = [25e-6; 2];
    let start = Start {
        position_m: 1e-3,
        pressure_pa: [500e3; 2],
        ..START
    };
    // Equal pressures away from the middle: shut in the middle, then displaced.
    let network = &physics.network;
    let squeezed = |chamber: usize| {
        let ratio = network.cylinder.volume_m3(chamber, 0.0)
            / network.cylinder.volume_m3(chamber, start.position_m);
        500e3 * ratio.powf(1.4)
    };
    let start = Start {
        pressure_pa: [squeezed(0), squeezed(1)],
        ..start
    };
    let volume_m3 = network.cylinder.volume_m3(0, 0.0);
    let area_m2: f64 = 4.909e-4;
    let stiffness = 1.4 * 500e3 * area_m2.powi(2) * 2.0 / volume_m3;
    let expected_hz =
        (stiffness / physics.mechanics.mass_kg).sqrt() / (2.0 * core::f64::consts::PI);
    let mut plant = Plant::new(physics, start);
    let mut crossings_s = Vec::new();
    let mut before_m = start.position_m;
    for _ in 0..2000 {
        plant.advance(5.0);
        let position_m = plant.motion().position_m;
        if before_m > 0.0 && position_m <= 0.0 {
            crossings_s.push(plant.time_s() + 1e-3 * position_m / (before_m - position_m));
        }
        before_m = position_m;
    }
    let periods = (crossings_s.len() - 1) as f64;
    let span_s = crossings_s.last().unwrap() - crossings_s.first().unwrap();
    let got_hz = periods / span_s;
    assert!(
        (got_hz / expected_hz - 1.0).abs() < 1e-4,
        "{got_hz} Hz, {expected_hz} Hz expected"
    );
}

/// Distances of position and pressures from a run with very fine steps.
fn errors(physics: &Physics, steps_per_tick: usize, reference: &Plant) -> [f64; 3] {
    let got = driven(physics.clone(), steps_per_tick, 250).reality();
    let truth = reference.reality();
    [
        (got.position_m - truth.position_m).abs(),
        (got.pressure_pa[0] - truth.pressure_pa[0]).abs(),
        (got.pressure_pa[1] - truth.pressure_pa[1]).abs(),
    ]
}

#[test]
fn prop_the_default_step_is_far_finer_than_the_converters() {
    let mut with_tubes = axis();
    with_tubes.network.line = Some(Line::new(0.5, 0.004));
    for physics in [axis(), with_tubes] {
        let reference = driven(physics.clone(), 640, 250);
        let [position_m, a_pa, b_pa] = errors(&physics, 40, &reference);
        println!("{position_m} m, {a_pa} Pa, {b_pa} Pa");
        // A hundredth of the converters' steps of 7.6 um and 244 Pa.
        assert!(position_m < 76e-9, "{position_m} m");
        assert!(a_pa < 2.4 && b_pa < 2.4, "{a_pa} Pa, {b_pa} Pa");
    }
}
