//! The command of a scenario: segments of volts over time.

use super::time_grid::on_time_grid;

/// One segment after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Command {
    /// In the order of the file; the last one lasts for ever.
    pub segments: Vec<Segment>,
}

/// A shape that holds from its start to the start of the next segment.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Time at which the segment begins, s.
    pub start_s: f64,
    /// The command over the time since then.
    pub shape: Shape,
}

/// A command over the time since its segment began, V.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Always the same.
    Constant {
        /// The command, V.
        value_v: f64,
    },
    /// From one value to another at once.
    Step {
        /// Time of the step, s.
        at_s: f64,
        /// Before, V.
        from_v: f64,
        /// From then on, V.
        to_v: f64,
    },
    /// A base with pulses; where two overlap, the later in the list holds.
    Pulses {
        /// Between the pulses, V.
        from_v: f64,
        /// The pulses.
        pulses: Vec<Pulse>,
    },
    /// From one value to another at a constant rate.
    Ramp {
        /// Time at which it begins, s.
        at_s: f64,
        /// How long it takes, s.
        over_s: f64,
        /// Before, V.
        from_v: f64,
        /// After, V.
        to_v: f64,
    },
    /// center + amplitude sin(2 pi f t + phase).
    Sine {
        /// Mean, V.
        center_v: f64,
        /// Amplitude, V.
        amplitude_v: f64,
        /// Frequency, Hz.
        frequency_hz: f64,
        /// Phase at the start, rad.
        phase_rad: f64,
    },
    /// A sine whose frequency rises or falls at a constant rate, then stays.
    Chirp {
        /// Mean, V.
        center_v: f64,
        /// Amplitude, V.
        amplitude_v: f64,
        /// Frequency at the start, Hz.
        from_hz: f64,
        /// Frequency at the end, Hz.
        to_hz: f64,
        /// How long the sweep takes, s.
        over_s: f64,
    },
    /// A sum of sines of one amplitude, with Schroeder's phases.
    Multisine {
        /// Mean, V.
        center_v: f64,
        /// Amplitude of each line, V.
        amplitude_v: f64,
        /// The lines, Hz.
        frequencies_hz: Vec<f64>,
    },
    /// Recorded points, each held until the next; the ends are held for ever.
    Table {
        /// Times, s, rising.
        time_s: Vec<f64>,
        /// The command from then on, V.
        command_v: Vec<f64>,
    },
}

/// One pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// Its beginning, s.
    pub at_s: f64,
    /// Its length, s.
    pub duration_s: f64,
    /// The command in it, V.
    pub to_v: f64,
}

impl Command {
    /// The command at a time, V; 0 V where there is no segment at all.
    pub fn at(&self, time_s: f64) -> f64 {
        let begun = |segment: &&Segment| segment.start_s <= time_s;
        let segment = self.segments.iter().rev().find(begun);
        segment.or(self.segments.first()).map_or(0.0, |segment| {
            segment.shape.at(on_time_grid(time_s - segment.start_s))
        })
    }
}

impl Shape {
    /// The command at a time since the segment's start, V.
    pub fn at(&self, time_s: f64) -> f64 {
        match self {
            Self::Constant { value_v } => *value_v,
            Self::Step { at_s, from_v, to_v } => {
                if time_s >= *at_s {
                    *to_v
                } else {
                    *from_v
                }
            }
            Self::Pulses { from_v, pulses } => {
                let mut holding = pulses.iter().rev().filter(|pulse| pulse.holds(time_s));
                holding.next().map_or(*from_v, |pulse| pulse.to_v)
            }
            Self::Ramp {
                at_s,
                over_s,
                from_v,
                to_v,
            } => from_v + (to_v - from_v) * ((time_s - at_s) / over_s).clamp(0.0, 1.0),
            Self::Sine {
                center_v,
                amplitude_v,
                frequency_hz,
                phase_rad,
            } => center_v + amplitude_v * sine(frequency_hz * time_s, *phase_rad),
            Self::Chirp {
                center_v,
                amplitude_v,
                from_hz,
                to_hz,
                over_s,
            } => center_v + amplitude_v * sine(swept_turns(time_s, *from_hz, *to_hz, *over_s), 0.0),
            Self::Multisine {
                center_v,
                amplitude_v,
                frequencies_hz,
            } => center_v + amplitude_v * multisine(time_s, frequencies_hz),
            Self::Table {
                time_s: at,
                command_v,
            } => {
                let begun = at.partition_point(|start| *start <= time_s);
                command_v
                    .get(begun.saturating_sub(1))
                    .copied()
                    .unwrap_or(0.0)
            }
        }
    }
}

