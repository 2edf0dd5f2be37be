//! Safe recordings that anybody with such an axis can make, as a simulation needs them.
//!
//! They use what an axis has: the command, the supply's knob, a payload, a clamp. For the
//! chambers the piston's place is given (clamped, or moved by hand) and the command a trace;
//! for the carriage the controller follows a motion. Amplitudes stay far from the ends of
//! the command's range, motions from the ends of the stroke.

use crate::motion::{Limits, Motion, Segment};
use crate::scenario::{Command, Pulse, Segment as Stretch, Shape};

/// Half of the strokes, as a part of the whole one.
const HALF_STROKE: f64 = 0.3;
/// Where a clamp holds the piston near an end, as a part of the stroke: its chamber is then
/// small and answers fast.
const NEAR_END: [f64; 2] = [0.05, 0.95];
const MIDDLE: [f64; 1] = [0.5];

/// What is recorded.
pub(super) struct Procedure {
    /// For people: a sentence without its full stop.
    pub text: &'static str,
    pub excitation: Excitation,
}

/// How the axis is moved.
pub(super) enum Excitation {
    /// The piston is held at each of these parts of the stroke while the valve follows the
    /// command.
    Clamped {
        places: &'static [f64],
        seconds: f64,
        command: fn(f64) -> Command,
    },
    /// The valve stays at its null while the carriage is moved to and fro by hand.
    ByHand {
        seconds: f64,
        frequencies_hz: &'static [f64],
    },
    /// The controller moves the load.
    Tracked {
        motion: fn(Place) -> Motion,
        set_up: SetUp,
    },
}

/// Where there is room for a motion, m.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub middle_m: f64,
    pub half_stroke_m: f64,
}

impl Place {
    /// The middle of a stroke, and how far a motion may go from there.
    pub fn within([low, high]: [f64; 2]) -> Self {
        Self {
            middle_m: 0.5 * (low + high),
            half_stroke_m: HALF_STROKE * (high - low),
        }
    }
}

/// What is changed about the rig, by known amounts.
#[derive(Clone, Copy)]
pub(super) struct SetUp {
    /// Mass put onto the carriage, kg.
    pub payload_kg: f64,
    /// The supply's pressure above the surroundings', as a part of what it is.
    pub supply: f64,
    /// Whether the drive is turned end for end: a force from outside changes its sign.
    pub is_turned: bool,
}

impl SetUp {
    pub const AS_IT_IS: Self = Self {
        payload_kg: 0.0,
        supply: 1.0,
        is_turned: false,
    };
}

/// What can be recorded of the chambers.
pub(super) const OF_CHAMBERS: &[Procedure] = &[
    Procedure {
        text: "Bursts of the command of 0.5, 1.5 and 3 V for 0.1 s both ways with half a second between them, the piston clamped near each end of the stroke",
        excitation: Excitation::Clamped {
            places: &NEAR_END,
            seconds: 4.0,
            command: |null_v| pulses(null_v, &[0.5, 1.5, 3.0], 0.1, 0.6),
        },
    },
    Procedure {
        text: "A chirp of the command from 5 to 100 Hz in 3 s at 0.5 V and again at 2 V, the piston clamped near one end of the stroke",
        excitation: Excitation::Clamped {
            places: &[0.05],
            seconds: 6.0,
            command: |null_v| {
                one_after_the_other(&[(3.0, chirp(null_v, 0.5)), (3.0, chirp(null_v, 2.0))])
            },
        },
    },
    Procedure {
        text: "Steps of the command of 0.5, 1, 2 and 4 V for 0.3 s both ways with as long a rest, the piston clamped in the middle of the stroke",
        excitation: Excitation::Clamped {
            places: &MIDDLE,
            seconds: 5.0,
            command: |null_v| pulses(null_v, &[0.5, 1.0, 2.0, 4.0], 0.3, 0.6),
        },
    },
    Procedure {
        text: "A triangle of the command of 1 V through the null in 8 s, then ten in 8 s, the piston clamped in the middle of the stroke",
        excitation: Excitation::Clamped {
            places: &MIDDLE,
            seconds: 16.0,
            command: |null_v| {
                let mut parts = triangle(null_v, 1.0, 8.0);
                for _ in 0..10 {
                    parts.extend(triangle(null_v, 1.0, 0.8));
                }
                one_after_the_other(&parts)
            },
        },
    },
    Procedure {
        text: "Filled for half a second either way at 0.6, 1.2 and 2.5 V, each with 3 s of rest, the piston clamped in the middle of the stroke",
        excitation: Excitation::Clamped {
            places: &MIDDLE,
            seconds: 21.0,
            command: |null_v| pulses(null_v, &[0.6, 1.2, 2.5], 0.5, 3.5),
        },
    },
    Procedure {
        text: "Filled to the full and exhausted to the full (4 V for 2 s) either way, each with 4 s of rest, the piston clamped near each end of the stroke",
        excitation: Excitation::Clamped {
            places: &NEAR_END,
            seconds: 12.0,
            command: |null_v| pulses(null_v, &[4.0], 2.0, 6.0),
        },
    },
    Procedure {
        text: "The carriage moved to and fro by hand, 4 s slowly (0.25 Hz) and 4 s fast (1.5 Hz), the valve at its null",
        excitation: Excitation::ByHand {
            seconds: 8.0,
            frequencies_hz: &[0.25, 1.5],
        },
    },
];

