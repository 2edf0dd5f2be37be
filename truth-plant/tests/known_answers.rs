//! Laws against answers that do not come from this crate.

mod common;

use core::f64::consts::PI;

use common::{AMBIENT, axis};
use truth_plant::Plant;
use truth_plant::plant::Start;
use truth_plant::plant::friction::{Dwell, Presliding, Surroundings};
use truth_plant::plant::gas::{FlowShape, Node, PAPER_DISCHARGE};
use truth_plant::plant::line::Line;
use truth_plant::plant::mechanics::{Cogging, Mechanics, MotionState, Push, Spring};
use truth_plant::plant::network::{Motion, Network};
use truth_plant::plant::valve::{Paths, Play, Spool};

const STILL: Motion = Motion {
    position_m: 0.0,
    speed_m_per_s: 0.0,
};

fn close(got: f64, expected: f64, relative: f64) {
    assert!(
        (got / expected - 1.0).abs() < relative,
        "{got} where {expected} was expected"
    );
}

// ---- gas ----

#[test]
fn val_choked_flow_is_that_of_the_paper() {
    let shape = FlowShape {
        critical_ratio: 0.3,
        laminar_ratio: 0.985,
        discharge: PAPER_DISCHARGE,
    };
    let supply = Node {
        pressure_pa: 700e3,
        temperature_k: 293.15,
    };
    let vacuum = Node {
        pressure_pa: 0.0,
        ..AMBIENT
    };
    // C1 = 0.0404184 s K^1/2 / m and Cd(0) = 0.8153.
    let expected = 1e-6 * 0.8153 * 0.0404184 * 700e3 / 293.15_f64.sqrt();
    let stream = shape.stream(1e-6, supply, vacuum);
    close(stream.mass_kg_per_s, expected, 1e-6);
    // It carries 1004.5 J/(kg K) at the temperature of its source.
    close(stream.enthalpy_w, expected * 1004.5 * 293.15, 1e-6);
    let back = shape.stream(1e-6, vacuum, supply);
    close(back.mass_kg_per_s, -expected, 1e-6);
}

#[test]
fn prop_the_flow_law_is_continuous_and_falls_to_nought() {
    let shape = FlowShape {
        critical_ratio: 0.3,
        laminar_ratio: 0.985,
        discharge: PAPER_DISCHARGE,
    };
    let supply = Node {
        pressure_pa: 700e3,
        temperature_k: 293.15,
    };
    let flow = |ratio: f64| {
        let behind = Node {
            pressure_pa: ratio * supply.pressure_pa,
            ..supply
        };
        shape.stream(1e-6, supply, behind).mass_kg_per_s
    };
    for ratio in [0.3, 0.985] {
        close(flow(ratio + 1e-9), flow(ratio - 1e-9), 1e-6);
    }
    assert!(flow(1.0).abs() < 1e-15);
    assert!(flow(1.01) < 0.0);
}

/// The axis without heat, shut but for what a test opens.
fn adiabatic() -> Network {
    let mut network = axis().network;
    network.heat.charging_w_per_m2_k = 0.0;
    network.heat.discharging_w_per_m2_k = 0.0;
    network
}

#[test]
fn val_sealed_gas_follows_the_isentrope() {
    let network = adiabatic();
    let mut gas = network.at_rest(0.0, [500e3; 2]);
    let shut = Paths::default();
    // 0.2 m at 1 m/s.
    for step in 0..8000 {
        let motion = Motion {
            position_m: f64::from(step) * 25e-6,
            speed_m_per_s: 1.0,
        };
        gas = network.advance(&gas, &shut, motion, 0.0, 25e-6);
    }
    for chamber in 0..2 {
        let ratio =
            network.cylinder.volume_m3(chamber, 0.0) / network.cylinder.volume_m3(chamber, 0.2);
        let state = network.chamber(&gas, chamber, 0.2);
        close(state.pressure_pa, 500e3 * ratio.powf(1.4), 1e-7);
        close(state.temperature_k, 293.15 * ratio.powf(0.4), 1e-7);
    }
}

#[test]
fn val_a_filled_vessel_has_the_temperature_of_mixing() {
    // dU = gamma c_v T_s dm: T = gamma T_s / (1 + (p1 / p) (gamma T_s / T1 - 1)).
    let network = adiabatic();
    let mut gas = network.at_rest(0.0, [100e3; 2]);
    let open = Paths {
        supply_m2: [1e-6, 0.0],
        exhaust_m2: [0.0; 2],
    };
    for _ in 0..20_000 {
        gas = network.advance(&gas, &open, STILL, 0.0, 25e-6);
    }
    let state = network.chamber(&gas, 0, 0.0);
    assert!(state.pressure_pa > 300e3);
    let expected = 1.4 * 293.15 / (1.0 + 100e3 / state.pressure_pa * 0.4);
    close(state.temperature_k, expected, 1e-6);
}

