//! The whole axis of a bench's seed, to be driven: what its experiments measured in parts.

use super::axis::Axis;
use crate::plant::friction::Friction;
use crate::plant::line::Line;
use crate::plant::valve::CommandPath;
use crate::plant::{Physics, Plant, Start};

/// Points of the valve's smooth curve, V: chords between them are within 1e-4 of it.
const POINTS: usize = 501;
const WIDEST_V: f64 = 5.5;

/// Inner diameter of the tubes, m.
const TUBE_DIAMETER_M: f64 = 4e-3;

/// The axis at rest at a position, both chambers at a pressure. `recording` tells the noise of one
/// run from that of another.
pub fn axis_in_motion(seed: u64, recording: usize, at: (f64, f64)) -> Plant {
    at_rest(physics(&Axis::draw(seed)), (seed, recording), at)
}

/// The same axis with tubes of that length between valve and cylinder.
pub fn axis_behind_tubes(seed: u64, recording: usize, at: (f64, f64), length_m: f64) -> Plant {
    let mut physics = physics(&Axis::draw(seed));
    physics.network.line = Some(Line::new(length_m, TUBE_DIAMETER_M));
    at_rest(physics, (seed, recording), at)
}

fn at_rest(
    physics: Physics,
    (seed, recording): (u64, usize),
    (position_m, pressure_pa): (f64, f64),
) -> Plant {
    let start = Start {
        position_m,
        pressure_pa: [pressure_pa; 2],
        seed,
        recording,
    };
    Plant::new(physics, start)
}

fn physics(axis: &Axis) -> Physics {
    let mut physics = axis.nameplate.physics(1.0);
    let openings_v: Vec<f64> = (0..POINTS)
        .map(|point| WIDEST_V * point as f64 / (POINTS - 1) as f64)
        .collect();
    physics.areas.supply_m2 = openings_v.iter().map(|one| axis.supply_m2(*one)).collect();
    physics.areas.openings_v = openings_v;
    physics.command = CommandPath {
        delay_s: axis.delay_s,
        plays: vec![axis.play],
        spool: Some(axis.spool),
        ..CommandPath::default()
    };
    physics.mechanics.friction = Friction {
        per_mean_pressure_n_per_pa: axis.friction_n_per_pa,
        ..axis.friction(0.0)
    };
    physics
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The axis runs away from the side that is fed, and stands at the null.
    #[test]
    fn val_a_step_feeds_the_side_that_it_says() {
        for (opening_v, sign) in [(1.0, 1.0), (-1.0, -1.0)] {
            let mut plant = axis_in_motion(3, 0, (0.0, 4e5));
            let null_v = Axis::draw(3).nameplate.null_v;
            for _ in 0..1000 {
                plant.advance(null_v);
            }
            let rested_m = plant.motion().position_m;
            for _ in 0..300 {
                plant.advance(null_v + opening_v);
            }
            assert!(sign * (plant.motion().position_m - rested_m) > 0.02);
        }
    }
}
