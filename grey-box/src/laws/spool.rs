//! The valve's spool behind its command.
//!
//! ```text
//! s = g (spool(u) - null)
//! ```
//!
//! spool(u) is the command path of the model: dead time, play, rate limit, second-order lag. A
//! sensor of length has the gain g, one of volts or of a fraction is compared as it is, g = 1.

use super::command::spool_at_rows;
use super::{Output, Sink, Track};
use crate::model::Values;
use crate::rig::Rig;
use crate::units::Dimension;
use model_core::real::Real;
use std::ops::Range;

/// Key of the gain.
pub(super) const GAIN: &str = "valve.spool_gain_m_V";

/// Whether the sensor shows a displacement.
pub(super) fn is_length(rig: &Rig) -> bool {
    let signal = rig.signals.get("spool");
    signal.is_some_and(|signal| signal.unit.dimension() == Dimension::Length)
}

pub(super) fn output(rig: &Rig) -> Output {
    Output {
        signal: "spool",
        place: "valve-command",
        unit: if is_length(rig) { "m" } else { "V" },
    }
}

pub(super) fn predict<R: Real>(
    values: &Values<'_, R>,
    track: &Track<'_>,
    rows: Range<usize>,
    sink: &mut dyn Sink<R>,
) {
    let Some(command) = track.signal("u") else {
        return;
    };
    let gain = if is_length(values.rig) {
        values.get_or(GAIN, 0.0)
    } else {
        R::ONE
    };
    let null_v = values.get_or("valve.null_V", 0.0);
    let recorded = (track.recording.time_s.as_slice(), command);
    for (row, spool_v) in rows.clone().zip(spool_at_rows(values, recorded, &rows)) {
        sink.row(row, &[gain * (spool_v - null_v)], &[]);
    }
}

#[cfg(test)]
mod tests {
    use crate::laws::{Law, Track};
    use crate::model::Values;
    use crate::recording::Recording;
    use crate::rig::Rig;

    const PAPER: &str = include_str!("../../../host-sim/rigs/paper.toml");

    fn recorded(command: Vec<f64>) -> Recording {
        let time_s = (0..command.len()).map(|row| row as f64 * 1e-3).collect();
        let spool = vec![0.0; command.len()];
        let signals = [("u".to_owned(), command), ("spool".to_owned(), spool)];
        Recording::from_signals("spool.csv", time_s, signals.into())
    }

    fn predicted(rig: &Rig, recording: &Recording) -> Vec<f64> {
        let mut all = Vec::new();
        let mut sink = |_: usize, outputs: &[f64], _: &[f64]| all.push(outputs[0]);
        let (values, track) = (Values::of(rig), Track::still(recording));
        Law::Spool.predict(&values, &track, 0..recording.len(), &[], &mut sink);
        all
    }

    /// A spool that is late by a dead time of ten rows stands where the command was.
    #[test]
    fn val_a_late_spool_stands_where_the_command_was() {
        let spool = "spool = { column = \"s\", unit = \"mm\" }\n[gas]";
        let text = PAPER.replacen("[gas]", spool, 1);
        let text = text.replacen("null_V = 5.0", "null_V = 5.0\nspool_gain_m_V = 4e-4", 1);
        let rig = Rig::parse(
            &(text + "\n[effects.valve-delay]\ndelay_s = 0.01\n"),
            "rig.toml",
        )
        .expect("a rig");
        let command: Vec<f64> = (0..200).map(|row| 5.0 + 0.01 * f64::from(row)).collect();
        let positions = predicted(&rig, &recorded(command));
        assert_eq!(positions.len(), 200);
        assert!(positions[0].abs() < 1e-12);
        // A command that holds from row to row is half a row late beside.
        let expected = 4e-4 * 0.01 * (150.0 - 10.0 - 0.5);
        assert!(
            (positions[150] - expected).abs() < 1e-8,
            "{} {expected}",
            positions[150]
        );
    }

    /// The gain of a displacement must be stated, that of volts not.
    #[test]
    fn val_a_displacement_lacks_its_gain() {
        let recording = recorded(vec![5.0; 10]);
        for (unit, runs) in [("mm", false), ("V", true)] {
            let spool = format!("spool = {{ column = \"s\", unit = \"{unit}\" }}\n[gas]");
            let rig = Rig::parse(&PAPER.replacen("[gas]", &spool, 1), "rig.toml").expect("a rig");
            let laws = Law::of(&rig, &|signal| recording.signal(signal).is_some());
            assert_eq!(laws.contains(&Law::Spool), runs, "{unit}");
        }
    }
}
