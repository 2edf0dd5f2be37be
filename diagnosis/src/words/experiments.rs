//! What to record to separate two effects.
//!
//! First what is known of the two together: a group of effects that imitate each
//! other, and the recording in which every one of them acts differently. Where
//! the two share no group, each has a recording of its own in which it shows
//! best. Both stand with the effects' declarations. All of them need the command, the supply's knob, a payload or a plug,
//! and nothing that an axis does not have.

use crate::effects::{self, EFFECTS, Effect};

/// What to record to separate two effects.
pub fn separating(one: &str, other: &str) -> String {
    if let Some(experiment) = together(one, other) {
        return experiment.to_owned();
    }
    match (shown_by(one), shown_by(other)) {
        (Some(first), Some(second)) if first == second => format!("Record {first}."),
        (Some(first), Some(second)) => {
            format!("Make two recordings: for {one} {first}; for {other} {second}.")
        }
        _ => format!("A recording in which {one} and {other} act at different times or speeds."),
    }
}

/// What to record to exclude effects that these recordings cannot show.
pub fn ruling_out(effects: &[&str]) -> String {
    let one = |effect: &&str| {
        Some(format!(
            "{} ({})",
            shown_by(effect)?,
            effect.replace('-', " ")
        ))
    };
    let few: Vec<String> = effects.iter().filter_map(one).collect();
    if few.is_empty() || few.len() > MOST_TOGETHER {
        return "To exclude the effects that these recordings cannot show, record strokes at several speeds, with sharp reversals and with rests.".into();
    }
    format!(
        "To exclude the effects that these recordings cannot show, record {}.",
        few.join("; ")
    )
}

/// What to record, and to hold out, that confirms effects or refutes them.
pub fn bearing_out(effects: &[&str]) -> Option<String> {
    let shown: Vec<&str> = effects
        .iter()
        .filter_map(|effect| shown_by(effect))
        .collect();
    (!shown.is_empty()).then(|| {
        format!(
            "To confirm the finding, record {}, and give this recording with --held-out.",
            shown.join("; ")
        )
    })
}

/// Where more effects than this are to be ruled out, one varied motion does it.
const MOST_TOGETHER: usize = 3;

fn shown_by(effect: &str) -> Option<&'static str> {
    Some(effects::effect(effect)?.shown_by)
}

/// A group of effects that imitate each other, and the recording that separates any two of them.
struct Imitators {
    effects: Vec<&'static str>,
    recording: &'static str,
}

fn groups() -> impl Iterator<Item = Imitators> {
    let of_effect = |effect: &'static Effect| {
        effect.told_from.iter().map(|(others, recording)| {
            let all = std::iter::once(effect.name).chain(others.iter().copied());
            Imitators {
                effects: all.collect(),
                recording,
            }
        })
    };
    EFFECTS.iter().flat_map(of_effect)
}

/// What is known of two effects together: the narrowest group that holds both speaks.
fn together(one: &str, other: &str) -> Option<&'static str> {
    let holds_both = |group: &Imitators| {
        one != other && [one, other].iter().all(|name| group.effects.contains(name))
    };
    let narrowest = groups()
        .filter(holds_both)
        .min_by_key(|group| group.effects.len())?;
    Some(narrowest.recording)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_every_effect_of_the_catalogue_has_a_recording_that_shows_it() {
        for known in EFFECTS {
            assert!(!known.shown_by.is_empty(), "{}", known.name);
        }
    }

    #[test]
    fn prop_what_bears_an_effect_out_is_what_shows_it() {
        let said = bearing_out(&["dwell-stiction"]).unwrap();
        assert!(
            said.contains("a ladder of rests") && said.contains("--held-out"),
            "{said}"
        );
        assert_eq!(bearing_out(&["no-effect"]), None);
    }

    #[test]
    fn prop_experiments_name_only_effects_of_the_catalogue_and_none_is_out_of_reach() {
        for group in groups() {
            let names = &group.effects;
            for name in names {
                assert!(effects::effect(name).is_some(), "{name}");
            }
            let pairs = names
                .iter()
                .flat_map(|one| names.iter().map(move |other| (one, other)));
            let speaks = pairs
                .filter(|(one, other)| one != other)
                .any(|(one, other)| separating(one, other) == group.recording);
            assert!(speaks, "{names:?} is hidden by narrower groups");
        }
    }

    #[test]
    fn prop_the_order_of_two_known_rivals_does_not_matter() {
        for Imitators { effects, .. } in groups() {
            for one in &effects {
                for other in effects.iter().filter(|other| *other != one) {
                    assert_eq!(separating(one, other), separating(other, one));
                }
            }
        }
    }

    /// Pairs whose residuals, after a refit, had a cosine of 0.6 and more in a
    /// simulated study of excitations, or that are known to be one as good as
    /// the other.
    #[test]
    fn prop_effects_known_to_be_confused_have_an_experiment_of_their_own() {
        let confused = [
            ("valve-delay", "spool-dynamics"),
            ("valve-delay", "position-time-skew"),
            ("valve-delay", "pressure-sensor-lag"),
            ("spool-dynamics", "pressure-sensor-lag"),
            ("pressure-sensor-lag", "position-time-skew"),
            ("tube-line", "valve-delay"),
            ("tube-line", "spool-dynamics"),
            ("tube-line", "dead-volume"),
            ("tube-line", "exhaust-back-pressure"),
            ("supply-droop", "exhaust-back-pressure"),
            ("supply-droop", "chamber-leakage"),
            ("exhaust-back-pressure", "chamber-leakage"),
            ("wall-temperature", "variable-heat-transfer"),
            ("wall-temperature", "gas-temperature-dynamics"),
            ("constant-force", "direction-dependent-friction"),
            ("constant-force", "pressure-sensor-offset"),
            ("direction-dependent-friction", "pressure-sensor-offset"),
            ("gauge-gain", "pressure-sensor-offset"),
            ("load-compliance", "load-backlash"),
            ("load-compliance", "coulomb-friction"),
            ("dwell-stiction", "stribeck-friction"),
            ("end-cushion", "position-dependent-friction"),
        ];
        for (one, other) in confused {
            assert!(together(one, other).is_some(), "{one} and {other}");
        }
    }

    #[test]
    fn regress_strangers_get_a_recording_each() {
        let text = separating("wall-temperature", "load-backlash");
        assert!(
            text.contains("from cold") && text.contains("dither"),
            "{text}"
        );
    }
}
