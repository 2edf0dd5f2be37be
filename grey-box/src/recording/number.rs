//! What a cell says: a number, nothing, or something to complain about.
//!
//! A file has one decimal mark. It is decided by the first number that shows it beyond doubt:
//! a point always does, a comma does unless it may group thousands (`444,568`). From then on
//! the other mark is an error, so a thousands separator is never taken for a decimal mark.

use crate::text::one_line;

/// What instruments send in place of a reading that is out of range (SCPI: 9.9E37 infinity,
/// 9.91E37 not a number); nothing measured comes near.
const OVERRANGE: f64 = 9.9e37;

/// The sign that word processors and some spreadsheets write for a minus.
const TYPOGRAPHIC_MINUS: char = '\u{2212}';

/// How loggers and spreadsheets write "no value", in lower case.
const NO_VALUE: [&str; 13] = [
    "", "nan", "-nan", "+nan", "na", "n/a", "#n/a", "#nv", "null", "none", "-", "--", "1.#qnan",
];

/// Of [`NO_VALUE`]: most cells are longer and need no comparison.
const LONGEST_WORD: usize = 7;

/// What is wrong with a cell, and what was expected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct CellFault {
    pub problem: String,
    pub expected: String,
}

/// The character before the decimals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    Point,
    Comma,
}

/// Reads numbers by the decimal mark of their file.
#[derive(Clone, Debug, Default)]
pub(super) struct Numbers {
    /// `None` until a number shows it.
    mark: Option<Mark>,
    buffer: String,
}

impl Numbers {
    /// The decimal mark, once it is known.
    pub(super) fn mark(&self) -> Option<Mark> {
        self.mark
    }

    /// Lets a cell of the head of the file decide the mark.
    pub(super) fn observe(&mut self, cell: &[u8]) {
        if self.mark.is_none() {
            self.mark = std::str::from_utf8(cell).ok().and_then(shown_mark);
        }
    }

    /// The number in a cell, `None` for a cell without a value.
    pub(super) fn read(&mut self, cell: &[u8]) -> Result<Option<f64>, CellFault> {
        let text = std::str::from_utf8(cell).unwrap_or("\u{fffd}");
        let value = match self.mark {
            Some(Mark::Comma) => self.with_comma(text),
            _ => text.parse().ok(),
        };
        match value {
            Some(value) if value.abs() < OVERRANGE => {
                self.mark = self.mark.or_else(|| shown_mark(text));
                Ok(Some(value))
            }
            _ => self.unusual(text),
        }
    }

    fn with_comma(&mut self, text: &str) -> Option<f64> {
        if text.contains('.') {
            return None;
        }
        self.buffer.clear();
        self.buffer
            .extend(text.chars().map(|one| if one == ',' { '.' } else { one }));
        self.buffer.parse().ok()
    }

    fn unusual(&mut self, text: &str) -> Result<Option<f64>, CellFault> {
        if is_no_value(text) {
            return Ok(None);
        }
        if let Some(magnitude) = text.strip_prefix(TYPOGRAPHIC_MINUS) {
            return self.read(format!("-{magnitude}").as_bytes());
        }
        if self.mark.is_none() && shown_mark(text) == Some(Mark::Comma) {
            self.mark = Some(Mark::Comma);
            return self.read(text.as_bytes());
        }
        Err(self.fault(text))
    }

    fn fault(&self, text: &str) -> CellFault {
        let shown = one_line(text);
        let fault = |problem: &str, expected: &str| CellFault {
            problem: format!("\"{shown}\" {problem}"),
            expected: expected.into(),
        };
        let either = text.replace(',', ".").parse::<f64>();
        if text
            .parse::<f64>()
            .is_ok_and(|value| value.is_finite() && value.abs() >= OVERRANGE)
        {
            let expected = "a reading within the instrument's range";
            return fault("is the overrange code of an instrument", expected);
        }
        if either.as_ref().is_ok_and(|value| !value.is_finite()) {
            return fault("is no finite number", "a number");
        }
        if is_grouped(text) && (either.is_err() || self.mark.is_none()) {
            let problem = if either.is_err() {
                "has a thousands separator"
            } else {
                "may have a thousands separator or a decimal comma"
            };
            return fault(problem, "numbers without thousands separators");
        }
        if either.is_ok() {
            return match self.mark {
                Some(Mark::Comma) => fault(
                    "has a point where the file's decimal mark is the comma",
                    "one decimal mark in the whole file and no thousands separators",
                ),
                _ => fault(
                    "has a comma where the file's decimal mark is the point",
                    "one decimal mark in the whole file and no thousands separators",
                ),
            };
        }
        if is_fortran(text) {
            return fault(
                "has the exponent of Fortran",
                "an exponent written with e: 1.0e+05",
            );
        }
        if is_formula_fault(text) {
            let expected = "a number; an empty cell where there is none";
            return fault("is the mark of a failed reading or formula", expected);
        }
        if let Some((_, value)) = label_and_value(text) {
            let expected = format!("the number alone ({value}); the header line names the columns");
            return fault("is a label with its value", &expected);
        }
        if let Some(number) = leading_number(text) {
            let expected = format!("the number alone ({number}); the rig file states the unit");
            return fault("has text after its number", &expected);
        }
        fault("is no finite number", "a number")
    }
}

/// `1.0D+05`.
fn is_fortran(text: &str) -> bool {
    let with_e = text.replace(['D', 'd'], "e");
    with_e != text && with_e.parse::<f64>().is_ok()
}

