//! What to record to separate two effects.
//!
//! First what is known of the two together: a group of effects that imitate each
//! other, and the recording in which every one of them acts differently. Where
//! the two share no group, each has a recording of its own in which it shows
//! best. All of them need the command, the supply's knob, a payload or a plug,
//! and nothing that an axis does not have.

/// Effects that imitate each other, and the recording that separates any two of
/// them. The narrower a group, the further up: the first that holds both
/// speaks.
const GROUPS: &[(&[&str], &str)] = &[
    (
        &["valve-delay", "spool-dynamics"],
        "A chirp of the command from 5 to 200 Hz at fixed piston, at two amplitudes: a delay only shifts the response, a spool also attenuates it.",
    ),
    (
        &["slew-limit", "valve-delay", "spool-dynamics"],
        "Steps of the command of several sizes at fixed piston: a limited rate takes longer for a larger step, a lag or a delay does not.",
    ),
    (
        &[
            "valve-hysteresis",
            "valve-delay",
            "spool-dynamics",
            "slew-limit",
        ],
        "A slow triangle of the command through the valve's null at fixed piston, and the same ten times as fast: the hysteresis loop of a play keeps its width, that of a lag widens with the speed.",
    ),
    (
        &["pressure-sensor-lag", "position-time-skew"],
        "Short fill bursts at fixed piston: a sensor lag rounds the onset of the pressure, a time skew of the position has no effect.",
    ),
    (
        &[
            "position-time-skew",
            "valve-delay",
            "spool-dynamics",
            "slew-limit",
            "tube-line",
        ],
        "Bursts of the command at fixed piston: valve and tube act, a time skew of the position has no effect.",
    ),
    (
        &[
            "pressure-sensor-lag",
            "valve-delay",
            "spool-dynamics",
            "slew-limit",
            "valve-hysteresis",
        ],
        "Let the carriage swing freely with the valve held at its null: a sensor lag appears between position and pressure, the valve has no effect.",
    ),
    (
        &["tube-line", "dead-volume"],
        "Bursts at fixed piston at both ends of the stroke, and slow strokes with the valve at its null: a volume appears in both, the lag of a tube only in the bursts.",
    ),
    (
        &[
            "tube-line",
            "valve-delay",
            "spool-dynamics",
            "pressure-sensor-lag",
        ],
        "Bursts of the command at two amplitudes with the piston fixed at both ends of the stroke: the lag of a tube depends on the volume behind it and on the flow, the other lags do not.",
    ),
    (
        &["spool-dynamics", "valve-delay", "dead-volume"],
        "A chirp of the command at fixed piston at both ends of the stroke: a volume has ten times the effect at its own end, the lag of the valve is the same at both ends.",
    ),
    (
        &["dead-volume", "position-time-skew"],
        "Slow and fast strokes over the same travel: the effect of a volume does not depend on the speed, that of a time skew does.",
    ),
    (
        &["dead-volume", "gas-temperature-dynamics"],
        "Strokes from 0.05 to 1 Hz with the valve at its null: the effect of a volume does not depend on the speed, heat exchange makes slow strokes up to 1.4 times as compliant as fast ones.",
    ),
    (
        &["chamber-leakage", "piston-leakage"],
        "Hold the piston, shut the ports, and dwell a minute at equal pressures and a minute at unequal ones: the piston seal leaks only at unequal pressures, and the sum of the pressures stays constant.",
    ),
    (
        &[
            "wall-temperature",
            "variable-heat-transfer",
            "gas-temperature-dynamics",
        ],
        "Fill bursts of several strengths at fixed piston, each followed by a dwell of 10 s, from a cold start and again after ten minutes of full strokes: the heat transfer determines how fast the pressure settles, the wall temperature its final value.",
    ),
    (
        &[
            "chamber-leakage",
            "gas-temperature-dynamics",
            "variable-heat-transfer",
            "wall-temperature",
        ],
        "Fill, shut the valve and dwell for a minute, cold and warm: a leak continues to ambient pressure, heat exchange settles above it, at a pressure that follows the wall temperature.",
    ),
    (
        &[
            "supply-droop",
            "exhaust-back-pressure",
            "chamber-leakage",
            "piston-leakage",
        ],
        "Separate long fill bursts and long exhaust bursts, each followed by a dwell of 10 s, with the supply pressure recorded: a supply droop acts during filling and outlasts it, a silencer acts during exhausting, a leak continues during the dwell.",
    ),
    (
        &["exhaust-back-pressure", "tube-line"],
        "Large exhaust bursts with and without the silencer.",
    ),
    (
        &["supply-droop", "tube-line"],
        "Long fill bursts with the supply pressure recorded at the valve: a supply droop outlasts the flow by seconds, the pressure drop of a tube ends with it.",
    ),
    (
        &[
            "constant-force",
            "direction-dependent-friction",
            "gauge-gain",
            "pressure-sensor-offset",
        ],
        "Vent both chambers and record the sensors, then slow strokes in both directions, as mounted and turned end for end: a sensor offset appears in the vented recording, an external force changes its sign, directional friction keeps it.",
    ),
    (
        &[
            "position-dependent-friction",
            "constant-force",
            "direction-dependent-friction",
        ],
        "Strokes over the full travel at several constant speeds in both directions: friction changes its sign with the direction, a force does not; only position-dependent friction repeats at the same position.",
    ),
    (
        &[
            "end-cushion",
            "position-dependent-friction",
            "dead-volume",
            "constant-force",
        ],
        "Strokes to the end at two speeds and away from it again: friction changes its sign with the direction, a buffer pushes in both directions, a needle valve resists in proportion to the speed and only towards the end, a volume depends on neither.",
    ),
    (
        &[
            "dwell-stiction",
            "stribeck-friction",
            "coulomb-friction",
            "valve-hysteresis",
        ],
        "A ladder of rests from 0.1 to 300 s, each ended by the same slow ramp of force: only dwell stiction raises the break-away force with the time at rest.",
    ),
    (
        &[
            "load-compliance",
            "load-backlash",
            "coulomb-friction",
            "pressure-sensor-lag",
        ],
        "Sharp reversals at several accelerations, without and with 5 kg more: a spring also rings during sliding, and at a lower frequency with the payload; a play has the same width at every acceleration; presliding acts only at rest.",
    ),
    (
        &[
            "load-backlash",
            "stribeck-friction",
            "dwell-stiction",
            "valve-hysteresis",
        ],
        "Reversals at several accelerations with a small dither: a play is a constant distance at every acceleration, stiction a constant force.",
    ),
    (
        &[
            "viscous-friction",
            "coulomb-friction",
            "stribeck-friction",
            "direction-dependent-friction",
        ],
        "Strokes at four or more constant speeds from 1 to 500 mm/s in both directions, at one pressure.",
    ),
    (
        &[
            "pressure-dependent-friction",
            "coulomb-friction",
            "viscous-friction",
            "stribeck-friction",
            "direction-dependent-friction",
            "position-dependent-friction",
            "constant-force",
        ],
        "Strokes at four or more constant speeds in both directions, at each of three supply pressures.",
    ),
];

