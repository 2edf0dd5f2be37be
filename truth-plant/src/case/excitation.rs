//! What drives the recordings: moves, sines and holds in closed loop, a
//! multisine and bursts in open loop.

use core::f64::consts::PI;

use crate::plant::sensors::{COMMAND_FULL_V, Sample};
use crate::random::Random;

/// How far a case goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// Most of the stroke, not its ends; small and large openings.
    Usual,
    /// Into the ends of the stroke.
    ToTheEnds,
    /// Small and slow about the middle.
    Gentle,
}

/// What the command follows.
#[derive(Clone, Debug)]
enum Course {
    /// Positions in turn, each held for a while; jumps or ramps between them.
    Positions(Vec<Point>),
    /// A sine of the position about a middle.
    Sine {
        amplitude_m: f64,
        frequency_hz: f64,
        middle_m: f64,
    },
    /// Sines of the command, with a weak pull to the middle.
    Multisine(Vec<Tone>),
    /// Pulses of the command with rests between them.
    Bursts(Vec<Pulse>),
}

/// The reference is at this position from this time on.
#[derive(Clone, Copy, Debug)]
struct Point {
    time_s: f64,
    position_m: f64,
}

#[derive(Clone, Copy, Debug)]
struct Tone {
    amplitude_v: f64,
    frequency_hz: f64,
    phase_rad: f64,
}

#[derive(Clone, Copy, Debug)]
struct Pulse {
    from_s: f64,
    to_s: f64,
    height_v: f64,
}

/// Pull of the open-loop courses to the middle, and the stronger one beyond the
/// last position that they should reach.
const PULL_V_PER_M: f64 = 5.0;
const HARD_PULL_V_PER_M: f64 = 40.0;
const OPEN_LOOP_REACH_M: f64 = 0.13;
/// An engineer commands steps in closed loop with these (as the practice rigs).
const STIFF_V_PER_M: f64 = 41.0;
const SOFT_V_PER_M: f64 = 23.0;

/// One recording's drive.
#[derive(Clone, Debug)]
pub(super) struct Excitation {
    pub(super) file: &'static str,
    pub(super) duration_s: f64,
    course: Course,
    gain_v_per_m: f64,
    damping_v_s_per_m: f64,
    null_v: f64,
}

/// The files of a case: training first. What each is driven with stands in
/// [`Excitation::draw`].
pub(super) const FILES: [&str; 6] = [
    "train-1.csv",
    "train-2.csv",
    "train-3.csv",
    "train-4.csv",
    "held-1.csv",
    "held-2.csv",
];
/// How many of them are for training.
pub(super) const TRAINING: usize = 4;

impl Excitation {
    /// The drive of the recording with that position in [`FILES`].
    pub(super) fn draw(random: &mut Random, recording: usize, reach: Reach, null_v: f64) -> Self {
        let file = FILES[recording];
        let small = reach == Reach::Gentle;
        let (course, gain_v_per_m, duration_s) = match file {
            "train-1.csv" if small => (stairs(random, 6.0, 0.02), STIFF_V_PER_M, 6.0),
            "train-1.csv" => (jumps(random, 6.0, reach, 0.15), SOFT_V_PER_M, 6.0),
            "train-2.csv" if small => (sine(random, 0.02, 0.4), STIFF_V_PER_M, 6.0),
            "train-2.csv" if random.chance(0.6) => (multisine(random), 0.0, 6.0),
            "train-2.csv" => (bursts(random, 6.0), 0.0, 6.0),
            "train-3.csv" => (triangle(random, 8.0, small), STIFF_V_PER_M, 8.0),
            "train-4.csv" => (stairs(random, 10.0, 0.05), STIFF_V_PER_M, 10.0),
            "held-1.csv" if small => (sine(random, 0.03, 0.3), STIFF_V_PER_M, 6.0),
            "held-1.csv" => (sine(random, 0.105, 0.6), STIFF_V_PER_M, 6.0),
            _ if small => (stairs(random, 6.0, 0.03), STIFF_V_PER_M, 6.0),
            _ => (jumps(random, 6.0, reach, 0.2), SOFT_V_PER_M, 6.0),
        };
        Self {
            file,
            duration_s,
            course,
            gain_v_per_m,
            damping_v_s_per_m: 1.1,
            null_v,
        }
    }

    /// Where a drive that avoids all haste wants the carriage to start.
    pub(super) fn start_m(&self) -> f64 {
        match &self.course {
            Course::Positions(points) => reference(points, 0.0).0,
            Course::Sine { middle_m, .. } => *middle_m,
            Course::Multisine(_) | Course::Bursts(_) => 0.0,
        }
    }

    /// The command that follows from what the converters read.
    pub(super) fn command_v(&self, sample: &Sample) -> f64 {
        let time_s = sample.time_s;
        let from_null_v = match &self.course {
            Course::Positions(points) => self.follow(sample, reference(points, time_s)),
            Course::Sine {
                amplitude_m,
                frequency_hz,
                middle_m,
            } => {
                let omega = 2.0 * PI * frequency_hz;
                let (sin, cos) = (libm::sin(omega * time_s), libm::cos(omega * time_s));
                let target = (middle_m + amplitude_m * sin, amplitude_m * omega * cos);
                self.follow(sample, target)
            }
            Course::Multisine(tones) => {
                let sum_v: f64 = tones
                    .iter()
                    .map(|tone| {
                        let phase = 2.0 * PI * tone.frequency_hz * time_s + tone.phase_rad;
                        tone.amplitude_v * libm::sin(phase)
                    })
                    .sum();
                sum_v + pull_v(sample.position_m)
            }
            Course::Bursts(pulses) => pulses
                .iter()
                .find(|pulse| time_s >= pulse.from_s && time_s < pulse.to_s)
                .map_or_else(
                    || pull_v(sample.position_m),
                    // A pulse goes the way that leads back to the middle.
                    |pulse| {
                        let far = sample.position_m.abs() > 0.06;
                        let away = pulse.height_v * sample.position_m > 0.0;
                        if far && away {
                            -pulse.height_v
                        } else {
                            pulse.height_v
                        }
                    },
                ),
        };
        (self.null_v + from_null_v).clamp(0.0, COMMAND_FULL_V)
    }

