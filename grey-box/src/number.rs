//! Numbers as a reader, or a page of moderate size, wants them.

/// `value` with so many significant digits: plain between 0.0001 and a
/// million, as a power of ten beyond. What is not finite becomes a dash.
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let digits = digits.max(1);
    // Formatting first lets 9.996 become 10.00 rather than 9.9960.
    let scientific = format!("{:.*e}", digits - 1, value);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-4..6).contains(&exponent) {
        let decimals = i32::try_from(digits).unwrap_or(i32::MAX) - 1 - exponent;
        return fixed(value, usize::try_from(decimals).unwrap_or(0));
    }
    format!("{}×10{}", true_minus(mantissa), superscript(exponent))
}

/// `value` with so many decimals. What is not finite becomes a dash.
pub fn fixed(value: f64, decimals: usize) -> String {
    if value.is_finite() {
        true_minus(&format!("{value:.decimals$}"))
    } else {
        "–".to_owned()
    }
}

/// A size in bytes with a unit that keeps it short.
pub fn bytes(count: u64) -> String {
    let count_f64 = count as f64;
    match count {
        0..1_000 => format!("{count} B"),
        1_000..1_000_000 => format!("{} kB", significant(count_f64 / 1e3, 3)),
        _ => format!("{} MB", significant(count_f64 / 1e6, 3)),
    }
}

/// A minus sign as wide as a digit; none before a number that rounded to zero.
fn true_minus(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.contains(|character: char| ('1'..='9').contains(&character)) => {
            format!("−{rest}")
        }
        Some(rest) => rest.to_owned(),
        None => text.to_owned(),
    }
}

fn superscript(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raise = |character: char| match character.to_digit(10) {
        Some(digit) => DIGITS[digit as usize],
        None => '⁻',
    };
    exponent.to_string().chars().map(raise).collect()
}

/// How the numbers of one axis are rounded before they enter a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rounding {
    /// To so many decimals (negative: to tens, hundreds, ...): linear axes.
    Decimals(i32),
    /// To so many significant digits: logarithmic axes.
    Significant(i32),
}

impl Rounding {
    /// Keeps `digits` decimal digits of the range the values span.
    ///
    /// Five digits are a hundred-thousandth of the range: a chart 300 pixels
    /// high shows no steps before it is magnified three hundred times.
    pub fn for_range(values: impl IntoIterator<Item = f64>, digits: i32) -> Self {
        let finite = values.into_iter().filter(|value| value.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        // A constant has no range: its own size decides.
        let range = if high > low { high - low } else { high.abs() };
        if range.is_finite() && range > 0.0 {
            Self::Decimals(digits - range.log10().floor() as i32)
        } else {
            Self::Decimals(digits)
        }
    }

    /// The rounded number; what is not finite stays so.
    pub fn apply(self, value: f64) -> f64 {
        let decimals = match self {
            Self::Decimals(decimals) => decimals,
            Self::Significant(digits) if value.abs() > 0.0 && value.is_finite() => {
                digits - 1 - value.abs().log10().floor() as i32
            }
            Self::Significant(_) => return value,
        };
        // Dividing by a power of ten gives the double nearest to the short
        // decimal number, which is then also written short.
        let power = 10.0_f64.powi(decimals.abs());
        let rounded = if decimals >= 0 {
            (value * power).round() / power
        } else {
            (value / power).round() * power
        };
        if rounded.is_finite() { rounded } else { value }
    }
}

/// Round positions for the ticks of a linear axis: about `wanted` of them, in
/// steps of 1, 2 or 5 times a power of ten. Empty when there is no range.
pub fn ticks(low: f64, high: f64, wanted: usize) -> Vec<f64> {
    let raw_step = (high - low) / wanted.max(1) as f64;
    if !(raw_step.is_finite() && raw_step > 0.0) {
        return Vec::new();
    }
    let power = 10.0_f64.powf(raw_step.log10().floor());
    let factors = [1.0, 2.0, 5.0];
    let step = factors
        .iter()
        .map(|factor| factor * power)
        .find(|step| *step >= raw_step * 0.999)
        .unwrap_or(10.0 * power);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|count| count as f64 * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_significant_digits() {
        assert_eq!(significant(1.7249, 3), "1.72");
        assert_eq!(significant(9.996, 3), "10.0");
        assert_eq!(significant(-0.000_123_4, 2), "−0.00012");
        assert_eq!(significant(1.5e-9, 3), "1.50×10⁻⁹");
        assert_eq!(significant(123_456.0, 3), "123456");
        assert_eq!(significant(0.0, 3), "0.00");
        assert_eq!(significant(f64::NAN, 3), "–");
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(bytes(1_234_567), "1.23 MB");
    }

    #[test]
    fn regress_rounding_follows_the_range() {
        let rounding = Rounding::for_range([100.0, 540.0, f64::NAN], 5);
        assert_eq!(rounding, Rounding::Decimals(3));
        assert_eq!(rounding.apply(123.456_789).to_string(), "123.457");
        assert_eq!(Rounding::Decimals(-2).apply(1_234.0).to_string(), "1200");
        assert_eq!(
            Rounding::Significant(3).apply(0.001_234_5).to_string(),
            "0.00123"
        );
        assert!(rounding.apply(f64::INFINITY).is_infinite());
        assert!(Rounding::for_range([], 5).apply(f64::NAN).is_nan());
    }

    #[test]
    fn regress_ticks_are_round() {
        assert_eq!(ticks(0.0, 1.0, 5).len(), 6);
        assert_eq!(ticks(-3.0, 17.0, 4), vec![0.0, 5.0, 10.0, 15.0]);
        assert!(ticks(1.0, 1.0, 5).is_empty() && ticks(f64::NAN, 1.0, 5).is_empty());
    }
}
