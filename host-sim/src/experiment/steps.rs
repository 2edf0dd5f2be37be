//! Steps of the file as steps of the board.

use firmware::experiment::{Defect, Step};
use serde::Deserialize;

/// A step of the file.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum FileStep {
    /// The valve at one opening.
    Opening {
        seconds: f64,
        #[serde(rename = "opening_V")]
        opening_v: f64,
    },
    /// The valve's opening in a straight line.
    Ramp {
        seconds: f64,
        #[serde(rename = "from_V")]
        from_v: f64,
        #[serde(rename = "to_V")]
        to_v: f64,
    },
    /// Through the null and back, once or more.
    Triangle {
        seconds: f64,
        #[serde(rename = "amplitude_V")]
        amplitude_v: f64,
        #[serde(default = "once")]
        periods: u32,
    },
    Chirp {
        seconds: f64,
        #[serde(rename = "amplitude_V")]
        amplitude_v: f64,
        #[serde(rename = "from_Hz")]
        from_hz: f64,
        #[serde(rename = "to_Hz")]
        to_hz: f64,
    },
    Multisine {
        seconds: f64,
        #[serde(rename = "rms_V")]
        rms_v: f64,
        #[serde(rename = "base_Hz")]
        base_hz: f64,
    },
    Bursts {
        seconds: f64,
        #[serde(rename = "amplitude_V")]
        amplitude_v: f64,
        shortest_s: f64,
        longest_s: f64,
    },
    Force {
        seconds: f64,
        #[serde(rename = "force_N")]
        force_n: f64,
    },
    Move {
        seconds: f64,
        to_m: f64,
    },
    Hold {
        seconds: f64,
    },
    Sine {
        amplitude_m: f64,
        #[serde(rename = "frequency_Hz")]
        frequency_hz: f64,
        periods: f64,
    },
    /// There and back between two places with growing rests: how stiction grows.
    Dwell {
        from_m: f64,
        to_m: f64,
        move_s: f64,
        rests_s: Vec<f64>,
    },
}

fn once() -> u32 {
    1
}

