//! Masking: the ordinary numbers of the rig file are fitted to the affected
//! recordings before the tool sees it, as an engineer does who does not know of
//! the effect. The numbers are then wrong in just the way that hides it best.

use super::refit::{Misfit, Refit, Seen, misfits};
use serde::{Deserialize, Serialize};

/// How much a fit has hidden.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Masking {
    /// Energy that the effect adds to the misfit of a rig whose numbers were
    /// fitted without it, in units of the misfit without it.
    pub raw_energy: f64,
    /// The same with the numbers fitted to the affected recordings.
    pub left_energy: f64,
    /// Part of the energy that is hidden.
    pub hidden_share: f64,
}

/// What a fit to the affected training recordings hides. `clean` is the refit of
/// the plant without effects. The error is one line.
pub fn masking(affected: &Seen, masked: &Refit, clean: &Refit) -> Result<Masking, String> {
    let honest = misfits(&clean.rig, &affected.train)?;
    let raw_energy = energy_above(&honest, &clean.train);
    let left_energy = energy_above(&masked.train, &clean.train);
    Ok(Masking {
        raw_energy,
        left_energy,
        hidden_share: hidden_share(raw_energy, left_energy),
    })
}

fn hidden_share(raw: f64, left: f64) -> f64 {
    if raw > 0.0 {
        (1.0 - left / raw).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// Relative energy above a floor, summed over the outputs that both have.
fn energy_above(misfits: &[Misfit], floor: &[Misfit]) -> f64 {
    let above = |misfit: &Misfit| {
        let floor = floor.iter().find(|one| one.output == misfit.output)?;
        (floor.mean_square > 0.0).then(|| misfit.mean_square / floor.mean_square - 1.0)
    };
    misfits
        .iter()
        .filter_map(above)
        .map(|above| above.max(0.0))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn misfit(mean_square: f64) -> Vec<Misfit> {
        vec![Misfit {
            output: "chambers p_a 1".into(),
            mean_square,
            independent: 100.0,
        }]
    }

    #[test]
    fn prop_energies_count_from_the_floor() {
        let (raw, left) = (
            energy_above(&misfit(9.0), &misfit(1.0)),
            energy_above(&misfit(3.0), &misfit(1.0)),
        );
        assert!((raw - 8.0).abs() < 1e-12 && (left - 2.0).abs() < 1e-12);
        assert!((hidden_share(raw, left) - 0.75).abs() < 1e-12);
        assert!(hidden_share(0.0, 1.0).abs() < 1e-12);
    }
}
