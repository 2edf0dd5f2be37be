//! Reference motions: where the load should be, over time.
//!
//! A [`Motion`] is a row of [`Segment`]s that begin where the last one ended, at
//! rest: moves from point to point, sines and holds. Position, velocity and
//! acceleration are continuous throughout.
//!
//! * A move is the quintic whose speed, acceleration and jerk keep within
//!   [`Limits`].
//! * A sine swells over its first period and fades over its last, so that it
//!   begins and ends at rest.

pub mod read;

use crate::report::number;
use model_core::reference::Reference;
use std::fmt;

/// What a move may ask for at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Speed, m/s.
    pub velocity_m_per_s: f64,
    /// Acceleration, m/s2.
    pub acceleration_m_per_s2: f64,
    /// Jerk, m/s3.
    pub jerk_m_per_s3: f64,
}

impl Limits {
    /// Brisk for an axis of this kind: a third to a half of what the valve's
    /// flow and the pistons' force allow.
    pub const BRISK: Self = Self {
        velocity_m_per_s: 0.5,
        acceleration_m_per_s2: 2.5,
        jerk_m_per_s3: 60.0,
    };

    /// The shortest time of a quintic over a distance, s. Its largest speed is
    /// 15/8 d/T, its largest acceleration 10/sqrt(3) d/T2, its largest jerk
    /// 60 d/T3.
    fn duration_s(&self, distance_m: f64) -> f64 {
        let distance_m = distance_m.abs();
        let by_velocity_s = 1.875 * distance_m / self.velocity_m_per_s;
        let by_acceleration_s =
            libm::sqrt(10.0 / libm::sqrt(3.0) * distance_m / self.acceleration_m_per_s2);
        let by_jerk_s = libm::cbrt(60.0 * distance_m / self.jerk_m_per_s3);
        by_velocity_s.max(by_acceleration_s).max(by_jerk_s)
    }
}

/// One part of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segment {
    /// Stay.
    Hold {
        /// For so long, s.
        seconds: f64,
    },
    /// Go to a place.
    Move {
        /// Where, m.
        to_m: f64,
    },
    /// Swing about the present place.
    Sine {
        /// Half of the whole travel, m.
        amplitude_m: f64,
        /// Frequency, Hz.
        frequency_hz: f64,
        /// Whole periods, the swelling and the fading one included: 2 or more.
        periods: u32,
    },
}

impl fmt::Display for Segment {
    /// A few words.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let millimetres = |metres: f64| number::significant(1e3 * metres, 4);
        match self {
            Self::Hold { seconds } => write!(formatter, "hold {seconds} s"),
            Self::Move { to_m } => write!(formatter, "move to {} mm", millimetres(*to_m)),
            Self::Sine {
                amplitude_m,
                frequency_hz,
                periods,
            } => write!(
                formatter,
                "sine {} mm, {frequency_hz} Hz, {periods} periods",
                millimetres(*amplitude_m)
            ),
        }
    }
}

/// A segment in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// The segment.
    pub segment: Segment,
    /// When it begins, s.
    pub begin_s: f64,
    /// When it ends, s.
    pub end_s: f64,
    /// Where it begins, m.
    pub from_m: f64,
}

/// A reference motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    start_m: f64,
    limits: Limits,
    parts: Vec<Placed>,
}

/// Position, velocity, acceleration.
type Instant = [f64; 3];

impl Motion {
    /// A motion that begins at rest.
    pub fn new(start_m: f64, limits: Limits, segments: &[Segment]) -> Self {
        let mut motion = Self {
            start_m,
            limits,
            parts: Vec::with_capacity(segments.len()),
        };
        for segment in segments {
            motion.push(*segment);
        }
        motion
    }

    fn push(&mut self, segment: Segment) {
        let from_m = self.end_m();
        let begin_s = self.duration_s();
        let seconds = match segment {
            Segment::Hold { seconds } => seconds,
            Segment::Move { to_m } => self.limits.duration_s(to_m - from_m),
            Segment::Sine {
                frequency_hz,
                periods,
                ..
            } => f64::from(periods) / frequency_hz,
        };
        self.parts.push(Placed {
            segment,
            begin_s,
            end_s: begin_s + seconds,
            from_m,
        });
    }

