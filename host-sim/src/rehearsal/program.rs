//! A recording of the bank as an experiment file: what was simulated is what a board runs.

use super::bank::{Excitation, Place, Procedure, SetUp};
use crate::experiment::{FASTEST_M_PER_S, envelope_text, step_text};
use crate::motion::{Motion, Segment};
use crate::rig::Rig;
use crate::scenario::{Command, Shape, stroke_range_m};
use std::fmt::Write;

/// The file; none where the rig does not say enough of the axis.
pub(super) fn of(procedure: &Procedure, rig: &Rig) -> Option<String> {
    let stroke_m = stroke_range_m(rig)?;
    let mut text = format!(
        "# {}.\n{}format = \"experiment/1\"\n\n{}",
        procedure.text,
        by_hand(&procedure.excitation, rig),
        envelope_text(rig, stroke_m, FASTEST_M_PER_S)
    );
    match &procedure.excitation {
        Excitation::Clamped {
            seconds, command, ..
        } => {
            let null_v = rig.value("valve.null_V")?;
            for step in of_command(&command(null_v), null_v, *seconds) {
                text += &step;
            }
        }
        Excitation::ByHand { seconds, .. } => text += &opening(0.0, *seconds),
        Excitation::Tracked { motion, .. } => {
            for step in of_motion(&motion(Place::within(stroke_m))) {
                text += &step;
            }
        }
    }
    Some(text)
}

/// What a person does beside, as comments.
fn by_hand(excitation: &Excitation, rig: &Rig) -> String {
    let mut lines = String::new();
    let mut say = |what: String| {
        let _ = writeln!(lines, "# By hand: {what}.");
    };
    match excitation {
        Excitation::Clamped { places, .. } => {
            let percent: Vec<String> = places
                .iter()
                .map(|place| format!("{:.0} %", 100.0 * place))
                .collect();
            let each = if places.len() > 1 {
                ", one run each"
            } else {
                ""
            };
            say(format!(
                "clamp the piston at {} of the stroke{each}",
                percent.join(" and ")
            ));
        }
        Excitation::ByHand { .. } => say("move the carriage".into()),
        Excitation::Tracked { set_up, .. } => {
            let SetUp {
                payload_kg,
                supply,
                is_turned,
            } = set_up;
            if *payload_kg > 0.0 {
                say(format!(
                    "put {payload_kg} kg on the carriage, and say so in the rig file ({} kg in all)",
                    rig.value("carriage.mass_kg").unwrap_or(0.0) + payload_kg
                ));
            }
            if *supply < 1.0 {
                say(format!("turn the supply down to {:.0} %", 100.0 * supply));
            }
            if *is_turned {
                say("turn the drive end for end".into());
            }
        }
    }
    lines
}

fn opening(opening_v: f64, seconds: f64) -> String {
    step_text("opening", &[("opening_V", opening_v), ("seconds", seconds)])
}

fn of_motion(motion: &Motion) -> Vec<String> {
    let start = step_text("move", &[("to_m", motion.start_m()), ("seconds", 2.0)]);
    let of_part = |part: &crate::motion::Placed| {
        let seconds = part.end_s - part.begin_s;
        match part.segment {
            Segment::Hold { .. } => step_text("hold", &[("seconds", seconds)]),
            Segment::Move { to_m } => step_text("move", &[("to_m", to_m), ("seconds", seconds)]),
            Segment::Sine {
                amplitude_m,
                frequency_hz,
                periods,
            } => step_text(
                "sine",
                &[
                    ("amplitude_m", amplitude_m),
                    ("frequency_Hz", frequency_hz),
                    ("periods", f64::from(periods)),
                ],
            ),
        }
    };
    std::iter::once(start)
        .chain(motion.parts().iter().map(of_part))
        .collect()
}

fn of_command(command: &Command, null_v: f64, seconds: f64) -> Vec<String> {
    let segments = &command.segments;
    let ends = segments.iter().skip(1).map(|next| next.start_s);
    let mut timed: Vec<(&Shape, f64)> = segments
        .iter()
        .zip(ends.chain([seconds]))
        .map(|(segment, end_s)| (&segment.shape, end_s - segment.start_s))
        .collect();
    let mut steps = Vec::new();
    while let Some((shape, seconds)) = timed.first().copied() {
        let periods = triangles(&timed);
        if let (true, Shape::Ramp { to_v, .. }) = (periods > 0, shape) {
            let whole = [
                ("amplitude_V", to_v - null_v),
                ("seconds", 4.0 * seconds * periods as f64),
            ];
            let text = step_text("triangle", &whole);
            steps.push(format!("{text}periods = {periods}\n"));
            timed.drain(..3 * periods);
        } else {
            steps.extend(of_shape(shape, null_v, seconds));
            timed.remove(0);
        }
    }
    steps
}

