//! Parameters as a reader calls them, and how far the data moved them.

use crate::report::{BarChart, Role};
use crate::rig::ValveTable;

/// One parameter with what was known of it and what is known now.
pub(super) struct Moved {
    /// `section.key`.
    pub(super) key: String,
    /// In the rig file.
    pub(super) given: f64,
    /// One standard deviation of it.
    pub(super) prior_sd: f64,
    /// Fitted.
    pub(super) fitted: f64,
    /// One standard deviation; `None` where the data leave it open or at a bound.
    pub(super) fitted_sd: Option<f64>,
}

/// The key; of a table its scale factor, which is what a fit moves.
pub(super) fn label(key: &str) -> String {
    match ValveTable::from_key(key) {
        Some(_) => format!("scale factor of `{key}`"),
        None => format!("`{key}`"),
    }
}

/// Prior and posterior of each parameter in standard deviations of the prior.
pub(super) fn prior_to_posterior(parameters: &[Moved]) -> Option<BarChart> {
    if parameters.is_empty() {
        return None;
    }
    let shift = |one: &Moved| {
        let shift = (one.fitted - one.given) / one.prior_sd;
        (
            shift,
            one.fitted_sd.map_or(f64::NAN, |sd| sd / one.prior_sd),
        )
    };
    let names = parameters.iter().map(|one| label(&one.key));
    let chart = BarChart::new("Parameters: from prior to posterior", names)
        .axis("change from the rig file", "prior standard deviations")
        .digits(3)
        .bars_with_errors("prior", Role::Noise, parameters.iter().map(|_| (0.0, 1.0)))
        .bars_with_errors("posterior", Role::Improved, parameters.iter().map(shift))
        .note("Error bars: one standard deviation; none where the data leave the parameter open or it is at a bound. A posterior as wide as the prior: the recordings say nothing about the parameter. A change of more than four prior standard deviations contradicts the rig file; where most numbers come out further off than stated, the standard deviations are scaled first.");
    Some(chart)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_every_table_of_the_valve_is_said_to_be_scaled() {
        for table in ValveTable::ALL {
            assert!(label(table.key()).starts_with("scale factor of "));
        }
        assert_eq!(label("carriage.mass_kg"), "`carriage.mass_kg`");
    }
}
