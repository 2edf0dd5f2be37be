//! Criterion's estimates, and the table made of them.

/// The median of one benchmark with its confidence interval, in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Median {
    /// Best estimate.
    pub nanoseconds: f64,
    /// Lower end of the confidence interval.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
    /// Confidence level, as a part of one.
    pub level: f64,
}

/// A benchmark and its median.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Criterion's full name.
    pub name: String,
    /// Its median.
    pub median: Median,
}

/// Read `estimates.json`; `None` if it has no complete median.
///
/// The file is one object of flat objects that criterion writes itself, so the
/// few fields wanted are picked out by name.
pub fn parse_estimates(text: &str) -> Option<Median> {
    let median = &text[text.find("\"median\"")?..];
    Some(Median {
        nanoseconds: number(median, "point_estimate")?,
        lower: number(median, "lower_bound")?,
        upper: number(median, "upper_bound")?,
        level: number(median, "confidence_level")?,
    })
}

/// The `full_id` of `benchmark.json`.
pub fn parse_name(text: &str) -> Option<String> {
    let value = after_key(text, "full_id")?.strip_prefix('"')?;
    Some(value[..value.find('"')?].to_owned())
}

/// What follows `"key":`, without the blank.
fn after_key<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let key = format!("\"{key}\"");
    let rest = &text[text.find(&key)? + key.len()..];
    Some(rest.trim_start().strip_prefix(':')?.trim_start())
}

fn number(text: &str, key: &str) -> Option<f64> {
    let value = after_key(text, key)?;
    let end = value.find([',', '}']).unwrap_or(value.len());
    value[..end].trim().parse().ok()
}

/// A time with the unit that suits it.
fn time(nanoseconds: f64) -> String {
    let (value, unit) = match nanoseconds {
        n if n < 1.0e3 => (n, "ns"),
        n if n < 1.0e6 => (n / 1.0e3, "µs"),
        n if n < 1.0e9 => (n / 1.0e6, "ms"),
        n => (n / 1.0e9, "s"),
    };
    let digits = if value < 10.0 {
        3
    } else if value < 100.0 {
        2
    } else {
        1
    };
    format!("{value:.digits$} {unit}")
}

/// The table in Markdown, with the ratio of every median to that of `reference`.
pub fn table(rows: &[Row], reference: &Row) -> String {
    let percent = reference.median.level * 100.0;
    let mut text = format!(
        "| benchmark | median | {percent:.0} % interval | ratio to `{}` |\n\
         |---|---:|---:|---:|\n",
        reference.name
    );
    for Row { name, median } in rows {
        let ratio = median.nanoseconds / reference.median.nanoseconds;
        text += &format!(
            "| `{name}` | {} | {} to {} | {ratio:.3} |\n",
            time(median.nanoseconds),
            time(median.lower),
            time(median.upper),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As criterion 0.8.2 writes it, shortened to two statistics.
    const ESTIMATES: &str = r#"{"mean":{"confidence_interval":{"confidence_level":0.95,
        "lower_bound":1.0,"upper_bound":2.0},"point_estimate":1.5,"standard_error":0.1},
        "median":{"confidence_interval":{"confidence_level":0.95,"lower_bound":634688.25,
        "upper_bound":650950.5},"point_estimate":641988.75,"standard_error":4216.0}}"#;

    fn row(name: &str, nanoseconds: f64) -> Row {
        let (lower, upper) = (nanoseconds * 0.9, nanoseconds * 1.1);
        Row {
            name: name.to_owned(),
            median: Median {
                nanoseconds,
                lower,
                upper,
                level: 0.95,
            },
        }
    }

    #[test]
    fn the_median_is_read_and_not_the_mean() {
        let expected = Median {
            nanoseconds: 641_988.75,
            lower: 634_688.25,
            upper: 650_950.5,
            level: 0.95,
        };
        assert_eq!(parse_estimates(ESTIMATES), Some(expected));
    }

    #[test]
    fn incomplete_files_are_refused() {
        for end in [0, 20, ESTIMATES.len() - 60] {
            assert_eq!(parse_estimates(&ESTIMATES[..end]), None);
        }
        assert_eq!(
            parse_estimates(r#"{"median": {"point_estimate": "x"}}"#),
            None
        );
    }

    #[test]
    fn the_name_is_the_full_one() {
        let text = r#"{"group_id":"add_row","full_id":"add_row/10","title":"add_row/10"}"#;
        assert_eq!(parse_name(text).as_deref(), Some("add_row/10"));
        assert_eq!(parse_name("{}"), None);
    }

    #[test]
    fn times_have_readable_units() {
        assert_eq!(time(3.21), "3.210 ns");
        assert_eq!(time(64_200.0), "64.20 µs");
        assert_eq!(time(641_988.75), "642.0 µs");
        assert_eq!(time(2.5e9), "2.500 s");
    }

    #[test]
    fn the_table_has_ratios() {
        let rows = [row("a", 100.0), row("b", 250.0)];
        let text = table(&rows, &rows[0]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            "| benchmark | median | 95 % interval | ratio to `a` |"
        );
        assert_eq!(
            lines[3],
            "| `b` | 250.0 ns | 225.0 ns to 275.0 ns | 2.500 |"
        );
        assert_eq!(lines.len(), 4);
    }
}
