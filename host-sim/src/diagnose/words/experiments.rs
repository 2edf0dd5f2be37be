//! What to record to tell two effects apart.
//!
//! First what is known of the two together: a group of effects that imitate each
//! other, and the recording in which every one of them acts differently. Where
//! the two share no group, each has a recording of its own in which it shows
//! best. All of them need the command, the supply's knob, a payload or a plug,
//! and nothing that an axis does not have.

/// Effects that imitate each other, and the recording that tells any two of
/// them apart. The narrower a group, the further up: the first that holds both
/// speaks.
const GROUPS: &[(&[&str], &str)] = &[
    (
        &["valve-delay", "spool-dynamics"],
        "A chirp of the command from 5 to 200 Hz at fixed piston, at two amplitudes: a delay only shifts it, a spool also weakens it.",
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
        "A slow triangle of the command through the valve's null at fixed piston, and the same ten times as fast: the loop of a play stays as wide, that of a lag grows with the speed.",
    ),
    (
        &["pressure-sensor-lag", "position-time-skew"],
        "Short fill bursts at fixed piston: a sensor's lag rounds the onset of the pressure, a skew of the position has nothing to act on.",
    ),
    (
        &[
            "position-time-skew",
            "valve-delay",
            "spool-dynamics",
            "slew-limit",
            "tube-line",
        ],
        "Bursts of the command at fixed piston: valve and tube act there, a skew of the position has nothing to act on.",
    ),
    (
        &[
            "pressure-sensor-lag",
            "valve-delay",
            "spool-dynamics",
            "slew-limit",
            "valve-hysteresis",
        ],
        "Let the carriage swing freely with the valve held at its null: a sensor's lag shows between position and pressure, the valve does nothing.",
    ),
    (
        &["tube-line", "dead-volume"],
        "Bursts at fixed piston at both ends of the stroke, and slow strokes with the valve at its null: a volume shows in both, a tube's lag in the bursts alone.",
    ),
    (
        &[
            "tube-line",
            "valve-delay",
            "spool-dynamics",
            "pressure-sensor-lag",
        ],
        "Bursts of the command at two amplitudes with the piston fixed at both ends of the stroke: a tube's lag depends on the volume behind it and on the flow, the others do not.",
    ),
    (
        &["spool-dynamics", "valve-delay", "dead-volume"],
        "A chirp of the command at fixed piston at both ends of the stroke: a volume counts ten times as much at its own end, the valve's lag is the same at both.",
    ),
    (
        &["dead-volume", "position-time-skew"],
        "Slow and fast strokes over the same way: a volume does not depend on the speed, a skew does.",
    ),
    (
        &["dead-volume", "gas-temperature-dynamics"],
        "Strokes from 0.05 to 1 Hz with the valve at its null: a volume does not depend on the speed, heat exchange makes slow strokes up to 1.4 times as soft as fast ones.",
    ),
    (
        &["chamber-leakage", "piston-leakage"],
        "Hold the piston, shut the ports, and dwell a minute at equal pressures and a minute at unequal ones: the piston's seal passes gas only where they differ, and then their sum stays.",
    ),
    (
        &[
            "wall-temperature",
            "variable-heat-transfer",
            "gas-temperature-dynamics",
        ],
        "Fill bursts of several strengths at fixed piston, each with ten seconds' dwell, from a cold start and again after ten minutes of full strokes: the transfer sets how fast the pressure settles, the wall where.",
    ),
    (
        &[
            "chamber-leakage",
            "gas-temperature-dynamics",
            "variable-heat-transfer",
            "wall-temperature",
        ],
        "Fill, shut the valve and dwell for a minute, cold and warm: a leak goes on towards ambient pressure, heat exchange settles above it, and where it settles follows the wall.",
    ),
    (
        &[
            "supply-droop",
            "exhaust-back-pressure",
            "chamber-leakage",
            "piston-leakage",
        ],
        "Long fill bursts and long exhaust bursts apart, each with ten seconds' dwell, the supply's pressure recorded: a droop acts while filling and outlasts it, a silencer while exhausting, a leak goes on in the dwell.",
    ),
    (
        &["exhaust-back-pressure", "tube-line"],
        "Large exhaust bursts with and without the silencer.",
    ),
    (
        &["supply-droop", "tube-line"],
        "Long fill bursts with the supply's pressure recorded at the valve: a droop outlasts the flow by seconds, a tube's drop ends with it.",
    ),
    (
        &[
            "constant-force",
            "direction-dependent-friction",
            "pressure-sensor-offset",
        ],
        "Vent both chambers and record the sensors, then slow strokes both ways, as mounted and turned end for end: an offset shows vented, a force from outside changes its sign, a friction that depends on the direction stays with the drive.",
    ),
    (
        &[
            "position-dependent-friction",
            "constant-force",
            "direction-dependent-friction",
        ],
        "Strokes over the whole way at a few constant speeds in both directions: friction turns with the direction and a force does not; only what depends on the position repeats at its place.",
    ),
    (
        &[
            "end-cushion",
            "position-dependent-friction",
            "dead-volume",
            "constant-force",
        ],
        "Strokes to the end at two speeds and away from it again: friction turns with the direction, a buffer pushes both ways, a needle resists with the speed and only towards the end, a volume does not care for either.",
    ),
    (
        &[
            "dwell-stiction",
            "stribeck-friction",
            "coulomb-friction",
            "valve-hysteresis",
        ],
        "A ladder of rests from 0.1 to 300 s, each ended by the same slow ramp of force: only stiction that grows with the rest breaks away later.",
    ),
    (
        &[
            "load-compliance",
            "load-backlash",
            "coulomb-friction",
            "pressure-sensor-lag",
        ],
        "Sharp reversals at several accelerations, without and with 5 kg more: a spring rings while sliding too, and slower with the payload; a play is the same way at every acceleration; a bristle acts only while sticking.",
    ),
    (
        &[
            "load-backlash",
            "stribeck-friction",
            "dwell-stiction",
            "valve-hysteresis",
        ],
        "Reversals at several accelerations with a little dither: a play is the same way at every acceleration, stiction a force.",
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
        "a few full strokes without a pause, then rest, the supply's pressure recorded",
    ),
    (
        "exhaust-back-pressure",
        "large exhaust bursts, with and without the silencer",
    ),
    (
        "gas-temperature-dynamics",
        "a fill burst at fixed piston and ten seconds' dwell with the valve at its null",
    ),
    (
        "variable-heat-transfer",
        "fill bursts of several strengths at fixed piston, each with ten seconds' dwell",
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
        "slow strokes over the whole way at two constant speeds in both directions",
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
        "reversals at several accelerations with a little dither",
    ),
    (
        "constant-force",
        "slow strokes in both directions, as mounted and turned end for end",
    ),
    (
        "unknown-force",
        "strokes both ways over the whole stroke at several constant speeds",
    ),
    (
        "unknown-opening",
        "strokes both ways at several constant commands from the dead zone to fully open",
    ),
    (
        "unknown-reading",
        "both chambers still and open to each other, from the surroundings' pressure to the supply's, beside a gauge that is known to be right",
    ),
    ("end-cushion", "strokes to both ends at two speeds"),
    (
        "pressure-sensor-lag",
        "free swings of the carriage with the valve at its null",
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

/// What to record to tell two effects apart.
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
            format!("Record two things apart: for {one} {first}; for {other} {second}.")
        }
        _ => format!("A recording in which {one} and {other} act at different times or speeds."),
    }
}

/// What to record to rule effects out that these recordings would not have shown.
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
        return "To rule out what these recordings would not have shown, record strokes at several speeds, with sharp reversals and with rests.".into();
    }
    format!(
        "To rule out what these recordings would not have shown, record {}.",
        few.join("; ")
    )
}

/// What to record, and to hold out, that bears effects out or refutes them.
pub fn bearing_out(effects: &[&str]) -> Option<String> {
    let shown: Vec<&str> = effects
        .iter()
        .filter_map(|effect| shown_by(effect))
        .collect();
    (!shown.is_empty()).then(|| {
        format!(
            "To bear out what is named, record {}, and give that with --held-out.",
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