    /// The usual mixture: moves of 10, 60 and 200 mm there and back, sines of
    /// 60 mm at 0.5 and 1 Hz, holds between them.
    pub fn mixed() -> Self {
        let hold = Segment::Hold { seconds: 1.0 };
        let go = |millimetres: f64| Segment::Move {
            to_m: 1e-3 * millimetres,
        };
        let sine = |frequency_hz| Segment::Sine {
            amplitude_m: 0.06,
            frequency_hz,
            periods: 4,
        };
        let segments = [
            [hold, go(10.0), hold, go(0.0)].as_slice(),
            &[hold, go(60.0), hold, go(0.0)],
            &[hold, go(-100.0), hold, go(100.0), hold, go(0.0), hold],
            &[sine(0.5), hold, sine(1.0), hold],
        ]
        .concat();
        Self::new(0.0, Limits::BRISK, &segments)
    }

    /// The motion over and over, for at least so long.
    #[must_use]
    pub fn repeated(&self, seconds: f64) -> Self {
        let mut motion = self.clone();
        while motion.duration_s() < seconds && self.duration_s() > 0.0 {
            for part in &self.parts {
                motion.push(part.segment);
            }
        }
        motion
    }

    /// The lowest and the highest place that it asks for, m.
    pub fn range_m(&self) -> [f64; 2] {
        let mut range_m = [self.start_m, self.start_m];
        for part in &self.parts {
            let (low_m, high_m) = match part.segment {
                Segment::Hold { .. } => (part.from_m, part.from_m),
                Segment::Move { to_m } => (to_m, to_m),
                Segment::Sine { amplitude_m, .. } => (
                    part.from_m - amplitude_m.abs(),
                    part.from_m + amplitude_m.abs(),
                ),
            };
            range_m = [range_m[0].min(low_m), range_m[1].max(high_m)];
        }
        range_m
    }

    /// The segments in their places.
    pub fn parts(&self) -> &[Placed] {
        &self.parts
    }

    /// Where it begins, m.
    pub fn start_m(&self) -> f64 {
        self.start_m
    }

    /// Where it ends, m.
    pub fn end_m(&self) -> f64 {
        self.parts
            .last()
            .map_or(self.start_m, |part| match part.segment {
                Segment::Move { to_m } => to_m,
                Segment::Hold { .. } | Segment::Sine { .. } => part.from_m,
            })
    }

    /// How long it lasts, s.
    pub fn duration_s(&self) -> f64 {
        self.parts.last().map_or(0.0, |part| part.end_s)
    }

    /// The reference at a time; before the beginning and after the end it rests.
    pub fn at(&self, time_s: f64) -> Reference<f64> {
        let later = self.parts.partition_point(|part| part.end_s <= time_s);
        let [position_m, velocity_m_per_s, acceleration_m_per_s2] = match self.parts.get(later) {
            Some(part) => self.within(part, (time_s - part.begin_s).max(0.0)),
            None => [self.end_m(), 0.0, 0.0],
        };
        Reference {
            position_m,
            velocity_m_per_s,
            acceleration_m_per_s2,
        }
    }

    fn within(&self, part: &Placed, time_s: f64) -> Instant {
        let seconds = part.end_s - part.begin_s;
        match part.segment {
            Segment::Hold { .. } => [part.from_m, 0.0, 0.0],
            Segment::Move { to_m } => {
                let [share, rate, rate_of_rate] = quintic(time_s, seconds);
                let way_m = to_m - part.from_m;
                [
                    part.from_m + way_m * share,
                    way_m * rate,
                    way_m * rate_of_rate,
                ]
            }
            Segment::Sine {
                amplitude_m,
                frequency_hz,
                ..
            } => {
                let period_s = 1.0 / frequency_hz;
                let fading = quintic(time_s - (seconds - period_s), period_s);
                let swelling = quintic(time_s, period_s);
                let share = [0, 1, 2].map(|place| swelling[place] - fading[place]);
                let wave = sine(amplitude_m, frequency_hz, time_s);
                let [offset_m, velocity, acceleration] = product(share, wave);
                [part.from_m + offset_m, velocity, acceleration]
            }
        }
    }
}