#[test]
fn val_an_emptied_vessel_cools_along_the_isentrope() {
    let network = adiabatic();
    let mut gas = network.at_rest(0.0, [600e3; 2]);
    let open = Paths {
        supply_m2: [0.0; 2],
        exhaust_m2: [1e-6, 0.0],
    };
    for _ in 0..40_000 {
        gas = network.advance(&gas, &open, STILL, 0.0, 25e-6);
    }
    let state = network.chamber(&gas, 0, 0.0);
    assert!(state.pressure_pa < 400e3);
    let expected = 293.15 * (state.pressure_pa / 600e3).powf(0.4 / 1.4);
    close(state.temperature_k, expected, 1e-6);
}

#[test]
fn val_the_null_equilibrium_is_that_of_the_leak_areas() {
    // p_eq / p_s = 0.755 where exhaust and supply leak alike, b = 0.29.
    let mut network = axis().network;
    network.flow.critical_ratio = 0.29;
    let mut gas = network.at_rest(0.0, [500e3; 2]);
    let leaks = Paths {
        supply_m2: [1e-6; 2],
        exhaust_m2: [1e-6; 2],
    };
    for _ in 0..200_000 {
        gas = network.advance(&gas, &leaks, STILL, 0.0, 25e-6);
    }
    // Heat and the two temperatures keep it from the isothermal figure by a little.
    close(
        network.chamber(&gas, 0, 0.0).pressure_pa / 700e3,
        0.755,
        0.01,
    );
}

// ---- tube ----

#[test]
fn val_tube_friction_is_poiseuilles_and_blasius() {
    let line = Line::new(1.5, 0.004);
    let cell_m = 1.5 / line.cells() as f64;
    // 20 l/min (ANR) at 5 bar, 4 mm: Re = 7 800, f = 0.0337.
    let density = 500e3 / (287.0 * 293.15);
    let area = PI / 4.0 * 0.004_f64.powi(2);
    let fast = 0.4e-3;
    let reynolds = fast * 0.004 / (area * 1.81e-5);
    let speed = fast / (density * area);
    let darcy = 0.3164 / reynolds.powf(0.25);
    let expected = darcy * cell_m / 0.004 * density * speed * speed / 2.0;
    close(line.friction_pa(fast, density), expected, 1e-9);
    let slow = 1e-5;
    let speed = slow / (density * area);
    let expected = 32.0 * 1.81e-5 * cell_m * speed / 0.004_f64.powi(2);
    close(line.friction_pa(slow, density), expected, 1e-9);
    close(line.friction_pa(-slow, density), -expected, 1e-9);
}

#[test]
fn val_a_tube_sings_at_its_quarter_wave() {
    // Shut at the valve, open to a chamber of 160 times its volume.
    let mut network = axis().network;
    let length_m = 2.4;
    network.line = Some(Line::new(length_m, 0.0057));
    network.cylinder.dead_volume_m3 = [1e-2; 2];
    let mut gas = network.at_rest(0.0, [500e3; 2]);
    let cells = network.line.unwrap().cells();
    for cell in 0..cells {
        let along = (cell as f64 + 1.0) / cells as f64;
        gas.lines[0].flow_kg_per_s[cell] = 1e-6 * (0.5 * PI * along).sin();
    }
    let shut = Paths::default();
    let first_pa = |gas: &truth_plant::plant::network::Gas| {
        let volume_m3 = network.line.unwrap().cell_volume_m3();
        gas.lines[0].cells[0].state(volume_m3).pressure_pa - 500e3
    };
    let mut crossings_s = Vec::new();
    let mut before_pa = 0.0;
    let dt_s = 12.5e-6;
    for step in 1..20_000_u32 {
        gas = network.advance(&gas, &shut, STILL, 0.0, dt_s);
        let now_pa = first_pa(&gas);
        if before_pa < 0.0 && now_pa >= 0.0 {
            crossings_s.push(f64::from(step) * dt_s);
        }
        before_pa = now_pa;
    }
    let count = crossings_s.len() - 1;
    assert!(count >= 3, "{count} periods");
    let got_hz = count as f64 / (crossings_s[count] - crossings_s[0]);
    let sound_m_per_s = (1.4_f64 * 287.0 * 293.15).sqrt();
    // Heat at the wall, friction and the twelve cells change it by a little.
    close(got_hz, sound_m_per_s / (4.0 * length_m), 0.01);
}

// ---- friction and motion ----

