//! Presliding: displacements of micrometres and reversals, both chambers at
//! 3 bar gauge, with an interferometer.

use super::machine::{Machine, Moment};
use super::recording::{Channel, Noises, Recording};
use super::rig::{Rig, wrong};
use super::travel::{Piece, Travel};
use super::{BenchCase, Setup, truth};
use crate::plant::friction::Friction;
use crate::random::Random;

const ROWS_PER_S: f64 = 1000.0;
const GAUGE_PA: f64 = 3e5;
const AMPLITUDES_M: [f64; 5] = [4e-6, 8e-6, 15e-6, 30e-6, 60e-6];
/// Time in which the machine turns round.
const CHANGE_S: f64 = 0.02;
/// The interferometer.
const POSITION_NOISE_M: f64 = 0.1e-6;
const POSITION_STEP_M: f64 = 0.05e-6;
/// Noise and step of a load cell that was set to zero before, and how far its
/// zero moves.
const FORCE_NOISE_N: f64 = 0.2;
const FORCE_STEP_N: f64 = 0.03;
const FORCE_DRIFT_N: f64 = 0.2;

pub(super) fn draw(setup: &mut Setup) -> BenchCase {
    let friction = setup.axis.friction(GAUGE_PA);
    let travel = travel(&mut setup.random);
    let machine = Machine {
        friction: &friction,
        mass_kg: setup.axis.nameplate.mass_kg,
        gas_n: &|_| 0.0,
    };
    let moments = machine.moments(&travel, ROWS_PER_S);
    let truth = truth([
        ("friction.bristle_stiffness_N_m", friction.stiffness_n_per_m),
        ("friction.bristle_damping_Ns_m", friction.damping_n_s_per_m),
        ("friction.coulomb_N", friction.coulomb_n),
        ("friction.static_N", friction.static_n),
    ]);
    BenchCase {
        rig_toml: rig(setup, &friction),
        recordings: vec![record(setup.noises, &moments)],
        truth,
    }
}

/// A sine and a triangle of each amplitude, then reversals over 2 mm at 2 mm/s
/// and over 10 mm at 25 mm/s. At 2 mm/s the slip force is nearly the static
/// one; only the fast ones show the Coulomb level.
fn travel(random: &mut Random) -> Travel {
    let mut pieces = vec![speed(0.2, 0.0)];
    for amplitude_m in AMPLITUDES_M {
        let frequency_hz = random.between(1.0, 2.0);
        pieces.push(Piece::Sine {
            duration_s: 3.0 / frequency_hz,
            amplitude_m,
            frequency_hz,
        });
        let period_s = 1.0 / random.between(0.5, 1.0);
        triangle(&mut pieces, 2, period_s, 4.0 * amplitude_m / period_s);
    }
    triangle(&mut pieces, 2, 2.0, 2e-3);
    triangle(&mut pieces, 3, 0.8, 25e-3);
    pieces.push(speed(0.2, 0.0));
    Travel::new(0.0, &pieces)
}

/// Forwards and back at a speed, about the start.
fn triangle(pieces: &mut Vec<Piece>, periods: usize, period_s: f64, m_per_s: f64) {
    pieces.push(speed(0.25 * period_s, m_per_s));
    for half in 1..2 * periods {
        let direction = if half % 2 == 0 { 1.0 } else { -1.0 };
        pieces.push(speed(0.5 * period_s, direction * m_per_s));
    }
    pieces.push(speed(0.25 * period_s, m_per_s));
    pieces.push(speed(0.1, 0.0));
}

fn speed(duration_s: f64, speed_m_per_s: f64) -> Piece {
    Piece::Speed {
        duration_s,
        speed_m_per_s,
        change_s: CHANGE_S,
    }
}

