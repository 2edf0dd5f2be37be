//! Sliding friction: a test machine moves the carriage at constant speeds in
//! both directions, ports open and at two pressures (figures 10 to 13 of the
//! seed paper).

use super::machine::{Machine, Moment};
use super::recording::{Channel, Noises, Recording};
use super::rig::{Rig, wrong};
use super::travel::{Piece, Travel};
use super::{BenchCase, Setup, truth};
use crate::case::nameplate::AREA_M2;
use crate::random::Random;

const ROWS_PER_S: f64 = 500.0;
/// Time at each speed, of each rest, and of each change between them.
const SLIDING_S: f64 = 2.0;
const REST_S: f64 = 0.3;
const CHANGE_S: f64 = 0.1;
/// Speeds with open ports, and under pressure.
const OPEN_MM_PER_S: [f64; 12] = [
    1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0, 35.0, 50.0, 75.0, 100.0,
];
const PRESSED_MM_PER_S: [f64; 4] = [2.0, 5.0, 20.0, 60.0];
/// Noise and step of the load cell, its zero error, and how far that moves.
const FORCE_NOISE_N: f64 = 0.3;
const FORCE_STEP_N: f64 = 0.06;
const FORCE_ZERO_N: f64 = 1.0;
const FORCE_DRIFT_N: f64 = 0.5;
/// Most that a regulator is off, and how slowly it wanders.
const REGULATOR_PA: f64 = 400.0;
const REGULATOR_TURN_S: f64 = 17.0;

pub(super) fn draw(setup: &mut Setup) -> BenchCase {
    let runs: [(&str, f64, &[f64]); 3] = [
        ("sliding-0bar.csv", 0.0, &OPEN_MM_PER_S),
        ("sliding-3bar.csv", 3e5, &PRESSED_MM_PER_S),
        ("sliding-5bar.csv", 5e5, &PRESSED_MM_PER_S),
    ];
    let mut recordings = Vec::new();
    for (recording, (name, gauge_pa, speeds)) in runs.into_iter().enumerate() {
        let held = Held::draw(&mut setup.random, gauge_pa);
        let travel = travel(speeds);
        let moments = slide(setup, &held, &travel);
        recordings.push(record(setup.noises, recording, name, &held, &moments));
    }
    let plate = &setup.axis.nameplate;
    let truth = truth([
        ("friction.viscous_Ns_m", plate.viscous_n_s_per_m),
        ("friction.coulomb_N", plate.coulomb_n),
        ("friction.static_N", plate.static_n),
        ("friction.stribeck_velocity_m_s", plate.stribeck_m_per_s),
        (
            "effects.pressure-dependent-friction.per_mean_pressure_N_Pa",
            setup.axis.friction_n_per_pa,
        ),
    ]);
    BenchCase {
        rig_toml: rig(setup),
        recordings,
        truth,
    }
}

/// The pressures that two regulators hold.
struct Held {
    gauge_pa: f64,
    error_pa: [f64; 2],
    phase_rad: [f64; 2],
}

impl Held {
    /// Open ports have exactly the pressure of the surroundings.
    fn draw(random: &mut Random, gauge_pa: f64) -> Self {
        let largest_pa = if gauge_pa > 0.0 { REGULATOR_PA } else { 0.0 };
        let turn_rad = 2.0 * core::f64::consts::PI;
        Self {
            gauge_pa,
            error_pa: [0, 1].map(|_| random.between(-largest_pa, largest_pa)),
            phase_rad: [0, 1].map(|_| random.between(0.0, turn_rad)),
        }
    }

    fn gauge_pa(&self, port: usize, time_s: f64) -> f64 {
        let angle_rad = 2.0 * core::f64::consts::PI * time_s / REGULATOR_TURN_S;
        let wandering = libm::sin(angle_rad + self.phase_rad[port]);
        self.gauge_pa + self.error_pa[port] * (1.0 + 0.5 * wandering)
    }

    fn gas_n(&self, time_s: f64) -> f64 {
        (self.gauge_pa(0, time_s) - self.gauge_pa(1, time_s)) * AREA_M2
    }
}

/// Each speed forwards and back.
fn travel(speeds_mm_per_s: &[f64]) -> Travel {
    let mut pieces = vec![rest()];
    for speed in speeds_mm_per_s {
        for direction in [1e-3, -1e-3] {
            pieces.push(Piece::Speed {
                duration_s: CHANGE_S + SLIDING_S,
                speed_m_per_s: direction * speed,
                change_s: CHANGE_S,
            });
            pieces.push(rest());
        }
    }
    Travel::new(-0.1, &pieces)
}

fn rest() -> Piece {
    Piece::Speed {
        duration_s: CHANGE_S + REST_S,
        speed_m_per_s: 0.0,
        change_s: CHANGE_S,
    }
}

fn slide(setup: &Setup, held: &Held, travel: &Travel) -> Vec<Moment> {
    let machine = Machine {
        friction: &setup.axis.friction(held.gauge_pa),
        mass_kg: setup.axis.nameplate.mass_kg,
        gas_n: &|time_s| held.gas_n(time_s),
    };
    machine.moments(travel, ROWS_PER_S)
}

