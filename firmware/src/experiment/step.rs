//! What a step of an experiment is.

/// Steps of a program at the most.
pub const MOST_STEPS: usize = 24;
/// Bytes of a step: its kind and four numbers.
pub const STEP_BYTES: usize = 17;
/// The longest that one step may take, s.
const LONGEST_S: f32 = 600.0;
/// The valve's full opening, V.
const FULL_OPENING_V: f32 = 5.0;
/// The fastest wave: a tenth of the slowest board's ticks, Hz.
const FASTEST_HZ: f32 = 100.0;
/// The farthest place or amplitude, m: the position converter's half.
const FARTHEST_M: f32 = 0.25;
/// The largest force, N: a bore of 63 mm at 10 bar.
const MOST_FORCE_N: f32 = 3000.0;

/// One step. Openings are volts from the valve's null; what is `seconds` long is a whole step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// The valve's opening goes from one value to another in a straight line.
    Opening {
        /// Length, s.
        seconds: f32,
        /// At the begin, V.
        from_v: f32,
        /// At the end, V.
        to_v: f32,
    },
    /// The opening goes through the null to and fro in straight lines.
    Triangle {
        /// Length, s.
        seconds: f32,
        /// Amplitude, V.
        amplitude_v: f32,
        /// Time from one peak to the next, s.
        period_s: f32,
    },
    /// A sine of the opening whose frequency grows in a straight line.
    Chirp {
        /// Length, s.
        seconds: f32,
        /// Amplitude, V.
        amplitude_v: f32,
        /// Frequency at the begin, Hz.
        from_hz: f32,
        /// At the end, Hz.
        to_hz: f32,
    },
    /// Eight harmonics of the opening with Schroeder's phases.
    Multisine {
        /// Length, s.
        seconds: f32,
        /// Root mean square, V.
        rms_v: f32,
        /// Lowest frequency, Hz.
        base_hz: f32,
    },
    /// Pulses of the opening there and back, of drawn lengths.
    Bursts {
        /// Length, s.
        seconds: f32,
        /// Height, V.
        amplitude_v: f32,
        /// Shortest pulse, s.
        shortest_s: f32,
        /// Longest pulse, s.
        longest_s: f32,
    },
    /// The gas pushes with a force, along +x.
    Force {
        /// Length, s.
        seconds: f32,
        /// Force, N.
        force_n: f32,
    },
    /// The loop goes to a place, within the limits of the settings, and holds the load there.
    Move {
        /// Length, s.
        seconds: f32,
        /// Place, m.
        to_m: f32,
    },
    /// The loop holds the load where it is.
    Hold {
        /// Length, s.
        seconds: f32,
    },
    /// The loop swings the load about where it is.
    Sine {
        /// Length, s.
        seconds: f32,
        /// Amplitude, m.
        amplitude_m: f32,
        /// Frequency, Hz.
        frequency_hz: f32,
    },
}

/// What of a step is impossible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// Its length.
    Seconds,
    /// An opening.
    Opening,
    /// A frequency.
    Frequency,
    /// The length of a pulse.
    Pulse,
    /// A force.
    Force,
    /// A place or amplitude.
    Place,
}

impl Step {
    /// Kind and numbers; those that a kind has not are nought.
    fn parts(&self) -> (u8, [f32; 4]) {
        match *self {
            Self::Opening {
                seconds,
                from_v,
                to_v,
            } => (1, [seconds, from_v, to_v, 0.0]),
            Self::Chirp {
                seconds,
                amplitude_v,
                from_hz,
                to_hz,
            } => (2, [seconds, amplitude_v, from_hz, to_hz]),
            Self::Multisine {
                seconds,
                rms_v,
                base_hz,
            } => (3, [seconds, rms_v, base_hz, 0.0]),
            Self::Bursts {
                seconds,
                amplitude_v,
                shortest_s,
                longest_s,
            } => (4, [seconds, amplitude_v, shortest_s, longest_s]),
            Self::Force { seconds, force_n } => (5, [seconds, force_n, 0.0, 0.0]),
            Self::Move { seconds, to_m } => (6, [seconds, to_m, 0.0, 0.0]),
            Self::Hold { seconds } => (7, [seconds, 0.0, 0.0, 0.0]),
            Self::Sine {
                seconds,
                amplitude_m,
                frequency_hz,
            } => (8, [seconds, amplitude_m, frequency_hz, 0.0]),
            Self::Triangle {
                seconds,
                amplitude_v,
                period_s,
            } => (9, [seconds, amplitude_v, period_s, 0.0]),
        }
    }

    /// Its bytes, little-endian.
    pub fn bytes(&self) -> [u8; STEP_BYTES] {
        let (kind, numbers) = self.parts();
        let mut bytes = [kind; STEP_BYTES];
        for (place, number) in bytes[1..].chunks_exact_mut(4).zip(numbers) {
            place.copy_from_slice(&number.to_le_bytes());
        }
        bytes
    }