    fn follow(&self, sample: &Sample, (position_m, speed_m_per_s): (f64, f64)) -> f64 {
        self.gain_v_per_m * (position_m - sample.position_m)
            + self.damping_v_s_per_m * (speed_m_per_s - sample.speed_m_per_s)
    }
}

fn pull_v(position_m: f64) -> f64 {
    let beyond_m = position_m - position_m.clamp(-OPEN_LOOP_REACH_M, OPEN_LOOP_REACH_M);
    -PULL_V_PER_M * position_m - HARD_PULL_V_PER_M * beyond_m
}

/// Position and speed of a reference with straight lines between its points.
fn reference(points: &[Point], time_s: f64) -> (f64, f64) {
    let next = points.partition_point(|point| point.time_s <= time_s);
    let before = points[next.saturating_sub(1)];
    let Some(after) = points.get(next) else {
        return (before.position_m, 0.0);
    };
    let span_s = after.time_s - before.time_s;
    if next == 0 || span_s <= 0.0 {
        return (before.position_m, 0.0);
    }
    let speed = (after.position_m - before.position_m) / span_s;
    (before.position_m + speed * (time_s - before.time_s), speed)
}

/// Jumps on a raster of time, some left out.
fn jumps(random: &mut Random, duration_s: f64, reach: Reach, largest_m: f64) -> Course {
    let raster_s = random.between(0.3, 0.4);
    let mut points = Vec::new();
    let mut time_s = 0.0;
    while time_s < duration_s {
        let mut position_m = random.between(-largest_m, largest_m);
        if reach == Reach::ToTheEnds && random.chance(0.5) {
            position_m = random.between(0.238, 0.247) * random.sign();
        }
        let held = if random.chance(0.7) { 1.0 } else { 2.0 };
        let end_s = time_s + held * raster_s;
        points.push(Point { time_s, position_m });
        points.push(Point {
            time_s: end_s,
            position_m,
        });
        time_s = end_s;
    }
    Course::Positions(points)
}

/// A slow way there and back.
fn triangle(random: &mut Random, duration_s: f64, small: bool) -> Course {
    let half_m = if small {
        0.01
    } else {
        random.between(0.045, 0.07)
    };
    let way = random.sign();
    let at = |time_s: f64, position_m: f64| Point { time_s, position_m };
    Course::Positions(vec![
        at(0.0, -way * half_m),
        at(0.5 * duration_s, way * half_m),
        at(duration_s, -way * half_m),
    ])
}

/// Small ramps with rests of many lengths between them.
fn stairs(random: &mut Random, duration_s: f64, largest_m: f64) -> Course {
    let mut time_s = 0.0;
    let mut position_m = random.between(-0.2, 0.2) * largest_m;
    let mut points = vec![Point { time_s, position_m }];
    while time_s < duration_s {
        time_s += *random.one_of(&[0.3, 0.5, 1.0, 1.6, 2.5]);
        points.push(Point { time_s, position_m });
        let step_m = largest_m * random.between(0.2, 0.6);
        let way = if position_m.abs() > 0.6 * largest_m {
            -position_m.signum()
        } else {
            random.sign()
        };
        time_s += step_m / random.between(0.02, 0.05);
        position_m += way * step_m;
        points.push(Point { time_s, position_m });
    }
    Course::Positions(points)
}

fn sine(random: &mut Random, amplitude_m: f64, frequency_hz: f64) -> Course {
    Course::Sine {
        amplitude_m: random.around(amplitude_m, 1.2),
        frequency_hz: random.around(frequency_hz, 1.25),
        middle_m: 0.1 * amplitude_m * random.between(-1.0, 1.0),
    }
}

/// Tones between 0.3 and 15 Hz, 0.8 V rms in all.
fn multisine(random: &mut Random) -> Course {
    const TONES: usize = 16;
    const RMS_V: f64 = 0.8;
    let mut tones: Vec<Tone> = (0..TONES)
        .map(|tone| {
            let frequency_hz =
                0.3 * libm::pow(50.0, (tone as f64 + random.fraction()) / TONES as f64);
            Tone {
                amplitude_v: libm::pow(frequency_hz, -0.2),
                frequency_hz,
                phase_rad: random.between(0.0, 2.0 * PI),
            }
        })
        .collect();
    let square: f64 = tones
        .iter()
        .map(|tone| 0.5 * tone.amplitude_v * tone.amplitude_v)
        .sum();
    for tone in &mut tones {
        tone.amplitude_v *= RMS_V / square.sqrt();
    }
    Course::Multisine(tones)
}

/// Pulses of 0.6 to 5 V; the higher, the shorter.
fn bursts(random: &mut Random, duration_s: f64) -> Course {
    let mut pulses = Vec::new();
    let mut time_s = random.between(0.2, 0.5);
    while time_s < duration_s {
        let height_v = random.around(1.7, 2.8);
        let length_s = (0.15 / height_v).clamp(0.04, 0.2) * random.between(0.8, 1.3);
        pulses.push(Pulse {
            from_s: time_s,
            to_s: time_s + length_s,
            height_v: height_v * random.sign(),
        });
        time_s += length_s + random.between(0.25, 0.8);
    }
    Course::Bursts(pulses)
}
