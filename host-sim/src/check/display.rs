//! A check as terminal text.

use std::fmt;

use super::{Check, Lack, LawCheck, NoiseCheck, RecordingCheck};
use crate::text::{file_name, plain};

impl fmt::Display for Check {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}", file_name(&self.rig))?;
        for fault in &self.rig_faults {
            writeln!(out, "  ERROR: {fault}")?;
        }
        if self.laws.is_empty() && self.rig_faults.is_empty() {
            writeln!(
                out,
                "  ERROR: describes no law: it has neither [chambers], [carriage], [friction] nor [actuator]"
            )?;
        }
        for law in &self.laws {
            write_law(out, law)?;
        }
        if !self.assumed.is_empty() {
            writeln!(out, "  assumed, as the rig file does not state it:")?;
        }
        for one in &self.assumed {
            writeln!(
                out,
                "    {} = {} {}: {}",
                one.key,
                plain(one.value, 4),
                one.unit,
                one.why
            )?;
        }
        for remark in &self.unusual {
            writeln!(out, "  note: {remark}")?;
        }
        if !self.exact.is_empty() {
            writeln!(
                out,
                "  without an entry in [uncertainty], taken as exact: {}",
                self.exact.join(", ")
            )?;
        }
        for recording in &self.recordings {
            write_recording(out, recording)?;
        }
        if !self.rig_faults.is_empty() && !self.recordings.is_empty() {
            writeln!(
                out,
                "the recordings were not compared with the rig file: correct it first"
            )?;
        }
        let verdict = if self.usable { "usable" } else { "NOT USABLE" };
        writeln!(out, "{verdict}")
    }
}

fn write_law(out: &mut fmt::Formatter<'_>, law: &LawCheck) -> fmt::Result {
    if law.lacks.is_empty() {
        return writeln!(
            out,
            "  law {}: runs, predicts {}",
            law.law,
            law.predicts.join(", ")
        );
    }
    writeln!(out, "  law {}: NOT RUN, lacks", law.law)?;
    for lack in &law.lacks {
        writeln!(out, "    {lack}")?;
    }
    Ok(())
}

impl fmt::Display for Lack {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}: {}", self.key, self.what)?;
        match &self.typical {
            Some(typical) => write!(out, ", typical {typical}"),
            None => Ok(()),
        }
    }
}

fn write_recording(out: &mut fmt::Formatter<'_>, recording: &RecordingCheck) -> fmt::Result {
    writeln!(out, "{}", file_name(&recording.recording))?;
    if let Some(error) = &recording.error {
        return writeln!(out, "  ERROR: {error}");
    }
    writeln!(
        out,
        "  {} rows at {} Hz",
        recording.rows,
        plain(recording.rate_hz, 4)
    )?;
    for fault in &recording.faults {
        writeln!(out, "  FAULT: {fault}")?;
    }
    for remark in &recording.remarks {
        writeln!(out, "  note: {remark}")?;
    }
    if !recording.unused_columns.is_empty() {
        let columns = file_name(&recording.unused_columns.join(", "));
        writeln!(out, "  columns not used: {columns}")?;
    }
    for noise in &recording.noise {
        writeln!(out, "  {noise}")?;
    }
    Ok(())
}

impl fmt::Display for NoiseCheck {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at_most = if self.visible { "" } else { "at most " };
        let declared = self
            .declared
            .map_or_else(|| "none".to_owned(), |noise| plain(noise, 3));
        write!(
            out,
            "noise of {}: measured {at_most}{} {}, declared {declared}",
            self.signal,
            plain(self.measured, 3),
            self.unit
        )
    }
}
