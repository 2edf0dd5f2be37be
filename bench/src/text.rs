//! An outcome as terminal text.

use std::fmt;

use grey_box::text::{Columns, plain};

use crate::outcome::{Number, Outcome};

/// Significant digits of a deviation.
const DEVIATION_DIGITS: usize = 2;

impl fmt::Display for Outcome {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}", self.title.to_lowercase())?;
        let mut columns = Columns::new(2, &["", "value", "±", ""]);
        for number in &self.numbers {
            let (value, deviation) = number.shown();
            columns.row([
                number.what.clone(),
                value,
                deviation,
                number.shown_unit().into(),
            ]);
        }
        write!(out, "{columns}")?;
        if !self.areas.is_empty() {
            writeln!(out, "  areas:")?;
            let mut columns = Columns::new(4, &["opening, V", "supply, mm2", "exhaust, mm2"]);
            for point in &self.areas {
                let cell = |path: usize| {
                    point.area_m2[path]
                        .map_or("-".into(), |area_m2| format!("{:.4}", 1e6 * area_m2))
                };
                columns.row([format!("{:.3}", point.opening_v), cell(0), cell(1)]);
            }
            write!(out, "{columns}")?;
        }
        writeln!(out, "  from:")?;
        for stretch in &self.stretches {
            writeln!(
                out,
                "    {} {:.3} to {:.3} s: {}",
                stretch.recording, stretch.from_s, stretch.to_s, stretch.what
            )?;
        }
        for note in &self.notes {
            writeln!(out, "  note: {note}")?;
        }
        Ok(())
    }
}

impl Number {
    /// The unit in which it is shown; nothing for a plain number.
    pub fn shown_unit(&self) -> &'static str {
        match self.shown_in.0 {
            "1" => "",
            unit => unit,
        }
    }

    /// Value and deviation in the unit in which they are shown, as many digits as they are worth.
    pub fn shown(&self) -> (String, String) {
        let (value, deviation) = (
            self.value * self.shown_in.1,
            self.deviation * self.shown_in.1,
        );
        if !deviation.is_finite() || deviation <= 0.0 {
            return (plain(value, 4), "-".into());
        }
        let digits = if value == 0.0 {
            DEVIATION_DIGITS as f64
        } else {
            (value.abs() / deviation).log10().max(0.0).floor() + DEVIATION_DIGITS as f64
        };
        (
            plain(value, (digits as usize).clamp(2, 6)),
            plain(deviation, DEVIATION_DIGITS),
        )
    }
}