/// The recording in which each effect shows best.
const SHOWN_BY: &[(&str, &str)] = &[
    (
        "tube-line",
        "two fill bursts of different strength with the piston fixed at each end of the stroke",
    ),
    (
        "spool-dynamics",
        "a chirp of the command from 5 to 200 Hz at fixed piston, at two amplitudes",
    ),
    (
        "valve-hysteresis",
        "a triangle of the command of 60 s through the valve's null at fixed piston",
    ),
    (
        "valve-delay",
        "short bursts of the command at fixed piston, sampled as fast as the logger can",
    ),
    (
        "piston-leakage",
        "a minute's hold of the piston with shut ports and different pressures",
    ),
    (
        "chamber-leakage",
        "a minute's hold of the piston with shut ports and equal pressures",
    ),
    (
        "supply-droop",
        "several full strokes without a pause, then rest, with the supply pressure recorded",
    ),
    (
        "exhaust-back-pressure",
        "large exhaust bursts, with and without the silencer",
    ),
    (
        "gas-temperature-dynamics",
        "a fill burst at fixed piston and a dwell of 10 s with the valve at its null",
    ),
    (
        "variable-heat-transfer",
        "fill bursts of several strengths at fixed piston, each followed by a dwell of 10 s",
    ),
    (
        "wall-temperature",
        "a start from cold and ten minutes of full strokes",
    ),
    (
        "dead-volume",
        "slow strokes to both ends with the valve at its null",
    ),
    (
        "pressure-dependent-friction",
        "constant speeds in both directions at each of three supply pressures",
    ),
    (
        "position-dependent-friction",
        "slow strokes over the full travel at two constant speeds in both directions",
    ),
    (
        "direction-dependent-friction",
        "slow strokes in both directions, as mounted and turned end for end",
    ),
    (
        "dwell-stiction",
        "a ladder of rests from 0.1 to 300 s, each ended by the same slow ramp of force",
    ),
    (
        "stribeck-friction",
        "slow ramps of force through break-away, and constant speeds down to 1 mm/s",
    ),
    (
        "coulomb-friction",
        "a slow triangle of force with reversals below break-away",
    ),
    (
        "viscous-friction",
        "constant speeds from 1 to 500 mm/s in both directions",
    ),
    (
        "load-compliance",
        "sharp steps of force while sliding, without and with 5 kg more",
    ),
    (
        "load-backlash",
        "reversals at several accelerations with a small dither",
    ),
    (
        "constant-force",
        "slow strokes in both directions, as mounted and turned end for end",
    ),
    (
        "unknown-force",
        "strokes in both directions over the full travel at several constant speeds",
    ),
    (
        "unknown-opening",
        "strokes in both directions at several constant commands from the dead zone to fully open",
    ),
    (
        "unknown-reading",
        "both chambers at rest and connected, from ambient to supply pressure, with a reference gauge",
    ),
    ("end-cushion", "strokes to both ends at two speeds"),
    (
        "pressure-sensor-lag",
        "free swings of the carriage with the valve at its null",
    ),
    (
        "gauge-gain",
        "both chambers at rest and connected, from ambient to supply pressure, with a reference gauge",
    ),
    (
        "pressure-sensor-offset",
        "both chambers vented, then both at supply pressure",
    ),
    (
        "position-time-skew",
        "fast reversals with the valve at its null",
    ),
    (
        "slew-limit",
        "steps of the command of several sizes at fixed piston",
    ),
];