/// How many triangles alike, of three ramps each, come first.
fn triangles(timed: &[(&Shape, f64)]) -> usize {
    let ramp = |(shape, seconds): &(&Shape, f64)| match shape {
        Shape::Ramp { from_v, to_v, .. } => Some([*from_v, *to_v, *seconds]),
        _ => None,
    };
    let three_ramps = |three: &[(&Shape, f64)]| {
        let ramps: Option<Vec<[f64; 3]>> = three.iter().map(ramp).collect();
        ramps.map(|ramps| ramps.concat())
    };
    let Some(first) = timed.get(..3).and_then(three_ramps) else {
        return 0;
    };
    let [null_v, high_v, quarter_s] = [first[0], first[1], first[2]];
    let low_v = 2.0 * null_v - high_v;
    let half_s = 2.0 * quarter_s;
    let triangle = [
        null_v, high_v, quarter_s, high_v, low_v, half_s, low_v, null_v, quarter_s,
    ];
    // Times are differences of sums.
    let is_near = |(one, other): (&f64, &f64)| (one - other).abs() < 1e-9;
    let is_alike = |three: &&[(&Shape, f64)]| {
        three_ramps(three).is_some_and(|ramps| ramps.iter().zip(&triangle).all(is_near))
    };
    timed.chunks_exact(3).take_while(is_alike).count()
}

fn of_shape(shape: &Shape, null_v: f64, seconds: f64) -> Vec<String> {
    match shape {
        Shape::Ramp { from_v, to_v, .. } => {
            let [from_v, to_v] = [from_v, to_v].map(|one| one - null_v);
            let ramp = [("from_V", from_v), ("to_V", to_v), ("seconds", seconds)];
            vec![step_text("ramp", &ramp)]
        }
        Shape::Chirp {
            amplitude_v,
            from_hz,
            to_hz,
            ..
        } => vec![step_text(
            "chirp",
            &[
                ("amplitude_V", *amplitude_v),
                ("from_Hz", *from_hz),
                ("to_Hz", *to_hz),
                ("seconds", seconds),
            ],
        )],
        Shape::Pulses { from_v, pulses } => {
            let mut steps = Vec::new();
            let mut time_s = 0.0;
            for pulse in pulses {
                steps.push(opening(from_v - null_v, pulse.at_s - time_s));
                steps.push(opening(pulse.to_v - null_v, pulse.duration_s));
                time_s = pulse.at_s + pulse.duration_s;
            }
            steps.push(opening(from_v - null_v, seconds - time_s));
            steps
        }
        // The bank has none of these.
        Shape::Constant { value_v } => vec![opening(value_v - null_v, seconds)],
        Shape::Step { .. } | Shape::Sine { .. } | Shape::Multisine { .. } | Shape::Table { .. } => {
            Vec::new()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bank::{OF_CARRIAGE, OF_CHAMBERS};
    use super::*;
    use crate::experiment;

    /// Every recording that is ever asked for can be run by a board, and takes as long as it does
    /// in simulation.
    #[test]
    fn val_every_recording_of_the_bank_is_an_experiment() {
        let text = include_str!("../../rigs/paper.toml");
        let rig = Rig::parse(text, "paper.toml").expect("the paper's rig");
        for procedure in OF_CHAMBERS.iter().chain(OF_CARRIAGE) {
            let file = of(procedure, &rig).expect("a file");
            let program = experiment::parse(&file, "next.toml");
            let program = program.unwrap_or_else(|error| panic!("{error}\n{file}"));
            let seconds = match &procedure.excitation {
                Excitation::Clamped { seconds, .. } | Excitation::ByHand { seconds, .. } => {
                    *seconds
                }
                Excitation::Tracked { motion, .. } => {
                    let stroke_m = stroke_range_m(&rig).expect("a stroke");
                    2.0 + motion(Place::within(stroke_m)).duration_s()
                }
            };
            assert!((program.seconds() - seconds).abs() < 0.01, "{file}");
        }
    }
}