impl Pulse {
    fn holds(&self, time_s: f64) -> bool {
        time_s >= self.at_s && time_s < on_time_grid(self.at_s + self.duration_s)
    }
}

/// The sine of a number of turns plus a phase: of `libm`, so that the same
/// scenario gives the same bytes on every machine.
fn sine(turns: f64, phase_rad: f64) -> f64 {
    libm::sin(std::f64::consts::TAU * turns + phase_rad)
}

/// The integral of the swept frequency.
fn swept_turns(time_s: f64, from_hz: f64, to_hz: f64, over_s: f64) -> f64 {
    let swept_s = time_s.min(over_s);
    let sweep = from_hz * swept_s + 0.5 * (to_hz - from_hz) / over_s * swept_s * swept_s;
    sweep + to_hz * (time_s - swept_s)
}

/// Schroeder's phases, -pi k (k-1) / n, keep the peak of the sum low.
fn multisine(time_s: f64, frequencies_hz: &[f64]) -> f64 {
    let count = frequencies_hz.len() as f64;
    let line = |(index, frequency_hz): (usize, &f64)| {
        let index = index as f64;
        let phase_rad = -std::f64::consts::PI * index * (index + 1.0) / count;
        sine(frequency_hz * time_s, phase_rad)
    };
    frequencies_hz.iter().enumerate().map(line).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(left: f64, right: f64) -> bool {
        (left - right).abs() < 1e-9
    }

    #[test]
    fn val_a_chirp_has_its_frequencies() {
        let turns = |time_s| swept_turns(time_s, 1.0, 5.0, 2.0);
        let frequency = |time_s| (turns(time_s + 1e-6) - turns(time_s - 1e-6)) / 2e-6;
        assert!((frequency(1e-5) - 1.0).abs() < 1e-3);
        assert!((frequency(1.0) - 3.0).abs() < 1e-3);
        assert!((frequency(3.0) - 5.0).abs() < 1e-3);
    }

    #[test]
    fn val_segments_follow_each_other_each_with_its_own_time() {
        let command = Command {
            segments: vec![
                Segment {
                    start_s: 0.0,
                    shape: Shape::Constant { value_v: 5.0 },
                },
                Segment {
                    start_s: on_time_grid(0.1 + 0.2),
                    shape: Shape::Ramp {
                        at_s: 0.1,
                        over_s: 0.2,
                        from_v: 5.0,
                        to_v: 6.0,
                    },
                },
            ],
        };
        for (time_s, expected) in [(0.299, 5.0), (0.3, 5.0), (0.5, 5.5), (9.0, 6.0)] {
            assert!(close(command.at(time_s), expected), "at {time_s} s");
        }
    }

    #[test]
    fn val_pulses_and_tables_hold_to_the_next_point() {
        let pulses = Shape::Pulses {
            from_v: 5.0,
            pulses: vec![Pulse {
                at_s: 0.1,
                duration_s: 0.2,
                to_v: 7.0,
            }],
        };
        let table = Shape::Table {
            time_s: vec![0.1, 0.3],
            command_v: vec![7.0, 5.0],
        };
        for (time_s, expected) in [(0.1, 7.0), (0.299, 7.0), (0.3, 5.0)] {
            assert!(close(pulses.at(time_s), expected), "pulse at {time_s} s");
            assert!(close(table.at(time_s), expected), "table at {time_s} s");
        }
        assert!(close(table.at(0.0), 7.0), "the first point holds before it");
    }

    #[test]
    fn prop_schroeder_phases_keep_a_multisine_low() {
        let lines: Vec<f64> = (1..=16).map(f64::from).collect();
        let peak = (0..1000)
            .map(|row| multisine(f64::from(row) * 1e-3, &lines).abs())
            .fold(0.0, f64::max);
        // In phase they would reach about 13; their rms is 2.8.
        assert!(peak < 6.0, "{peak}");
    }
}