/// From 0 to 1 over a time, with velocity and acceleration 0 at both ends;
/// level before and after.
fn quintic(time_s: f64, seconds: f64) -> Instant {
    if seconds <= 0.0 || time_s >= seconds {
        return [1.0, 0.0, 0.0];
    }
    let t = (time_s / seconds).max(0.0);
    [
        t * t * t * (10.0 + t * (6.0 * t - 15.0)),
        30.0 * t * t * (1.0 - t) * (1.0 - t) / seconds,
        60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) / (seconds * seconds),
    ]
}

fn sine(amplitude_m: f64, frequency_hz: f64, time_s: f64) -> Instant {
    let rate = std::f64::consts::TAU * frequency_hz;
    let (sin, cos) = (libm::sin(rate * time_s), libm::cos(rate * time_s));
    [
        amplitude_m * sin,
        amplitude_m * rate * cos,
        -amplitude_m * rate * rate * sin,
    ]
}

/// Product of two functions with their first two derivatives.
fn product(a: Instant, b: Instant) -> Instant {
    [
        a[0] * b[0],
        a[1] * b[0] + a[0] * b[1],
        a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2],
    ]
}

/// As it is sent: single precision.
pub fn as_sent(reference: &Reference<f64>) -> Reference<f32> {
    Reference {
        position_m: reference.position_m as f32,
        velocity_m_per_s: reference.velocity_m_per_s as f32,
        acceleration_m_per_s2: reference.acceleration_m_per_s2 as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_velocity_and_acceleration_are_the_derivatives_of_position() {
        const STEP_S: f64 = 1e-4;
        let motion = Motion::mixed();
        let rows = (motion.duration_s() / STEP_S) as usize;
        for row in 1..rows {
            let time_s = row as f64 * STEP_S;
            let [before, now, after] =
                [-STEP_S, 0.0, STEP_S].map(|offset_s| motion.at(time_s + offset_s));
            let velocity = (after.position_m - before.position_m) / (2.0 * STEP_S);
            let acceleration = (after.velocity_m_per_s - before.velocity_m_per_s) / (2.0 * STEP_S);
            assert!((velocity - now.velocity_m_per_s).abs() < 1e-5, "{time_s}");
            assert!(
                (acceleration - now.acceleration_m_per_s2).abs() < 5e-3,
                "{time_s}"
            );
        }
    }

    #[test]
    fn prop_a_move_keeps_its_limits_and_reaches_one() {
        for to_m in [-0.2, 0.001, 0.01, 0.06, 0.2] {
            let motion = Motion::new(0.0, Limits::BRISK, &[Segment::Move { to_m }]);
            let most = |value: fn(&Reference<f64>) -> f64| {
                (0..10_000)
                    .map(|row| value(&motion.at(motion.duration_s() * f64::from(row) / 1e4)).abs())
                    .fold(0.0, f64::max)
            };
            let jerk = 60.0 * to_m.abs() / libm::pow(motion.duration_s(), 3.0);
            let shares = [
                most(|at| at.velocity_m_per_s) / Limits::BRISK.velocity_m_per_s,
                most(|at| at.acceleration_m_per_s2) / Limits::BRISK.acceleration_m_per_s2,
                jerk / Limits::BRISK.jerk_m_per_s3,
            ];
            let largest = shares.iter().copied().fold(0.0, f64::max);
            assert!((largest - 1.0).abs() < 1e-6, "{to_m}: {shares:?}");
        }
    }

    #[test]
    fn prop_the_mixture_stays_within_the_stroke_and_ends_where_it_began() {
        let motion = Motion::mixed();
        for row in 0..(motion.duration_s() * 1e3) as usize {
            assert!(motion.at(row as f64 * 1e-3).position_m.abs() < 0.21);
        }
        assert!(motion.end_m().abs() < 1e-12);
    }
}
