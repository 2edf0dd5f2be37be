//! One term of an equation: its numbers by name, and its course.

use super::forms::Form;
use std::f64::consts::TAU;

/// One term of an equation, with its numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// Its form.
    pub form: Form,
    /// The variable.
    pub variable: &'static str,
    /// Its unit, SI.
    pub variable_unit: &'static str,
    /// Least and largest value of the variable in the recordings.
    pub range: (f64, f64),
    /// The form's own number and its standard deviation, if it has one; of a straight line its
    /// zero, where that is known.
    pub shape: Option<(f64, f64)>,
    /// Coefficients and their standard deviations.
    pub coefficients: Vec<(f64, f64)>,
}

/// Points of a course.
const POINTS: usize = 161;
/// A way there and back on which a trailing term is full: so many paths.
const FULL_PATHS: f64 = 4.0;

impl Term {
    /// Its numbers by name: value and standard deviation, SI.
    pub fn numbers(&self) -> Vec<(String, (f64, f64))> {
        let named = |name: &str, number: (f64, f64)| (format!("{}.{name}", self.variable), number);
        let first = self.coefficients[0];
        let shape = |name: &str| self.shape.map(|shape| named(name, shape));
        let mut numbers = match self.form {
            Form::Linear => vec![named("slope", first)],
            Form::Square => vec![named("square", first)],
            Form::Cubic => {
                let [stiffness, stiffening, rest] = self.spring().unwrap_or([f64::NAN; 3]);
                let of_rest = self.deviation_of_rest();
                vec![
                    named("stiffness", (stiffness, first.1)),
                    named("stiffening", (stiffening, self.coefficients[2].1)),
                    named("rest", (rest, of_rest)),
                ]
            }
            Form::Wave | Form::WaveByRecording => {
                vec![named("amplitude", self.amplitude().unwrap_or(first))]
            }
            Form::Settling | Form::Trailing => vec![named("size", first)],
            Form::Beyond => vec![named("slope", first)],
        };
        numbers.extend(match self.form {
            Form::Wave => shape("length"),
            Form::WaveByRecording => shape("period"),
            Form::Settling => shape("constant"),
            Form::Beyond => shape("threshold"),
            Form::Trailing => shape("path"),
            Form::Linear => shape("rest"),
            Form::Square | Form::Cubic => None,
        });
        numbers
    }

    /// The term with other numbers: those of [`Self::numbers`], of a wave its sine and cosine part
    /// in the place of the amplitude.
    pub fn refit(&mut self, numbers: &[(f64, f64)]) {
        match (self.form, numbers) {
            (Form::Cubic, &[stiffness, stiffening, rest]) => {
                let (stiff, cube, at) = (stiffness.0, stiffening.0, rest.0);
                self.coefficients = vec![
                    (stiff + 3.0 * cube * at * at, stiffness.1),
                    (-3.0 * cube * at, (3.0 * cube * rest.1).abs()),
                    stiffening,
                ];
            }
            (Form::Wave, &[sine, cosine, length]) => {
                self.coefficients = vec![sine, cosine];
                self.shape = Some(length);
            }
            (_, &[coefficient]) => self.coefficients = vec![coefficient],
            (_, &[coefficient, shape]) => {
                self.coefficients = vec![coefficient];
                self.shape = Some(shape);
            }
            _ => {}
        }
    }

    fn deviation_of_rest(&self) -> f64 {
        let [_, (_, second), (third, _)] = self.coefficients[..] else {
            return f64::INFINITY;
        };
        (second / (3.0 * third)).abs()
    }

    /// The term over its variable: as far as it was recorded, of a wave over time three periods, of
    /// what trails there and back.
    pub fn course(&self) -> Vec<(f64, f64)> {
        let (from, to) = self.range;
        let shape = self.shape.map_or(1.0, |(shape, _)| shape);
        let at = |point: usize| point as f64 / (POINTS - 1) as f64;
        let over =
            |from: f64, to: f64| (0..POINTS).map(move |point| from + (to - from) * at(point));
        match self.form {
            Form::Trailing => {
                let reach = (FULL_PATHS * shape).min(to - from);
                let way = |part: f64| reach * (0.5 - (2.0 * part - 1.0).abs());
                let full = self.coefficients[0].0;
                let sign = |part: f64| if part < 0.5 { 1.0 } else { -1.0 };
                let passed = |part: f64| reach * (2.0 * part).rem_euclid(1.0);
                let trail = |part: f64| {
                    // In a cycle that repeats it begins each way at -z0, and ends it at z0.
                    let ends = (reach / (2.0 * shape)).tanh();
                    sign(part) * (1.0 - (1.0 + ends) * (-passed(part) / shape).exp())
                };
                let mut points: Vec<(f64, f64)> = (0..POINTS - 1)
                    .map(|point| (way(at(point)), full * trail(at(point))))
                    .collect();
                points.extend(points.first().copied());
                points
            }
            Form::WaveByRecording => {
                let amplitude = self.amplitude().map_or(0.0, |(amplitude, _)| amplitude);
                over(0.0, 3.0 * shape)
                    .map(|z| (z, amplitude * (TAU * z / shape).sin()))
                    .collect()
            }
            _ => over(from, to).map(|z| (z, self.value(z))).collect(),
        }
    }

    /// Its value at a value of its variable, of a form that is a function of that alone.
    fn value(&self, z: f64) -> f64 {
        let [first, second, third] = [0, 1, 2].map(|place| {
            self.coefficients
                .get(place)
                .map_or(0.0, |(value, _)| *value)
        });
        let shape = self.shape.map_or(1.0, |(shape, _)| shape);
        match self.form {
            Form::Linear => first * (z - self.shape.map_or(0.0, |(rest, _)| rest)),
            Form::Square => first * z * z.abs(),
            Form::Cubic => match self.spring() {
                Some([stiffness, stiffening, rest]) => {
                    let way = z - rest;
                    (stiffness + stiffening * way * way) * way
                }
                None => first * z + second * z * z + third * z * z * z,
            },
            Form::Wave => {
                let (sine, cosine) = (TAU * z / shape).sin_cos();
                first * sine + second * cosine
            }
            Form::Settling => first * (1.0 - (-z / shape).exp()),
            Form::Beyond => first * (z - shape).max(0.0),
            Form::WaveByRecording | Form::Trailing => f64::NAN,
        }
    }

    /// Of a cubic, the spring that it is: stiffness, its growth with the square of the way, and the
    /// rest.
    pub fn spring(&self) -> Option<[f64; 3]> {
        let [(first, _), (second, _), (third, _)] = self.coefficients[..] else {
            return None;
        };
        if self.form != Form::Cubic || third.abs() <= f64::MIN_POSITIVE {
            return None;
        }
        let rest = -second / (3.0 * third);
        Some([first - 3.0 * third * rest * rest, third, rest])
    }

    /// Of a wave, its amplitude and that one's deviation: root mean square over the recordings
    /// where each has its own.
    pub fn amplitude(&self) -> Option<(f64, f64)> {
        if !matches!(self.form, Form::Wave | Form::WaveByRecording) {
            return None;
        }
        let pairs = self.coefficients.len() as f64 / 2.0;
        let (squares, variances) = self.coefficients.iter().fold(
            (0.0, 0.0),
            |(squares, variances), (value, deviation)| {
                (
                    squares + value * value,
                    variances + (value * deviation).powi(2),
                )
            },
        );
        let amplitude = (squares / pairs).sqrt();
        let deviation = variances.sqrt() / (pairs * amplitude.max(f64::MIN_POSITIVE));
        Some((amplitude, deviation))
    }
}
