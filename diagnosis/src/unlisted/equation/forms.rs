//! The forms that a term may have over one variable, and the values of their own number that are
//! tried.

use std::f64::consts::TAU;

/// A variable, row by row.
pub struct Variable {
    /// Name.
    pub name: &'static str,
    /// Unit, SI.
    pub unit: &'static str,
    /// The shortest stretch of it over which samples are not means, 0 where they never are: of a wave they
    /// tell no shorter one than two of them.
    pub resolution: f64,
    /// Its values by recording; finite.
    pub columns: Vec<Vec<f64>>,
}

/// The form of a term over a variable z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// c z.
    Linear,
    /// c |z| z.
    Square,
    /// c1 z + c2 z^2 + c3 z^3: a spring about its rest that stiffens.
    Cubic,
    /// a sin(2 pi z / s) + b cos(2 pi z / s).
    Wave,
    /// The same with a phase of its own in every recording: nobody records when a neighbour begins.
    WaveByRecording,
    /// c (1 - exp(-z / s)).
    Settling,
    /// c (z - s) beyond s.
    Beyond,
    /// c z', where z' trails behind z and is full after some ways s.
    Trailing,
}

/// A wave is shown by this part of its length at the least, and where every recording has a phase
/// of its own by all of it.
const LEAST_PART_OF_WAVE: f64 = 0.5;
/// Waves are tried in steps of this part of one over the range: two that far apart come a quarter
/// of a turn out of step from one end to the other.
const STEP_OF_WAVES: f64 = 0.25;
/// So many waves over the range are tried at the most.
const MOST_WAVES: f64 = 200.0;
/// Paths, thresholds and times that are tried.
const SIZES: usize = 24;
/// The smallest path or time over the range.
const SMALLEST: f64 = 0.01;

impl Form {
    /// Whether the form's own number is a length or time of the variable.
    pub fn has_shape(self) -> bool {
        !matches!(self, Self::Linear | Self::Square | Self::Cubic)
    }

    /// The numbers of its own that are tried over a variable; one that stands for none where it has
    /// none.
    pub fn shapes(self, variable: &Variable) -> Vec<f64> {
        let (from, to) = variable.range();
        let range = to - from;
        let by_size = |index: usize| {
            let part = index as f64 / (SIZES - 1) as f64;
            range * SMALLEST.powf(1.0 - part)
        };
        let waves = |most: f64| {
            let count = (most / STEP_OF_WAVES) as usize;
            let first = (self.least_part_of_wave() / STEP_OF_WAVES) as usize;
            let of = move |step: usize| range / (STEP_OF_WAVES * step as f64);
            let shortest = 2.0 * variable.resolution;
            (first..=count)
                .map(of)
                .filter(|length| *length > shortest)
                .collect()
        };
        match self {
            Self::Linear | Self::Square | Self::Cubic => vec![0.0],
            Self::Wave | Self::WaveByRecording => waves(MOST_WAVES),
            Self::Settling | Self::Trailing => (0..SIZES).map(by_size).collect(),
            Self::Beyond => {
                let at = |index: usize| from + range * index as f64 / (SIZES + 1) as f64;
                (1..=SIZES).map(at).collect()
            }
        }
    }

    /// How far apart the tried numbers lie about one: within so much it is refined.
    pub fn step_at(self, variable: &Variable, shape: f64) -> f64 {
        let (from, to) = variable.range();
        let range = to - from;
        match self {
            Self::Linear | Self::Square | Self::Cubic => 0.0,
            Self::Wave | Self::WaveByRecording => STEP_OF_WAVES * shape * shape / range,
            Self::Settling | Self::Trailing => {
                shape * (SMALLEST.powf(-1.0 / (SIZES - 1) as f64) - 1.0)
            }
            Self::Beyond => range / (SIZES + 1) as f64,
        }
    }

    fn least_part_of_wave(self) -> f64 {
        if self == Self::Wave {
            LEAST_PART_OF_WAVE
        } else {
            1.0
        }
    }

    /// Whether its coefficients are others in every recording.
    pub fn is_by_recording(self) -> bool {
        self == Self::WaveByRecording
    }

    /// Whether a number of its own is one at which it is another form: what trails or settles at
    /// once is a constant or a sign, at the end of its range a straight line, and a part of a wave is any
    /// curve.
    pub fn is_at_its_limit(self, variable: &Variable, shape: f64) -> bool {
        let (from, to) = variable.range();
        match self {
            Self::Settling | Self::Trailing => {
                let part = shape / (to - from);
                !(1.01 * SMALLEST..=0.99).contains(&part)
            }
            Self::Wave | Self::WaveByRecording => {
                let part = (to - from) / shape;
                part < 1.01 * self.least_part_of_wave()
            }
            _ => false,
        }
    }

    /// Its columns over a variable, each by recording and row.
    pub fn columns(self, variable: &Variable, shape: f64) -> Vec<Vec<Vec<f64>>> {
        let each = |of: &dyn Fn(f64) -> f64| -> Vec<Vec<f64>> {
            let columns = variable.columns.iter();
            columns
                .map(|column| column.iter().map(|&z| of(z)).collect())
                .collect()
        };
        match self {
            Self::Linear => vec![each(&|z| z)],
            Self::Square => vec![each(&|z| z * z.abs())],
            Self::Cubic => vec![each(&|z| z), each(&|z| z * z), each(&|z| z * z * z)],
            Self::Wave | Self::WaveByRecording => vec![
                each(&|z| (TAU * z / shape).sin()),
                each(&|z| (TAU * z / shape).cos()),
            ],
            Self::Settling => vec![each(&|z| 1.0 - (-z / shape).exp())],
            Self::Beyond => vec![each(&|z| (z - shape).max(0.0))],
            Self::Trailing => {
                let columns = variable.columns.iter();
                vec![columns.map(|column| trailing(column, shape)).collect()]
            }
        }
    }
}

/// What trails behind a way: full, 1 or -1, after some paths.
fn trailing(way: &[f64], path: f64) -> Vec<f64> {
    let mut trail = 0.0_f64;
    let mut before = way.first().copied().unwrap_or(0.0);
    let one = |&at: &f64| {
        let step = at - before;
        before = at;
        let full = if step < 0.0 { -1.0 } else { 1.0 };
        trail = full + (trail - full) * (-step.abs() / path).exp();
        trail
    };
    way.iter().map(one).collect()
}

impl Variable {
    /// Least and largest value.
    pub fn range(&self) -> (f64, f64) {
        let all = self.columns.iter().flatten();
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), &z| {
            (from.min(z), to.max(z))
        })
    }
}