/// `#DIV/0!`, `1.#INF`, `OL`, `****`, `---`: spreadsheets, C libraries, meters, Fortran.
fn is_formula_fault(text: &str) -> bool {
    let bare = text.trim_start_matches(['+', '-']);
    let is_row_of = |sign: char| text.len() > 1 && text.chars().all(|one| one == sign);
    text.starts_with('#')
        || bare.starts_with("1.#")
        || matches!(bare, "OL" | "OVER" | "OVERFLOW" | "UNDER" | "ERR" | "Error")
        || is_row_of('*')
        || is_row_of('-')
        || is_row_of('?')
}

/// A number by either decimal mark.
pub(super) fn is_number(text: &str) -> bool {
    text.parse::<f64>().is_ok() || is_comma_number(text)
}

/// Whether a cell says that there is no value.
pub(super) fn is_no_value(text: &str) -> bool {
    let word = text.split('(').next().unwrap_or(text);
    word.len() <= LONGEST_WORD && NO_VALUE.contains(&word.to_ascii_lowercase().as_str())
}

/// The decimal mark that a number shows beyond doubt.
fn shown_mark(text: &str) -> Option<Mark> {
    if text.contains('.') {
        return text.parse::<f64>().is_ok().then_some(Mark::Point);
    }
    (is_comma_number(text) && !is_grouped(text)).then_some(Mark::Comma)
}

/// A number that has one comma, with digits on both sides or before its decimals.
fn is_comma_number(text: &str) -> bool {
    let Some((_, decimals)) = text.split_once(',') else {
        return false;
    };
    decimals.starts_with(|one: char| one.is_ascii_digit())
        && !text.contains('.')
        && text.replacen(',', ".", 1).parse::<f64>().is_ok()
}

/// Whether the digits before the decimals are grouped by threes: `444,568.0`, `1.234,5`,
/// `12 345`, `1'234`, `444,568`.
pub(super) fn is_grouped(text: &str) -> bool {
    const GROUPING: [char; 7] = [',', '.', ' ', '\'', '’', '\u{a0}', '\u{202f}'];
    let unsigned = text.trim_start_matches(['+', '-']);
    GROUPING.iter().any(|group| {
        let decimal = |one: char| matches!(one, '.' | ',') && one != *group;
        let whole = unsigned.split(decimal).next().unwrap_or("");
        let mut groups = whole.split(*group);
        let first = groups.next().unwrap_or("");
        let rest: Vec<&str> = groups.collect();
        let digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
        (1..=3).contains(&first.len())
            && digits(first)
            && !first.starts_with('0')
            && !rest.is_empty()
            && rest.iter().all(|part| part.len() == 3 && digits(part))
    })
}

/// The parts of `t_s:0.0010` and `t=1`.
fn label_and_value(text: &str) -> Option<(&str, &str)> {
    let (label, value) = text.split_once([':', '='])?;
    let value = value.trim();
    (label.starts_with(char::is_alphabetic) && is_number(value)).then_some((label, value))
}

/// The number before the blank in `5.3 V`, or before the letters in `5.3V`.
fn leading_number(text: &str) -> Option<&str> {
    let end = text.find(|one: char| !(one.is_ascii_digit() || "+-.,".contains(one)))?;
    let number = text[..end].trim();
    (is_number(number)
        && !text[end..]
            .trim()
            .contains(|one: char| one.is_ascii_digit()))
    .then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(cells: &[&str]) -> Result<Vec<Option<f64>>, CellFault> {
        let mut numbers = Numbers::default();
        cells
            .iter()
            .map(|cell| numbers.read(cell.as_bytes()))
            .collect()
    }

    #[test]
    fn val_a_decimal_comma_beyond_doubt_decides() {
        assert_eq!(
            read(&["5", "0,0010", "444,568", "-1,5e3"]),
            Ok(vec![Some(5.0), Some(0.001), Some(444.568), Some(-1500.0)])
        );
    }

    #[test]
    fn val_no_thousands_separator_is_read() {
        for cells in [
            &["444,568"][..],
            &["444,568.0"],
            &["1.5", "444,568"],
            &["1.5", "1,234,567"],
            &["1,5", "1.234,5"],
            &["1,5", "1.234"],
            &["1.234,5"],
            &["1.234.567"],
            &["1 234"],
            &["1'234.5"],
        ] {
            let fault = read(cells).expect_err(cells.last().unwrap());
            assert!(fault.expected.contains("thousands separators"), "{fault:?}");
        }
    }

    #[test]
    fn val_cells_without_a_value() {
        for cell in ["", "NaN", "nan", "-nan(ind)", "N/A", "#N/A", "null", "-"] {
            assert_eq!(read(&[cell]), Ok(vec![None]), "{cell:?}");
        }
    }

    #[test]
    fn val_each_odd_cell_is_named() {
        for (cell, problem) in [
            (
                "9.91E+37",
                "\"9.91E+37\" is the overrange code of an instrument",
            ),
            ("-inf", "\"-inf\" is no finite number"),
            ("t_s:0.0010", "\"t_s:0.0010\" is a label with its value"),
            ("5.3 V", "\"5.3 V\" has text after its number"),
            ("two", "\"two\" is no finite number"),
            ("1.0D+05", "\"1.0D+05\" has the exponent of Fortran"),
            (
                "1.#INF",
                "\"1.#INF\" is the mark of a failed reading or formula",
            ),
            (
                "#DIV/0!",
                "\"#DIV/0!\" is the mark of a failed reading or formula",
            ),
            (
                "****",
                "\"****\" is the mark of a failed reading or formula",
            ),
        ] {
            assert_eq!(read(&[cell]).expect_err(cell).problem, problem);
        }
    }
}