fn carriage(presliding: Presliding) -> Mechanics {
    let mut mechanics = axis().mechanics;
    mechanics.friction.presliding = presliding;
    mechanics
}

fn pushed(force_n: f64) -> Push {
    Push {
        force_n,
        mean_gauge_pa: 0.0,
        difference_pa: 0.0,
    }
}

const LAWS: [Presliding; 3] = [
    Presliding::LuGre,
    Presliding::ElastoPlastic,
    Presliding::MaxwellSlip,
];
const DT_S: f64 = 25e-6;

#[test]
fn val_steady_sliding_meets_the_stribeck_curve() {
    for law in LAWS {
        for speed in [0.003_f64, 0.01, 0.2, 2.0] {
            let friction = carriage(law).friction;
            let surroundings = Surroundings {
                position_m: 0.0,
                mean_gauge_pa: 0.0,
                difference_pa: 0.0,
            };
            let mut memory = MotionState::default().contact;
            let mut force_n = 0.0;
            for _ in 0..(0.01 / speed / DT_S) as usize {
                let slip = friction.slip(&surroundings, &memory);
                (force_n, memory) = friction.advance(&slip, &memory, speed, DT_S);
            }
            let fall = (-(speed / 5.03e-3).powi(2)).exp();
            let expected = 20.2 + 8.7 * fall + 64.5 * speed;
            close(force_n, expected, 1e-6);
        }
    }
}

#[test]
fn val_presliding_has_the_bristles_stiffness() {
    // The first few newtons bend, in each law, with 0.914 N/um; LuGre already
    // slips by their share of the static friction.
    for law in LAWS {
        let mechanics = carriage(law);
        let mut state = mechanics.at_rest(0.0);
        for _ in 0..20_000 {
            state = mechanics.advance(&state, &pushed(1.0), 0.0, DT_S);
        }
        close(state.position_m, 1.0 / 9.14e5, 0.06);
    }
}

#[test]
fn val_lugre_creeps_under_a_ripple_and_the_others_do_not() {
    // 10 N with 1 N at 10 Hz, far under break-away, 2 kg: LuGre creeps 17 um/s.
    let creep_m_per_s = |law: Presliding| {
        let mechanics = carriage(law);
        let mut state = mechanics.at_rest(0.0);
        let mut marks_m = Vec::new();
        for step in 0..(3.0 / DT_S) as u32 {
            let time_s = f64::from(step) * DT_S;
            if step % 40_000 == 0 {
                marks_m.push(state.position_m);
            }
            let force_n = 10.0 + (2.0 * PI * 10.0 * time_s).sin();
            state = mechanics.advance(&state, &pushed(force_n), time_s, DT_S);
        }
        // From 1 s to 2 s: past the first bending.
        marks_m[2] - marks_m[1]
    };
    close(creep_m_per_s(Presliding::LuGre), 17e-6, 0.1);
    assert!(creep_m_per_s(Presliding::ElastoPlastic).abs() < 0.1e-6);
    assert!(creep_m_per_s(Presliding::MaxwellSlip).abs() < 0.1e-6);
}

/// The force at which a slow ramp has moved the carriage by 1 mm: far more than
/// any presliding.
fn break_away_n(mechanics: &Mechanics, rested_s: f64) -> f64 {
    let mut state = mechanics.at_rest(0.0);
    state.contact.rested_s = rested_s;
    let mut force_n = 0.0;
    while state.position_m < 1e-3 {
        force_n += 10.0 * DT_S;
        state = mechanics.advance(&state, &pushed(force_n), 0.0, DT_S);
    }
    force_n
}

#[test]
fn val_break_away_is_at_the_static_friction() {
    for law in LAWS {
        // LuGre creeps before it breaks away, and so sees less than the peak.
        close(break_away_n(&carriage(law), 0.0), 28.9, 0.03);
    }
}

#[test]
fn val_a_rest_raises_break_away() {
    let mut mechanics = carriage(Presliding::LuGre);
    mechanics.friction.dwell = Some(Dwell {
        growth_n: 20.0,
        time_constant_s: 1.0,
        logarithmic: false,
    });
    let rested = break_away_n(&mechanics, 100.0);
    close(rested, 48.9, 0.05);
    // The slow ramp itself is a rest of some seconds.
    let fresh = break_away_n(&mechanics, 0.0);
    assert!(
        fresh > 40.0 && fresh < rested + 1e-3,
        "{fresh} N, {rested} N"
    );
}

#[test]
fn val_terminal_speed_is_force_less_coulomb_over_viscous() {
    let mut mechanics = carriage(Presliding::LuGre);
    mechanics.half_stroke_m = 1e3;
    mechanics.constant_n = 5.0;
    let mut state = mechanics.at_rest(0.0);
    for _ in 0..(1.0 / DT_S) as u32 {
        state = mechanics.advance(&state, &pushed(89.7), 0.0, DT_S);
    }
    close(state.speed_m_per_s, (89.7 - 5.0 - 20.2) / 64.5, 1e-6);
}