fn record(noises: Noises, moments: &[Moment]) -> (String, String) {
    let duration_s = moments.len() as f64 / ROWS_PER_S;
    let mut position = Channel::new(noises.of(0, 0), POSITION_NOISE_M, POSITION_STEP_M);
    let mut force = Channel::new(noises.of(0, 1), FORCE_NOISE_N, FORCE_STEP_N)
        .with_drift(FORCE_DRIFT_N, duration_s);
    let mut pressures = [2, 3].map(|channel| noises.pressure(0, channel));
    let mut file = Recording::new("reversals.csv", "t_s,x_um,force_N,pa_bar,pb_bar");
    for moment in moments {
        let time_s = moment.time_s;
        let [a_pa, b_pa] = [0, 1].map(|port| pressures[port].reads(time_s, GAUGE_PA));
        file.row([
            (time_s, 4),
            (1e6 * position.reads(time_s, moment.position_m), 3),
            (force.reads(time_s, moment.force_n), 3),
            (1e-5 * a_pa, 6),
            (1e-5 * b_pa, 6),
        ]);
    }
    file.finish()
}

fn rig(setup: &mut Setup, friction: &Friction) -> String {
    const DEVIATIONS: [f64; 4] = [0.5, 0.5, 0.25, 0.25];
    let [stiffness, damping, coulomb_n, static_n] = [
        (friction.stiffness_n_per_m, DEVIATIONS[0]),
        (friction.damping_n_s_per_m, DEVIATIONS[1]),
        (friction.coulomb_n, DEVIATIONS[2]),
        (friction.static_n, DEVIATIONS[3]),
    ]
    .map(|(value, deviation)| wrong(&mut setup.random, value, deviation));
    let mut rig = Rig::new();
    rig.signal("x", "x_um", "um", [POSITION_NOISE_M, POSITION_STEP_M]);
    rig.signal("force", "force_N", "N", [FORCE_NOISE_N, FORCE_STEP_N]);
    rig.gauge_pressures();
    rig.surroundings();
    rig.cylinder(setup.axis.nameplate.dead_volume_m3);
    rig.section("carriage");
    rig.right("mass_kg", setup.axis.nameplate.mass_kg);
    rig.right("external_force_N", 0.0);
    rig.section("friction");
    rig.estimate("bristle_stiffness_N_m", stiffness);
    rig.estimate("bristle_damping_Ns_m", damping);
    rig.right("viscous_Ns_m", friction.viscous_n_s_per_m);
    rig.estimate("coulomb_N", coulomb_n);
    // No engineer types a break-away force under the sliding one.
    rig.estimate("static_N", static_n.max(1.05 * coulomb_n));
    rig.right("stribeck_velocity_m_s", friction.stribeck_m_per_s);
    rig.uncertain("friction.bristle_stiffness_N_m", DEVIATIONS[0]);
    rig.uncertain("friction.bristle_damping_Ns_m", DEVIATIONS[1]);
    rig.uncertain("friction.coulomb_N", DEVIATIONS[2]);
    rig.uncertain("friction.static_N", DEVIATIONS[3]);
    rig.finish()
}

#[cfg(test)]
mod tests {
    use super::super::Experiment;
    use super::*;

    #[test]
    fn val_the_least_sine_bends_the_bristle_without_slip() {
        // 4 um and 4e5 to 12e5 N/m: below the slip force the contact is a
        // spring to within the share of the slip force that the bend uses.
        let mut setup = Setup::new(Experiment::Presliding, 3);
        let friction = setup.axis.friction(GAUGE_PA);
        let travel = travel(&mut setup.random);
        let machine = Machine {
            friction: &friction,
            mass_kg: setup.axis.nameplate.mass_kg,
            gas_n: &|_| 0.0,
        };
        let moments = machine.moments(&travel, ROWS_PER_S);
        let first = moments
            .iter()
            .find(|moment| moment.position_m > 0.5e-6)
            .unwrap();
        let spring_n = friction.stiffness_n_per_m * first.position_m;
        assert!(
            (first.force_n / -spring_n - 1.0).abs() < 0.1,
            "{} N, a spring has {spring_n} N",
            first.force_n
        );
    }
}
