//! Text helpers shared by readers and writers: one-line error texts, suggestions, numbers.

/// Longest piece of foreign text (a cell, a key) quoted in an error line.
const QUOTED_CHARACTERS: usize = 60;

/// Shows `text` on one line: control characters escaped, long text cut.
pub fn one_line(text: &str) -> String {
    escape(text, QUOTED_CHARACTERS)
}

/// Shows a file name on one line; file names may hold line breaks.
pub fn file_name(path: &str) -> String {
    escape(path, usize::MAX)
}

/// A fitted number to nine digits: more than a recording tells or an `f32` holds, and to be read.
pub fn rounded(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap_or(value)
}

fn escape(text: &str, limit: usize) -> String {
    let mut shown = String::with_capacity(text.len().min(limit));
    for (count, character) in text.chars().enumerate() {
        if count == limit {
            shown.push('…');
            break;
        }
        if breaks_a_line(character) {
            shown.extend(character.escape_default());
        } else {
            shown.push(character);
        }
    }
    shown
}

/// Control characters, and the Unicode separators that some terminals and
/// editors also treat as the end of a line.
fn breaks_a_line(character: char) -> bool {
    character.is_control() || matches!(character, '\u{2028}' | '\u{2029}')
}

/// The known name closest to `word`, when it is close enough to be a slip.
pub fn closest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    /// Below this Jaro-Winkler similarity a suggestion confuses more than it
    /// helps (1 is equal).
    const SLIP: f64 = 0.8;
    let lower = word.to_lowercase();
    known
        .into_iter()
        .map(|name| (strsim::jaro_winkler(&lower, &name.to_lowercase()), name))
        .filter(|(similarity, _)| *similarity >= SLIP)
        .max_by(|left, right| left.0.total_cmp(&right.0))
        .map(|(_, name)| name)
}

/// `one of: a, b, c (did you mean "b"?)` for a word that is not among `known`.
pub fn expected_one_of(word: &str, known: &[&str]) -> String {
    format!("one of: {}{}", known.join(", "), did_you_mean(word, known))
}

/// ` (did you mean "b"?)` when a known name is close, or nothing.
pub fn did_you_mean(word: &str, known: &[&str]) -> String {
    closest(word, known.iter().copied())
        .map(|name| format!(" (did you mean \"{}\"?)", one_line(name)))
        .unwrap_or_default()
}

/// A number with so many significant digits in plain characters, to be read or
/// copied: decimals between 0.001 and a million, a power of ten beyond.
pub fn plain(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "-".into();
    }
    let scientific = format!("{:.*e}", digits.max(1) - 1, value);
    let exponent: i32 = scientific
        .split_once('e')
        .and_then(|(_, exponent)| exponent.parse().ok())
        .unwrap_or(0);
    if !(-3..6).contains(&exponent) {
        return scientific;
    }
    let decimals = (digits as i32 - 1 - exponent).max(0);
    format!("{value:.*}", decimals as usize)
}

/// Rows of text in columns: the first aligned left, the others right, a last
/// one without a heading left again.
#[derive(Clone, Debug)]
pub struct Columns {
    indent: usize,
    rows: Vec<Vec<String>>,
}

impl Columns {
    /// Columns with these headings, indented by so many blanks.
    pub fn new(indent: usize, headings: &[&str]) -> Self {
        let headings = headings.iter().map(|heading| (*heading).to_owned());
        Self {
            indent,
            rows: vec![headings.collect()],
        }
    }

    /// One more row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    fn width(&self, column: usize) -> usize {
        let cells = self.rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    }
}

impl std::fmt::Display for Columns {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let headings = self.rows.first().map_or(&[][..], Vec::as_slice);
        let remarks = headings.last().is_some_and(String::is_empty);
        let widths: Vec<usize> = (0..headings.len()).map(|one| self.width(one)).collect();
        for row in &self.rows {
            let mut line = " ".repeat(self.indent);
            for (column, (cell, width)) in row.iter().zip(&widths).enumerate() {
                let left = column == 0 || (remarks && column + 1 == headings.len());
                let padded = if left {
                    format!("{cell:<width$}  ")
                } else {
                    format!("{cell:>width$}  ")
                };
                line.push_str(&padded);
            }
            writeln!(out, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_line_breaks_are_escaped() {
        assert_eq!(one_line("a\nb\u{2028}c"), "a\\nb\\u{2028}c");
    }

    #[test]
    fn prop_a_fitted_number_has_nine_digits() {
        let same = |value: f64, shown: f64| assert_eq!(rounded(value).to_bits(), shown.to_bits());
        same(62.134_839_210_484_72, 62.134_839_2);
        same(-1.93e-5, -1.93e-5);
        assert!(rounded(f64::NAN).is_nan());
    }

    #[test]
    fn val_numbers_keep_their_digits() {
        assert_eq!(plain(1.93e-5, 4), "1.930e-5");
        assert_eq!(plain(-658_300.0, 5), "-658300");
        assert_eq!(plain(0.062_347, 3), "0.0623");
        assert_eq!(plain(f64::NAN, 3), "-");
    }

    #[test]
    fn val_columns_line_up() {
        let mut columns = Columns::new(1, &["name", "n", ""]);
        columns.row(["a".to_owned(), "10".to_owned(), "note".to_owned()]);
        assert_eq!(columns.to_string(), " name   n\n a     10  note\n");
    }

    #[test]
    fn val_long_text_is_cut() {
        assert_eq!(one_line(&"x".repeat(500)).chars().count(), 61);
    }

    #[test]
    fn val_a_slip_gets_a_suggestion_and_nonsense_none() {
        assert_eq!(closest("null_v", ["null_V", "opening_V"]), Some("null_V"));
        assert_eq!(closest("qqq", ["null_V", "opening_V"]), None);
    }
}
