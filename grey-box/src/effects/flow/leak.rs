//! What the leaks of chambers and piston have in common.

use crate::effects::mark::Mark;
use crate::effects::scene::{ChamberGas, Scene};

/// No data sheet says to better than this part what a closed path of the valve leaks: a leak
/// under it cannot be told from the valve's own.
const VALVE_LEAKAGE_KNOWN_TO: f64 = 0.1;
/// Times in which a leak lets out a chamber's gas, s: where fits of it begin.
const DECAYS_S: [f64; 2] = [100.0, 10.0];
/// The least leak is not quite nought: there a law may skip it, and its derivative with it.
const LEAST_OF_START: f64 = 1e-6;
const MOST_OF_START: f64 = 1e3;

/// Starts of a leak, and its box.
pub struct Leak {
    /// Largest first.
    pub starts: [f64; 2],
    /// Its box.
    pub bounds: (f64, f64),
}

impl Leak {
    fn from(starts: [f64; 2]) -> Self {
        Self {
            starts,
            bounds: (LEAST_OF_START * starts[0], MOST_OF_START * starts[1]),
        }
    }

    /// Through a gap, kg/(s Pa2).
    pub fn gap(gas: &ChamberGas) -> Self {
        Self::from(DECAYS_S.map(|decay_s| gas.mass_kg / decay_s / gas.pressure_pa.powi(2)))
    }

    /// Through a hole, m2.
    pub fn hole(gas: &ChamberGas) -> Self {
        Self::from(DECAYS_S.map(|decay_s| gas.mass_kg / decay_s / gas.choked_kg_s_m2))
    }
}

/// From which sizes on hole and gap matter: what an axis loses without anybody minding, or its
/// valve in any case.
pub fn marks(scene: &Scene<'_>, orifice_m2: f64, gap_kg_s_pa2: f64) -> [Option<Mark>; 2] {
    let valve = scene.rig.valve.as_ref();
    let closed_m2 = valve.and_then(|valve| valve.exhaust_area_m2.first());
    let of_valve_m2 = VALVE_LEAKAGE_KNOWN_TO * closed_m2.copied().unwrap_or(0.0);
    let times = (of_valve_m2 / orifice_m2).max(1.0);
    [orifice_m2, gap_kg_s_pa2].map(|least| scene.mark(Mark::From(times * least)))
}