// ---- from command to spool ----

#[test]
fn val_the_spool_overshoots_as_a_second_order() {
    let mut physics = axis();
    physics.command.spool = Some(Spool {
        frequency_hz: 30.0,
        damping: 0.5,
        fastest_v_per_s: 1e9,
    });
    let start = Start {
        position_m: 0.0,
        pressure_pa: [400e3; 2],
        seed: 1,
        recording: 0,
    };
    let mut plant = Plant::new(physics, start);
    let mut peak_v = 0.0_f64;
    for _ in 0..60 {
        plant.advance(6.0);
        peak_v = peak_v.max(plant.spool_v());
    }
    let step_v = 6.0 - 5.0;
    let overshoot = (-PI * 0.5 / (1.0_f64 - 0.25).sqrt()).exp();
    // The command is quantised, the peak seen at ticks.
    close(peak_v - 5.0, step_v * (1.0 + overshoot), 0.01);
}

#[test]
fn val_delay_and_play_do_what_they_say() {
    let start = Start {
        position_m: 0.0,
        pressure_pa: [400e3; 2],
        seed: 1,
        recording: 0,
    };
    let mut physics = axis();
    physics.command.delay_s = 3e-3;
    let mut plant = Plant::new(physics, start);
    let seen: Vec<bool> = (0..5)
        .map(|_| {
            plant.advance(7.0);
            plant.spool_v() > 6.9
        })
        .collect();
    // Held from 0 to 1 ms, the command reaches the spool from 3 ms on.
    assert_eq!(seen, [false, false, false, true, true]);

    let mut physics = axis();
    physics.command.plays = vec![Play {
        width_v: 0.2,
        weight: 1.0,
    }];
    let mut plant = Plant::new(physics, start);
    plant.advance(6.0);
    let up_v = plant.spool_v();
    plant.advance(5.5);
    let down_v = plant.spool_v();
    close(up_v, 5.9, 1e-3);
    close(down_v, 5.6, 1e-3);
}

/// Against a spring and teeth the energy that the motion loses is theirs, and a force that grows
/// with time gives its impulse; friction takes next to nothing.
#[test]
fn val_forces_of_place_keep_the_energy_and_a_drift_gives_its_impulse() {
    let mut mechanics = carriage(Presliding::LuGre);
    let friction = &mut mechanics.friction;
    (friction.coulomb_n, friction.static_n) = (1e-9, 1e-9);
    (friction.viscous_n_s_per_m, friction.damping_n_s_per_m) = (0.0, 0.0);
    let drifting = Mechanics {
        drift_n_per_s: -3.0,
        ..mechanics.clone()
    };
    let spring = Spring {
        n_per_m: 40.0,
        n_per_m3: 3e3,
        rest_m: 0.02,
    };
    let cogging = Cogging {
        force_n: 4.0,
        pitch_m: 0.03,
        phase_rad: 0.7,
    };
    mechanics.spring = Some(spring);
    mechanics.cogging = Some(cogging);
    let energy_j = |state: &MotionState| {
        let way_m = state.position_m - spring.rest_m;
        let of_spring =
            0.5 * spring.n_per_m * way_m.powi(2) + 0.25 * spring.n_per_m3 * way_m.powi(4);
        let turns = std::f64::consts::TAU * state.position_m / cogging.pitch_m + cogging.phase_rad;
        let of_teeth = -cogging.force_n * cogging.pitch_m / std::f64::consts::TAU * turns.cos();
        let of_motion = 0.5 * mechanics.mass_kg * state.speed_m_per_s.powi(2);
        of_motion + of_spring + of_teeth
    };
    let after = |mechanics: &Mechanics, seconds: f64| {
        let mut state = mechanics.at_rest(0.1);
        for step in 0..(seconds / DT_S).round() as u32 {
            state = mechanics.advance(&state, &pushed(0.0), f64::from(step) * DT_S, DT_S);
        }
        state
    };
    let begun_j = energy_j(&mechanics.at_rest(0.1));
    let (ended, drifted) = (after(&mechanics, 1.3), after(&drifting, 0.2));
    assert!(ended.speed_m_per_s.abs() > 0.05, "{ended:?}");
    assert!((energy_j(&ended) / begun_j - 1.0).abs() < 1e-3, "{ended:?}");
    // 3 N/s over 0.2 s are 0.06 N s.
    close(drifted.speed_m_per_s, 0.06 / mechanics.mass_kg, 1e-4);
}
