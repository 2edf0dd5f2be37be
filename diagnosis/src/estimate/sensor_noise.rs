//! Noise of the sensors, as declared or as recordings show it.

use crate::laws::{Law, Track, balance, white_noise};
use crate::rig::Rig;

/// Noise of each output, as the rig declares it, with the sensor's resolution;
/// where it does not, what the recordings show between neighbouring rows.
///
/// The estimate is an upper bound: a signal that moves within a row (a stem at
/// 1 Hz) looks like noise to it.
pub fn of_outputs(law: Law, rig: &Rig, tracks: &[Track<'_>]) -> Vec<f64> {
    if law == Law::Balance {
        let coulomb_n = rig.value("friction.coulomb_N").unwrap_or(0.0);
        return balance::own_noise_n(coulomb_n).to_vec();
    }
    law.outputs(rig)
        .iter()
        .map(|output| {
            let declared = declared(rig, output.signal).unwrap_or_else(|| {
                let columns = tracks
                    .iter()
                    .filter_map(|track| track.recording.signal(output.signal));
                columns.map(white_noise).fold(0.0, f64::max)
            });
            declared.max(1e-12)
        })
        .collect()
}

/// Declared noise of a signal with the quantisation error, SI.
pub(crate) fn declared(rig: &Rig, signal: &str) -> Option<f64> {
    let signal = rig.signals.get(signal)?;
    let step = signal.resolution.unwrap_or(0.0) / 12.0_f64.sqrt();
    signal.noise.map(|noise| noise.hypot(step))
}