fn record(
    noises: Noises,
    recording: usize,
    name: &str,
    held: &Held,
    moments: &[Moment],
) -> (String, String) {
    let duration_s = moments.len() as f64 / ROWS_PER_S;
    let mut position = noises.position(recording, 0);
    let mut force = Channel::new(noises.of(recording, 1), FORCE_NOISE_N, FORCE_STEP_N)
        .with_zero(FORCE_ZERO_N)
        .with_drift(FORCE_DRIFT_N, duration_s);
    let mut pressures = [2, 3].map(|channel| noises.pressure(recording, channel));
    let mut file = Recording::new(name, "t_s,x_mm,force_N,pa_bar,pb_bar");
    for moment in moments {
        let time_s = moment.time_s;
        let [a_pa, b_pa] =
            [0, 1].map(|port| pressures[port].reads(time_s, held.gauge_pa(port, time_s)));
        file.row([
            (time_s, 4),
            (1e3 * position.reads(time_s, moment.position_m), 5),
            (force.reads(time_s, moment.force_n), 3),
            (1e-5 * a_pa, 6),
            (1e-5 * b_pa, 6),
        ]);
    }
    file.finish()
}

fn rig(setup: &mut Setup) -> String {
    const DEVIATIONS: [f64; 4] = [0.3, 0.3, 0.3, 0.4];
    let plate = &setup.axis.nameplate;
    let [viscous, coulomb_n, static_n, stribeck] = [
        (plate.viscous_n_s_per_m, DEVIATIONS[0]),
        (plate.coulomb_n, DEVIATIONS[1]),
        (plate.static_n, DEVIATIONS[2]),
        (plate.stribeck_m_per_s, DEVIATIONS[3]),
    ]
    .map(|(value, deviation)| wrong(&mut setup.random, value, deviation));
    let mut rig = Rig::new();
    rig.position("x_mm", "mm");
    rig.signal("force", "force_N", "N", [FORCE_NOISE_N, FORCE_STEP_N]);
    rig.gauge_pressures();
    rig.surroundings();
    rig.cylinder(plate.dead_volume_m3);
    rig.section("carriage");
    rig.right("mass_kg", plate.mass_kg);
    rig.right("external_force_N", 0.0);
    rig.section("friction");
    rig.right(
        "bristle_stiffness_N_m",
        setup.axis.bristle_stiffness_n_per_m,
    );
    rig.right("bristle_damping_Ns_m", setup.axis.bristle_damping_n_s_per_m);
    rig.estimate("viscous_Ns_m", viscous);
    rig.estimate("coulomb_N", coulomb_n);
    // No engineer types a break-away force under the sliding one.
    rig.estimate("static_N", static_n.max(1.05 * coulomb_n));
    rig.estimate("stribeck_velocity_m_s", stribeck);
    rig.uncertain("friction.viscous_Ns_m", DEVIATIONS[0]);
    rig.uncertain("friction.coulomb_N", DEVIATIONS[1]);
    rig.uncertain("friction.static_N", DEVIATIONS[2]);
    rig.uncertain("friction.stribeck_velocity_m_s", DEVIATIONS[3]);
    rig.finish()
}

#[cfg(test)]
mod tests {
    use super::super::Experiment;
    use super::*;

    #[test]
    fn val_the_force_at_constant_speed_is_that_of_the_stribeck_curve() {
        // 250 rows are averaged: five standard errors of the noise, and the
        // drift between the two directions.
        const TOLERANCE_N: f64 = 0.15;
        let mut setup = Setup::new(Experiment::Friction, 5);
        let case = draw(&mut setup);
        let plate = &setup.axis.nameplate;
        let forces: Vec<f64> = case.recordings[0]
            .1
            .lines()
            .skip(1)
            .map(|row| row.split(',').nth(2).unwrap().parse().unwrap())
            .collect();
        let mean_n = |end_s: f64| {
            let end = (end_s * ROWS_PER_S) as usize;
            forces[end - 250..end].iter().sum::<f64>() / 250.0
        };
        let (sliding_s, rest_s) = (CHANGE_S + SLIDING_S, CHANGE_S + REST_S);
        for (number, speed) in OPEN_MM_PER_S.iter().map(|speed| 1e-3 * speed).enumerate() {
            let forwards_s = rest_s + 2.0 * number as f64 * (sliding_s + rest_s) + sliding_s;
            let back_s = forwards_s + rest_s + sliding_s;
            let got_n = 0.5 * (mean_n(back_s) - mean_n(forwards_s));
            let relative = speed / plate.stribeck_m_per_s;
            let expected_n = plate.coulomb_n
                + (plate.static_n - plate.coulomb_n) * libm::exp(-relative * relative)
                + plate.viscous_n_s_per_m * speed;
            assert!(
                (got_n - expected_n).abs() < TOLERANCE_N,
                "{speed} m/s: {got_n} N, expected {expected_n} N"
            );
        }
    }

    #[test]
    fn val_the_friction_grows_by_one_force_at_both_levels() {
        let setup = Setup::new(Experiment::Friction, 5);
        let [open, pressed] = [0.0, 5e5].map(|gauge_pa| setup.axis.friction(gauge_pa));
        let expected_n = 5e5 * setup.axis.friction_n_per_pa;
        for grown_n in [
            pressed.coulomb_n - open.coulomb_n,
            pressed.static_n - open.static_n,
        ] {
            assert!((grown_n - expected_n).abs() < 1e-9, "{grown_n} N");
        }
    }
}