impl FileStep {
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::Opening { .. } => "opening",
            Self::Ramp { .. } => "ramp",
            Self::Triangle { .. } => "triangle",
            Self::Chirp { .. } => "chirp",
            Self::Multisine { .. } => "multisine",
            Self::Bursts { .. } => "bursts",
            Self::Force { .. } => "force",
            Self::Move { .. } => "move",
            Self::Hold { .. } => "hold",
            Self::Sine { .. } => "sine",
            Self::Dwell { .. } => "dwell",
        }
    }

    /// As the board's steps.
    pub(super) fn steps(&self) -> Vec<Step> {
        match self {
            Self::Dwell {
                from_m,
                to_m,
                move_s,
                rests_s,
            } => dwell([*from_m, *to_m], *move_s, rests_s),
            Self::Opening { seconds, opening_v } => vec![ramp(*seconds, *opening_v, *opening_v)],
            Self::Ramp {
                seconds,
                from_v,
                to_v,
            } => vec![ramp(*seconds, *from_v, *to_v)],
            simple => simple.wave().or(simple.of_the_loop()).into_iter().collect(),
        }
    }

    /// A step of the valve that changes all the time.
    fn wave(&self) -> Option<Step> {
        let f = |value: f64| value as f32;
        Some(match *self {
            Self::Triangle {
                seconds,
                amplitude_v,
                periods,
            } => Step::Triangle {
                seconds: f(seconds),
                amplitude_v: f(amplitude_v),
                period_s: f(seconds / f64::from(periods)),
            },
            Self::Chirp {
                seconds,
                amplitude_v,
                from_hz,
                to_hz,
            } => Step::Chirp {
                seconds: f(seconds),
                amplitude_v: f(amplitude_v),
                from_hz: f(from_hz),
                to_hz: f(to_hz),
            },
            Self::Multisine {
                seconds,
                rms_v,
                base_hz,
            } => Step::Multisine {
                seconds: f(seconds),
                rms_v: f(rms_v),
                base_hz: f(base_hz),
            },
            Self::Bursts {
                seconds,
                amplitude_v,
                shortest_s,
                longest_s,
            } => Step::Bursts {
                seconds: f(seconds),
                amplitude_v: f(amplitude_v),
                shortest_s: f(shortest_s),
                longest_s: f(longest_s),
            },
            _ => return None,
        })
    }

    /// A step of a loop.
    fn of_the_loop(&self) -> Option<Step> {
        let f = |value: f64| value as f32;
        Some(match *self {
            Self::Force { seconds, force_n } => Step::Force {
                seconds: f(seconds),
                force_n: f(force_n),
            },
            Self::Move { seconds, to_m } => Step::Move {
                seconds: f(seconds),
                to_m: f(to_m),
            },
            Self::Hold { seconds } => Step::Hold {
                seconds: f(seconds),
            },
            Self::Sine {
                amplitude_m,
                frequency_hz,
                periods,
            } => Step::Sine {
                seconds: f(periods / frequency_hz),
                amplitude_m: f(amplitude_m),
                frequency_hz: f(frequency_hz),
            },
            _ => return None,
        })
    }

    /// The key of the file that a defect of a step is about, and what it may be.
    pub(super) fn key_of(&self, defect: Defect) -> (&'static str, &'static str) {
        match (defect, self) {
            (Defect::Seconds, Self::Sine { .. }) => {
                ("periods", "periods that take up to 600 s in all")
            }
            (Defect::Seconds, Self::Dwell { .. }) => {
                ("rests_s", "seconds above 0, up to 600 with the way")
            }
            (Defect::Seconds, _) => ("seconds", "seconds above 0, up to 600"),
            (Defect::Opening, Self::Ramp { .. }) => {
                ("from_V, to_V", "volts from the valve's null, within 5")
            }
            (Defect::Opening, Self::Opening { .. }) => {
                ("opening_V", "volts from the valve's null, within 5")
            }
            (Defect::Opening, Self::Multisine { .. }) => {
                ("rms_V", "volts from the valve's null, within 5")
            }
            (Defect::Opening, _) => ("amplitude_V", "volts from the valve's null, within 5"),
            (Defect::Frequency, Self::Chirp { .. }) => ("from_Hz, to_Hz", "Hz above 0, up to 100"),
            (Defect::Frequency, Self::Multisine { .. }) => (
                "base_Hz",
                "Hz above 0, up to 12.5: the eighth harmonic is up to 100",
            ),
            (Defect::Frequency, Self::Triangle { .. }) => {
                ("periods", "1 or more, each of 10 ms or longer")
            }
            (Defect::Frequency, _) => ("frequency_Hz", "Hz above 0, up to 100"),
            (Defect::Pulse, _) => (
                "shortest_s, longest_s",
                "seconds above 0, the shortest no longer than the longest",
            ),
            (Defect::Force, _) => ("force_N", "newtons within 3000"),
            (Defect::Place, Self::Sine { .. }) => ("amplitude_m", "metres within 0.25"),
            (Defect::Place, Self::Dwell { .. }) => ("from_m, to_m", "metres within 0.25"),
            (Defect::Place, _) => ("to_m", "metres within 0.25, from the middle of the stroke"),
        }
    }
}

fn ramp(seconds: f64, from_v: f64, to_v: f64) -> Step {
    Step::Opening {
        seconds: seconds as f32,
        from_v: from_v as f32,
        to_v: to_v as f32,
    }
}

fn dwell([from_m, to_m]: [f64; 2], move_s: f64, rests_s: &[f64]) -> Vec<Step> {
    let go = |place_m: f64, rest_s: f64| Step::Move {
        seconds: (move_s + rest_s) as f32,
        to_m: place_m as f32,
    };
    let there_and_back = |rest_s: &f64| [go(to_m, *rest_s), go(from_m, *rest_s)];
    rests_s.iter().flat_map(there_and_back).collect()
}
