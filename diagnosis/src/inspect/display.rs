//! An inspection as terminal text.

use std::fmt;

use super::{Excitation, Inspection, SignalReport, Timing};
use crate::text::file_name;

impl fmt::Display for Inspection {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}", file_name(&self.recording))?;
        write_timing(out, self.rows, &self.timing)?;
        writeln!(
            out,
            "  {:<14} {:>4} {:>12} {:>12} {:>12} {:>10} {:>10} {:>10} {:>8}",
            "signal", "unit", "min", "max", "mean", "noise", "declared", "quantum", "longest"
        )?;
        for signal in &self.signals {
            write_signal(out, signal)?;
        }
        write_excitation(out, &self.excitation)?;
        if !self.unused_columns.is_empty() {
            let columns = file_name(&self.unused_columns.join(", "));
            writeln!(out, "  not used: {columns}")?;
        }
        for note in &self.notes {
            writeln!(out, "  note: {note}")?;
        }
        for fault in &self.faults {
            writeln!(out, "  FAULT: {}", fault.sentence)?;
        }
        if self.faults.is_empty() {
            writeln!(out, "  no faults found")?;
        }
        Ok(())
    }
}

fn write_timing(out: &mut fmt::Formatter<'_>, rows: usize, timing: &Timing) -> fmt::Result {
    writeln!(
        out,
        "  {rows} rows, {:.3} to {:.3} s, {:.6} Hz, jitter {:.3} ms, steps {:.3} to {:.3} ms",
        timing.first_s,
        timing.last_s,
        timing.rate_hz,
        timing.jitter_s * 1e3,
        timing.shortest_step_s * 1e3,
        timing.longest_step_s * 1e3,
    )?;
    if timing.gap_count > 0 {
        writeln!(out, "  {} gaps:", timing.gap_count)?;
    }
    for gap in &timing.gaps {
        writeln!(
            out,
            "    after line {} at {:.3} s: {:.3} s",
            gap.after_line, gap.from_s, gap.length_s
        )?;
    }
    let unlisted = timing.gap_count - timing.gaps.len();
    if unlisted > 0 {
        writeln!(out, "    and {unlisted} more")?;
    }
    Ok(())
}

fn write_signal(out: &mut fmt::Formatter<'_>, signal: &SignalReport) -> fmt::Result {
    let hidden = if signal.noise_visible { "" } else { "<" };
    writeln!(
        out,
        "  {:<14} {:>4} {:>12} {:>12} {:>12} {:>10} {:>10} {:>10} {:>8}",
        signal.name,
        signal.unit,
        figure(signal.minimum),
        figure(signal.maximum),
        figure(signal.mean),
        format!("{hidden}{:.2e}", signal.noise.max(hidden_noise(signal))),
        optional(signal.declared_noise),
        optional(signal.quantum),
        signal.longest_run_rows,
    )
}

/// A noise under the quantum is only known to be smaller than it.
fn hidden_noise(signal: &SignalReport) -> f64 {
    if signal.noise_visible {
        0.0
    } else {
        0.5 * signal.quantum.unwrap_or(0.0)
    }
}

fn figure(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude >= 1e4 {
        format!("{value:.0}")
    } else if magnitude >= 1.0 {
        format!("{value:.4}")
    } else {
        format!("{value:.6}")
    }
}

fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| "-".into(), |value| format!("{value:.2e}"))
}

fn write_excitation(out: &mut fmt::Formatter<'_>, excitation: &Excitation) -> fmt::Result {
    let parts = excitation.parts();
    if parts.is_empty() {
        return Ok(());
    }
    writeln!(out, "  excitation: {}", parts.join(", "))
}

impl Excitation {
    /// What is known of it, a few words each.
    pub fn parts(&self) -> Vec<String> {
        let mut parts = Vec::new();
        if let Some(span) = self.stroke_span {
            parts.push(format!("travel {}", figure(span)));
        }
        if let Some(stick) = self.stick_fraction {
            parts.push(format!("{:.0} % at rest", stick * 100.0));
        }
        if let Some(reversals) = self.reversals {
            parts.push(format!("{reversals} reversals"));
        }
        if let Some(rests) = self.rests {
            parts.push(format!("{rests} rests"));
        }
        let spans = [
            ("valve opening (V)", self.opening_span_v),
            ("chamber A to supply pressure", self.pressure_ratio_a),
            ("chamber B to supply pressure", self.pressure_ratio_b),
        ];
        for (name, span) in spans {
            if let Some([low, high]) = span {
                parts.push(format!("{name} {low:.3} to {high:.3}"));
            }
        }
        parts
    }
}
