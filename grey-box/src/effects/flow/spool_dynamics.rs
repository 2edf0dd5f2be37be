//! A spool that lags behind its command.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Numbers, PLAIN, parameter};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use model_core::left_out::SpoolDynamics;
use model_core::real::Real;

/// Half a row of lag behind a ramp, 2 zeta / w at zeta = 0.7: the order of a logger.
const ROWS_PER_PERIOD: f64 = 0.45;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "spool-dynamics",
    what: "The spool follows the command as a second-order lag.",
    parameters: &[
        parameter("natural_frequency_Hz", "Hz", 0.0, 0.0, "natural frequency; 0 is an ideal spool", "60 to 130").said("natural frequency", "Hz"),
        parameter("damping_ratio", "1", 0.7, 0.0, "damping ratio", "0.6 to 0.9").said("damping ratio", ""),
    ],
    meaning: "the spool follows the command as a second-order lag",
    shown_by: "a chirp of the command from 5 to 200 Hz at fixed piston, at two amplitudes",
    told_from: &[
        (&["valve-delay"], "A chirp of the command from 5 to 200 Hz at fixed piston, at two amplitudes: a delay only shifts the response, a spool also attenuates it."),
        (&["valve-delay", "dead-volume"], "A chirp of the command at fixed piston at both ends of the stroke: a volume has ten times the effect at its own end, the lag of the valve is the same at both ends."),
    ],
    candidates,
    ..PLAIN
};

/// The spool's motion.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> SpoolDynamics<R> {
    SpoolDynamics {
        natural_frequency_hz: EFFECT.number(numbers, "natural_frequency_Hz"),
        damping_ratio: EFFECT.number(numbers, "damping_ratio"),
    }
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if !scene.follows_spool() {
        return Vec::new();
    }
    let row_s = scene.row_s;
    let starts_hz = [0.08, 0.03, 0.012].map(|share| share / row_s);
    let spool = Candidate::new(EFFECT.name, &["valve-command"])
        .free("natural_frequency_Hz", (3.0, 1.0 / row_s), &starts_hz)
        .matters(scene.mark(Mark::UpTo(ROWS_PER_PERIOD / row_s)))
        .free("damping_ratio", (0.3, 2.0), &[0.7]);
    vec![spool]
}