/// What can be recorded of the carriage.
pub(super) const OF_CARRIAGE: &[Procedure] = &[
    Procedure {
        text: "Strokes both ways at a peak speed of 50, 150 and 500 mm/s",
        excitation: Excitation::Tracked {
            motion: strokes,
            set_up: SetUp::AS_IT_IS,
        },
    },
    Procedure {
        text: "The same strokes both ways at a peak speed of 50, 150 and 500 mm/s with the drive turned end for end",
        excitation: Excitation::Tracked {
            motion: strokes,
            set_up: SetUp {
                is_turned: true,
                ..SetUp::AS_IT_IS
            },
        },
    },
    Procedure {
        text: "Strokes both ways at a peak speed of 50, 150 and 500 mm/s with the supply turned down to 60 % of its pressure above the surroundings'",
        excitation: Excitation::Tracked {
            motion: strokes,
            set_up: SetUp {
                supply: 0.6,
                ..SetUp::AS_IT_IS
            },
        },
    },
    Procedure {
        text: "Sharp reversals: a sine of 40 mm at 1.5 Hz for 8 s with 5 kg on the carriage",
        excitation: Excitation::Tracked {
            motion: |place| {
                let swing = sine(0.04_f64.min(place.half_stroke_m), 1.5, 12);
                Motion::new(place.middle_m, Limits::BRISK, &[hold(1.0), swing])
            },
            set_up: SetUp {
                payload_kg: 5.0,
                ..SetUp::AS_IT_IS
            },
        },
    },
    Procedure {
        text: "A ladder of rests of 0.1, 0.3, 1, 3 and 10 s, each ended by a move of 10 mm",
        excitation: Excitation::Tracked {
            motion: |place| {
                let rests_s = [0.1, 0.3, 1.0, 3.0, 10.0, 10.0, 3.0, 1.0, 0.3, 0.1];
                let step = |(number, &rest_s): (usize, &f64)| {
                    let to_m = place.middle_m + if number % 2 == 0 { 0.01 } else { 0.0 };
                    [hold(rest_s), go(to_m)]
                };
                let steps: Vec<Segment> = rests_s.iter().enumerate().flat_map(step).collect();
                Motion::new(place.middle_m, Limits::BRISK, &steps)
            },
            set_up: SetUp::AS_IT_IS,
        },
    },
    Procedure {
        text: "Slow swings through rest: a sine of 10 mm at 0.25 Hz for 16 s",
        excitation: Excitation::Tracked {
            motion: |place| {
                let swing = sine(0.01, 0.25, 4);
                Motion::new(place.middle_m, Limits::BRISK, &[hold(1.0), swing])
            },
            set_up: SetUp::AS_IT_IS,
        },
    },
];

// motions

fn hold(seconds: f64) -> Segment {
    Segment::Hold { seconds }
}

fn go(to_m: f64) -> Segment {
    Segment::Move { to_m }
}

fn sine(amplitude_m: f64, frequency_hz: f64, periods: u32) -> Segment {
    Segment::Sine {
        amplitude_m,
        frequency_hz,
        periods,
    }
}

/// To and fro at three peak speeds: the sines' amplitudes are what the speed allows.
fn strokes(place: Place) -> Motion {
    let swing = |peak_m_per_s: f64, frequency_hz: f64, periods| {
        let amplitude_m = peak_m_per_s / (std::f64::consts::TAU * frequency_hz);
        sine(amplitude_m.min(place.half_stroke_m), frequency_hz, periods)
    };
    let segments = [
        hold(1.0),
        swing(0.05, 0.25, 3),
        swing(0.15, 0.5, 4),
        swing(0.5, 0.8, 5),
    ];
    Motion::new(place.middle_m, Limits::BRISK, &segments)
}

// commands

/// Pulses of these amplitudes to either side of the null, one every `period_s`.
fn pulses(null_v: f64, amplitudes_v: &[f64], duration_s: f64, period_s: f64) -> Command {
    let both = amplitudes_v
        .iter()
        .flat_map(|amplitude| [*amplitude, -*amplitude]);
    let pulse = |(number, offset_v): (usize, f64)| Pulse {
        at_s: 0.2 + number as f64 * period_s,
        duration_s,
        to_v: null_v + offset_v,
    };
    one_after_the_other(&[(
        f64::INFINITY,
        Shape::Pulses {
            from_v: null_v,
            pulses: both.enumerate().map(pulse).collect(),
        },
    )])
}

fn chirp(null_v: f64, amplitude_v: f64) -> Shape {
    Shape::Chirp {
        center_v: null_v,
        amplitude_v,
        from_hz: 5.0,
        to_hz: 100.0,
        over_s: 3.0,
    }
}

/// Up, down through the null, and back to it.
fn triangle(null_v: f64, amplitude_v: f64, period_s: f64) -> Vec<(f64, Shape)> {
    let (low, high) = (null_v - amplitude_v, null_v + amplitude_v);
    let ramp = |from_v, to_v, over_s| {
        let shape = Shape::Ramp {
            at_s: 0.0,
            over_s,
            from_v,
            to_v,
        };
        (over_s, shape)
    };
    vec![
        ramp(null_v, high, 0.25 * period_s),
        ramp(high, low, 0.5 * period_s),
        ramp(low, null_v, 0.25 * period_s),
    ]
}

fn one_after_the_other(parts: &[(f64, Shape)]) -> Command {
    let mut start_s = 0.0;
    let stretch = |(seconds, shape): &(f64, Shape)| {
        let stretch = Stretch {
            start_s,
            shape: shape.clone(),
        };
        start_s += seconds;
        stretch
    };
    Command {
        segments: parts.iter().map(stretch).collect(),
    }
}
