//! A silencer at the exhaust.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Numbers, PLAIN, parameter};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use model_core::left_out::ExhaustBackPressure;
use model_core::real::Real;

/// The largest silencer: three times the valve.
const SILENCER_M2: f64 = 5e-5;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "exhaust-back-pressure",
    what: "A silencer at the exhaust, with the volume before it.",
    parameters: &[
        parameter("silencer_area_m2", "m2", 0.0, 0.0, "orifice area of the silencer; 0 is none", "1 to 3 times the area of the valve").said("silencer area", "mm²"),
        parameter("volume_m3", "m3", 2e-5, 0.0, "volume between valve and silencer", "2e-5").said("volume", "cm³"),
    ],
    meaning: "the silencer keeps the exhaust above ambient pressure at high flow",
    shown_by: "large exhaust bursts, with and without the silencer",
    told_from: &[(&["tube-line"], "Large exhaust bursts with and without the silencer.")],
    candidates,
    ..PLAIN
};

/// Silencer and volume.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> ExhaustBackPressure<R> {
    ExhaustBackPressure {
        silencer_area_m2: EFFECT.number(numbers, "silencer_area_m2"),
        volume_m3: EFFECT.number(numbers, "volume_m3"),
    }
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if !scene.is_behind_valve() {
        return Vec::new();
    }
    let open_m2 = scene.open_valve_m2();
    let areas_m2 = [3.0 * open_m2, open_m2, 0.3 * open_m2];
    let silencer = Candidate::new(EFFECT.name, &["exhaust"])
        .free(
            "silencer_area_m2",
            (0.05 * open_m2, 50.0 * open_m2),
            &areas_m2,
        )
        .matters(scene.mark(Mark::UpTo(SILENCER_M2)))
        .free("volume_m3", (1e-6, 1e-3), &[2e-5]);
    vec![silencer]
}