/// What to record to separate two effects.
pub fn separating(one: &str, other: &str) -> String {
    let together = GROUPS
        .iter()
        .find(|(effects, _)| effects.contains(&one) && effects.contains(&other));
    if let (Some((_, experiment)), true) = (together, one != other) {
        return (*experiment).to_owned();
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
    let known = SHOWN_BY.iter().find(|(name, _)| *name == effect)?;
    Some(known.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{EFFECTS, effect};

    #[test]
    fn prop_every_effect_of_the_catalogue_has_a_recording_that_shows_it() {
        for known in EFFECTS {
            assert!(shown_by(known.name).is_some(), "{}", known.name);
        }
        assert_eq!(SHOWN_BY.len(), EFFECTS.len());
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
        for (number, (effects, experiment)) in GROUPS.iter().enumerate() {
            for name in *effects {
                assert!(effect(name).is_some(), "{name}");
            }
            let pairs = effects
                .iter()
                .flat_map(|one| effects.iter().map(move |other| (one, other)));
            let speaks = pairs
                .filter(|(one, other)| one != other)
                .any(|(one, other)| separating(one, other) == *experiment);
            assert!(speaks, "group {number} is hidden by those before it");
        }
    }

    #[test]
    fn prop_the_order_of_two_known_rivals_does_not_matter() {
        for (effects, _) in GROUPS {
            for one in *effects {
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
            let together = GROUPS
                .iter()
                .any(|(effects, _)| effects.contains(&one) && effects.contains(&other));
            assert!(together, "{one} and {other}");
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