    /// Reads a step; none where it is none.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let (&kind, mut rest) = bytes.split_first()?;
        let mut numbers = [0.0; 4];
        for number in &mut numbers {
            let (head, tail) = rest.split_first_chunk::<4>()?;
            *number = f32::from_le_bytes(*head);
            rest = tail;
        }
        let [seconds, one, two, three] = numbers;
        let step = match kind {
            1 => Self::Opening {
                seconds,
                from_v: one,
                to_v: two,
            },
            2 => Self::Chirp {
                seconds,
                amplitude_v: one,
                from_hz: two,
                to_hz: three,
            },
            3 => Self::Multisine {
                seconds,
                rms_v: one,
                base_hz: two,
            },
            4 => Self::Bursts {
                seconds,
                amplitude_v: one,
                shortest_s: two,
                longest_s: three,
            },
            5 => Self::Force {
                seconds,
                force_n: one,
            },
            6 => Self::Move { seconds, to_m: one },
            7 => Self::Hold { seconds },
            8 => Self::Sine {
                seconds,
                amplitude_m: one,
                frequency_hz: two,
            },
            9 => Self::Triangle {
                seconds,
                amplitude_v: one,
                period_s: two,
            },
            _ => return None,
        };
        rest.is_empty().then_some(step)
    }

    /// Its length, s.
    pub fn seconds(&self) -> f32 {
        self.parts().1[0]
    }

    /// What of it is impossible; a number that is none always is.
    pub fn defect(&self) -> Option<Defect> {
        let is_within = |value: f32, most: f32| value.abs() <= most;
        let is_wave = |hz: f32| hz > 0.0 && hz <= FASTEST_HZ;
        let seconds = self.seconds();
        if !(seconds > 0.0 && seconds <= LONGEST_S) {
            return Some(Defect::Seconds);
        }
        let (is_sound, defect) = match *self {
            Self::Opening { from_v, to_v, .. } => (
                is_within(from_v, FULL_OPENING_V) && is_within(to_v, FULL_OPENING_V),
                Defect::Opening,
            ),
            Self::Triangle { amplitude_v, .. } if !is_within(amplitude_v, FULL_OPENING_V) => {
                (false, Defect::Opening)
            }
            Self::Triangle { period_s, .. } => (
                (1.0 / FASTEST_HZ..=LONGEST_S).contains(&period_s),
                Defect::Frequency,
            ),
            Self::Chirp { amplitude_v, .. } if !is_within(amplitude_v, FULL_OPENING_V) => {
                (false, Defect::Opening)
            }
            Self::Chirp { from_hz, to_hz, .. } => {
                (is_wave(from_hz) && is_wave(to_hz), Defect::Frequency)
            }
            Self::Multisine { rms_v, .. } if !is_within(rms_v, FULL_OPENING_V) => {
                (false, Defect::Opening)
            }
            Self::Multisine { base_hz, .. } => (is_wave(8.0 * base_hz), Defect::Frequency),
            Self::Bursts { amplitude_v, .. } if !is_within(amplitude_v, FULL_OPENING_V) => {
                (false, Defect::Opening)
            }
            Self::Bursts {
                shortest_s,
                longest_s,
                ..
            } => (
                shortest_s > 0.0 && shortest_s <= longest_s && longest_s <= LONGEST_S,
                Defect::Pulse,
            ),
            Self::Force { force_n, .. } => (is_within(force_n, MOST_FORCE_N), Defect::Force),
            Self::Move { to_m, .. } => (is_within(to_m, FARTHEST_M), Defect::Place),
            Self::Hold { .. } => (true, Defect::Seconds),
            Self::Sine { amplitude_m, .. } if !is_within(amplitude_m, FARTHEST_M) => {
                (false, Defect::Place)
            }
            Self::Sine { frequency_hz, .. } => (is_wave(frequency_hz), Defect::Frequency),
        };
        (!is_sound).then_some(defect)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) const ALL: [Step; 9] = [
        Step::Opening {
            seconds: 1.0,
            from_v: -0.5,
            to_v: 0.5,
        },
        Step::Triangle {
            seconds: 8.0,
            amplitude_v: 1.0,
            period_s: 0.8,
        },
        Step::Chirp {
            seconds: 2.0,
            amplitude_v: 0.4,
            from_hz: 0.5,
            to_hz: 20.0,
        },
        Step::Multisine {
            seconds: 3.0,
            rms_v: 0.3,
            base_hz: 0.5,
        },
        Step::Bursts {
            seconds: 4.0,
            amplitude_v: 1.0,
            shortest_s: 0.02,
            longest_s: 0.1,
        },
        Step::Force {
            seconds: 1.0,
            force_n: 50.0,
        },
        Step::Move {
            seconds: 1.5,
            to_m: 0.06,
        },
        Step::Hold { seconds: 0.5 },
        Step::Sine {
            seconds: 4.0,
            amplitude_m: 0.03,
            frequency_hz: 0.5,
        },
    ];

    #[test]
    fn prop_a_step_comes_back_and_is_sound() {
        for step in ALL {
            assert_eq!(Step::read(&step.bytes()), Some(step));
            assert_eq!(step.defect(), None, "{step:?}");
            assert_eq!(Step::read(&step.bytes()[..16]), None);
        }
        assert_eq!(Step::read(&[99; STEP_BYTES]), None);
    }

    /// Each number in turn, made none or far too large.
    #[test]
    fn prop_what_is_impossible_is_refused() {
        for step in ALL {
            let used = step.parts().1.iter().filter(|one| **one != 0.0).count();
            for place in 0..used {
                for wrong in [f32::NAN, f32::INFINITY, 1e9] {
                    let mut bytes = step.bytes();
                    let at = 1 + 4 * place;
                    bytes[at..at + 4].copy_from_slice(&wrong.to_le_bytes());
                    let read = Step::read(&bytes).expect("a step");
                    assert!(read.defect().is_some(), "{read:?}");
                }
            }
        }
    }
}
