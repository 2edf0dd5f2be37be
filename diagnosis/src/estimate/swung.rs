//! The recording as it would be had part of the mass that moved in it hung behind a spring.
//!
//! ```text
//! M1 v1' = M a - F,   M2 v2' = F          M a: what moved the whole mass as recorded
//! ```
//!
//! A load run behind the recorded motion does not tell what such a load would have shown: the
//! noise of the position swings it, and the motion still holds what it would have taken out.
//! The force that moved the rigid mass moves both here, and the recorded position, noise and
//! all, is moved by what the carriage then leaves its way. Pressures stay as they are.
//!
//! Where the carriage stands its friction holds it, and the load swings on alone.

use crate::laws::{Motion, STANDING_M_PER_S, Track};
use crate::recording::Recording;
use model_core::friction::FrictionStep;
use model_core::left_out::{LoadCoupling, LoadState};

/// The recording of a carriage of this mass, load and all; none without a position.
pub(crate) fn swung(
    track: &Track<'_>,
    mass_kg: f64,
    load: &LoadCoupling<f64>,
) -> Option<(Recording, Motion)> {
    let recorded = track.motion.as_ref()?;
    let velocity_m_per_s = &recorded.velocity_m_per_s;
    let load = load.within(mass_kg);
    let mut swung = track.recording.clone();
    let position_m = swung.signals.get_mut("x")?;
    let mut state = LoadState::RIGID;
    let (mut off_m, mut off_m_per_s) = (0.0, 0.0);
    for row in 1..track.len() {
        let dt_s = track.dt_s(row - 1);
        let [from, to] = [velocity_m_per_s[row - 1], velocity_m_per_s[row]];
        let before = off_m_per_s;
        if to.abs() < STANDING_M_PER_S {
            load.follow(&mut state, from + before, to, dt_s);
            off_m_per_s = 0.0;
        } else {
            let moving_n = mass_kg * (to - from) / dt_s;
            let alone_kg = mass_kg - load.load_mass_kg;
            let moved = load.step(&mut state, from + before, dt_s, |reaction| {
                let net_n = moving_n - reaction.force_n;
                let change = net_n * dt_s / (alone_kg + reaction.added_mass_kg);
                FrictionStep {
                    middle_velocity_m_per_s: from + before + 0.5 * change,
                    velocity_m_per_s: from + before + change,
                    deflection_m: 0.0,
                    force_n: 0.0,
                }
            });
            off_m_per_s = moved.velocity_m_per_s - to;
        }
        off_m += 0.5 * (before + off_m_per_s) * dt_s;
        position_m[row] += off_m;
    }
    let motion = Motion::with_half_width(&swung.time_s, position_m, recorded.half_width);
    Some((swung, motion))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use std::f64::consts::TAU;

    const RATE_HZ: f64 = 3.0;
    const AMPLITUDE_M: f64 = 0.01;

    /// A carriage that sways as it goes and never stands.
    fn swaying() -> Recording {
        let time_s: Vec<f64> = (0..2000).map(|row| f64::from(row) * 1e-3).collect();
        let position_m = |t: &f64| 0.3 * t + AMPLITUDE_M * (TAU * RATE_HZ * t).sin();
        let x = time_s.iter().map(position_m).collect();
        Recording::from_signals("swaying", time_s, BTreeMap::from([("x".to_owned(), x)]))
    }

    /// Well below its resonance a load lags by M2 a / k, and the carriage is ahead of where both
    /// together are by its part of that, M2 / M.
    #[test]
    fn val_a_carriage_leaves_its_way_as_its_load_gives_way() {
        let recording = swaying();
        let mass_kg = 2.0;
        for stiffness_n_per_m in [5e4, 1e5, 1e9] {
            let load = LoadCoupling {
                load_mass_kg: 1.2,
                stiffness_n_per_m,
                damping_n_s_per_m: 100.0,
                gap_m: 0.0,
            };
            let (swung, _) = swung(&Track::new(&recording), mass_kg, &load).unwrap();
            let per_acceleration = load.load_mass_kg.powi(2) / (mass_kg * stiffness_n_per_m);
            let most = per_acceleration * AMPLITUDE_M * (TAU * RATE_HZ).powi(2);
            // What the start sets swinging has died away by half of it.
            for row in 1000..1990 {
                let phase = TAU * RATE_HZ * recording.time_s[row];
                let ahead_m = -most * phase.sin();
                let off_m = swung.signals["x"][row] - recording.signals["x"][row];
                let tolerance_m = 0.07 * most + 1e-9;
                assert!(
                    (off_m - ahead_m).abs() < tolerance_m,
                    "{row}: {off_m} for {ahead_m}"
                );
            }
        }
    }
}
