//! An equation as a person reads it.

use super::Equation;
use super::forms::Form;
use super::term::Term;
use crate::words::{digits, with_deviation};

impl Form {
    /// What it is, in words.
    pub fn phrase(self, variable: &str) -> String {
        match self {
            Self::Linear => format!("proportional to {variable}"),
            Self::Square => format!("square of {variable}"),
            Self::Cubic => format!("cubic in {variable}"),
            Self::Wave | Self::WaveByRecording => format!("sine of {variable}"),
            Self::Settling => format!("settling with {variable}"),
            Self::Beyond => format!("beyond a threshold of {variable}"),
            Self::Trailing => format!("trailing behind {variable}"),
        }
    }
}

impl Term {
    /// What it is, in words.
    pub fn phrase(&self) -> String {
        self.form.phrase(self.variable)
    }

    /// The term with its numbers, of a quantity of this unit.
    pub fn text(&self, unit: &str) -> String {
        let z = self.variable;
        let per = |power: &str| per(unit, self.variable_unit, power);
        let times = |unit: &str| times(self.coefficients[0], unit);
        let shape = self.shape.map(known).unwrap_or_default();
        let shape = format!("{shape} {}", self.variable_unit);
        match self.form {
            Form::Linear => match self.shape {
                None => format!("{} · {z}", times(&per(""))),
                Some(_) => format!("{} · ({z} − ({shape}))", times(&per(""))),
            },
            Form::Square => format!("{} · |{z}| · {z}", times(&per("²"))),
            Form::Cubic => self.text_of_cubic(unit),
            Form::Wave => {
                let [(sine, _), (cosine, _)] = self.coefficients[..] else {
                    return String::new();
                };
                let phase = cosine.atan2(sine);
                let sign = if phase < 0.0 { "−" } else { "+" };
                let phase = phase.abs();
                let amplitude = self.text_of_amplitude(unit);
                format!("{amplitude} · sin(2π {z} / ({shape}) {sign} {phase:.2})")
            }
            Form::WaveByRecording => {
                let amplitude = self.text_of_amplitude(unit);
                format!("{amplitude} · sin(2π {z} / ({shape}) + a phase of each recording)")
            }
            Form::Settling => format!("{} · (1 − exp(−{z} / ({shape})))", times(unit)),
            Form::Beyond => format!(
                "{} · ({z} − ({shape})) beyond that threshold",
                times(&per(""))
            ),
            Form::Trailing => format!("{} trailing behind {z} over {shape}", times(unit)),
        }
    }

    fn text_of_amplitude(&self, unit: &str) -> String {
        self.amplitude()
            .map(|number| times(number, unit))
            .unwrap_or_default()
    }

    fn text_of_cubic(&self, unit: &str) -> String {
        let z = self.variable;
        let Some([linear, cubic, rest]) = self.spring() else {
            return String::new();
        };
        let deviation = |place: usize| self.coefficients[place].1;
        let sign = if rest < 0.0 { "+" } else { "−" };
        let rest = rest.abs();
        let way = format!("({z} {sign} {rest:.4} {})", self.variable_unit);
        let per = |power: &str| per(unit, self.variable_unit, power);
        let linear = times((linear, deviation(0)), &per(""));
        let cubic = times((cubic, deviation(2)), &per("³"));
        format!("{linear} · {way} + {cubic} · {way}³")
    }
}

/// A number to the digits that its deviation leaves.
fn known((value, deviation): (f64, f64)) -> String {
    let known = if deviation.is_finite() && deviation > 0.0 {
        with_deviation(value, deviation)
    } else {
        digits(value)
    };
    match known.strip_prefix('-') {
        Some(size) => format!("−{size}"),
        None => known,
    }
}

/// "(7.1 ± 0.3) N".
fn times(number: (f64, f64), unit: &str) -> String {
    let known = known(number);
    match unit {
        "1" => format!("({known})"),
        unit => format!("({known}) {unit}"),
    }
}

/// "N/m", "N/(m/s)²".
fn per(unit: &str, of: &str, power: &str) -> String {
    match of {
        "1" => unit.to_owned(),
        of if of.contains('/') => format!("{unit}/({of}){power}"),
        of => format!("{unit}/{of}{power}"),
    }
}

impl Equation {
    /// The whole: "force = (39.0 ± 0.8) N/(m/s)² · |velocity| · velocity".
    pub fn text(&self) -> String {
        let terms: Vec<String> = self.terms.iter().map(|term| term.text(self.unit)).collect();
        format!("{} = {}", self.quantity, terms.join(" + "))
    }

    /// What it is, in words: "an equation, force = ...".
    pub fn phrase(&self) -> String {
        format!("an equation, {}", self.text())
    }

    /// The variables of its terms.
    pub fn variables(&self) -> Vec<&'static str> {
        let mut all: Vec<&'static str> = Vec::new();
        for term in &self.terms {
            if !all.contains(&term.variable) {
                all.push(term.variable);
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn term(form: Form, shape: Option<(f64, f64)>, coefficients: &[(f64, f64)]) -> Term {
        Term {
            form,
            variable: "position",
            variable_unit: "m",
            range: (-0.2, 0.2),
            shape,
            coefficients: coefficients.to_vec(),
        }
    }

    #[test]
    fn prop_terms_read_as_one_writes_them() {
        let way = Some((0.0199, 0.0002));
        let trailing = term(Form::Trailing, way, &[(2.99, 0.013)]);
        assert_eq!(
            trailing.text("N"),
            "(2.990 ± 0.013) N trailing behind position over 0.0199 ± 0.0002 m"
        );
        let wave = term(Form::Wave, way, &[(3.0, 0.1), (-4.0, 0.1)]);
        assert_eq!(
            wave.text("N"),
            "(5.00 ± 0.10) N · sin(2π position / (0.0199 ± 0.0002 m) − 0.93)"
        );
        let line = term(Form::Linear, None, &[(0.02, 0.001)]);
        assert_eq!(line.text("1"), "(0.0200 ± 0.0010) 1/m · position");
    }

    /// 4 (x - 0.1) + 50 (x - 0.1)^3 = ... + (4 + 1.5) x - 15 x^2 + 50 x^3.
    #[test]
    fn prop_a_cubic_is_told_about_its_rest() {
        let cubic = term(Form::Cubic, None, &[(5.5, 0.3), (-15.0, 0.2), (50.0, 2.0)]);
        assert_eq!(
            cubic.text("N"),
            "(4.0 ± 0.3) N/m · (position − 0.1000 m) + (50 ± 2) N/m³ · (position − 0.1000 m)³"
        );
        let mut other = cubic.clone();
        other.refit(&[(4.0, 0.3), (50.0, 2.0), (0.1, 0.2 / 150.0)]);
        assert_eq!(other.text("N"), cubic.text("N"));
    }

    /// A trailing term's course is a loop that closes, full at its ends.
    #[test]
    fn prop_a_trailing_course_is_a_closed_loop() {
        let course = term(Form::Trailing, Some((0.01, 1e-4)), &[(5.0, 0.1)]).course();
        let ends = (course[0], course[course.len() - 1]);
        assert_eq!(ends.0, ends.1);
        let most = course.iter().map(|point| point.1).fold(0.0, f64::max);
        assert!((4.5..5.0).contains(&most), "{most}");
    }
}
