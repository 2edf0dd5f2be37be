//! What a step asks for at a tick.

use super::step::Step;
use micromath::F32Ext;
use model_core::controller::Wish;
use model_core::math::cosine_sine_of_turns;
use model_core::reference::Reference;

/// What is asked of the axis at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Asked {
    /// The valve, from its null, V.
    Opening(f32),
    /// A force of the gas, N.
    Force(f32),
    /// The loop.
    Reference(Reference<f32>),
}

impl Asked {
    /// What the loop is asked to follow; NaN where it is left out.
    #[inline]
    pub fn reference(self) -> Reference<f32> {
        match self {
            Self::Reference(reference) => reference,
            Self::Opening(_) | Self::Force(_) => Reference::at(f32::NAN),
        }
    }

    /// What is wished of valve or force.
    #[inline]
    pub fn wish(self, null_v: f32) -> Option<Wish<f32>> {
        match self {
            Self::Opening(opening_v) => Some(Wish::Command(null_v + opening_v)),
            Self::Force(force_n) => Some(Wish::Force(force_n)),
            Self::Reference(_) => None,
        }
    }
}

/// Harmonics of a multisine, and their phases in turns: -k (k - 1)/(2 N), which keeps the peak
/// low (Schroeder 1970).
const PHASES: [f32; 8] = [0.0, -0.125, -0.375, -0.75, -1.25, -1.875, -2.625, -3.5];
const TWO_PI: f32 = core::f32::consts::TAU;
/// Seed of the pulses: any but nought; the same program gives the same pulses.
const SEED: u32 = 0x9E37_79B9;

/// A step under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Course {
    step: Step,
    /// Ticks since it began, which add up without rounding.
    ticks: u32,
    /// Time since it began, s.
    time_s: f32,
    /// Where the loop held the load last; none after a step without the loop.
    place_m: Option<f32>,
    /// Turns of a wave.
    turns: f32,
    swing: Swing,
    pulse: Pulse,
}

/// A pulse there, back, and a rest, each of the same length.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pulse {
    random: u32,
    length_s: f32,
    /// Time left of this part, s.
    left_s: f32,
    /// The part: first way, other way, rest.
    part: u8,
    way: f32,
}

impl Course {
    pub(super) fn new(step: Step) -> Self {
        Self {
            step,
            ticks: 0,
            time_s: 0.0,
            place_m: None,
            turns: 0.0,
            swing: Swing::default(),
            pulse: Pulse {
                random: SEED,
                length_s: 0.0,
                left_s: 0.0,
                part: 2,
                way: 1.0,
            },
        }
    }

    /// Goes on with the next step.
    pub(super) fn follow_with(&mut self, step: Step) {
        *self = Self {
            place_m: self.place_m,
            ..Self::new(step)
        };
    }

    pub(super) fn is_over(&self) -> bool {
        self.time_s >= self.step.seconds()
    }

    /// What it asks for now; then it is a tick later.
    #[inline]
    pub(super) fn step(&mut self, dt_s: f32, position_m: f32) -> Asked {
        let asked = self.asked(dt_s, position_m);
        if !matches!(asked, Asked::Reference(_)) {
            self.place_m = None;
        }
        self.ticks = self.ticks.saturating_add(1);
        #[expect(clippy::cast_precision_loss, reason = "600 s at 8 kHz are under 2^24")]
        let ticks = self.ticks as f32;
        self.time_s = ticks * dt_s;
        asked
    }

    fn asked(&mut self, dt_s: f32, position_m: f32) -> Asked {
        match self.step {
            Step::Opening {
                seconds,
                from_v,
                to_v,
            } => Asked::Opening(from_v + (to_v - from_v) * (self.time_s / seconds)),
            Step::Triangle {
                amplitude_v,
                period_s,
                ..
            } => {
                let turns = self.turned(dt_s / period_s);
                Asked::Opening(amplitude_v * triangle(turns))
            }
            Step::Chirp {
                seconds,
                amplitude_v,
                from_hz,
                to_hz,
            } => {
                let hz = from_hz + (to_hz - from_hz) * (self.time_s / seconds);
                let turns = self.turned(hz * dt_s);
                Asked::Opening(amplitude_v * cosine_of_turns(turns - 0.25))
            }
            Step::Multisine { rms_v, base_hz, .. } => {
                let turns = self.turned(base_hz * dt_s);
                Asked::Opening(rms_v * harmonics(turns))
            }
            Step::Bursts {
                amplitude_v,
                shortest_s,
                longest_s,
                ..
            } => Asked::Opening(amplitude_v * self.pulse.step(dt_s, [shortest_s, longest_s])),
            Step::Force { force_n, .. } => Asked::Force(force_n),
            Step::Move { to_m, .. } => {
                self.place_m = Some(to_m);
                Asked::Reference(Reference::at(to_m))
            }
            Step::Hold { .. } => {
                let place_m = *self.place_m.get_or_insert(position_m);
                Asked::Reference(Reference::at(place_m))
            }
            Step::Sine {
                amplitude_m,
                frequency_hz,
                ..
            } => {
                let centre_m = *self.place_m.get_or_insert(position_m);
                let wave = self.swing.step(frequency_hz * dt_s);
                Asked::Reference(swing(centre_m, amplitude_m, frequency_hz, wave))
            }
        }
    }

    /// The turns so far, which then are more by these.
    fn turned(&mut self, by: f32) -> f32 {
        let turns = self.turns;
        let next = turns + by;
        self.turns = if next >= 1.0 { next - 1.0 } else { next };
        turns
    }
}

/// Cosine and sine of an angle that grows by the same at every tick, turned on instead of computed
/// anew: beside the loop a tick has no time to spare.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Swing {
    /// Of the angle of now; noughts before the first tick.
    now: [f32; 2],
    /// Of what it grows by.
    by: [f32; 2],
}

impl Swing {
    #[inline]
    fn step(&mut self, turns: f32) -> [f32; 2] {
        let [cosine, sine] = self.now;
        if cosine == 0.0 && sine == 0.0 {
            let (cosine, sine) = cosine_sine_of_turns(turns);
            self.by = [cosine, sine];
            self.now = [1.0, 0.0];
        } else {
            let [by_cosine, by_sine] = self.by;
            let turned = [
                cosine * by_cosine - sine * by_sine,
                sine * by_cosine + cosine * by_sine,
            ];
            // Newton's step towards a length of 1: rounding does not add up.
            let length = 1.5 - 0.5 * (turned[0] * turned[0] + turned[1] * turned[1]);
            self.now = turned.map(|one| one * length);
        }
        self.now
    }
}

fn swing(
    centre_m: f32,
    amplitude_m: f32,
    frequency_hz: f32,
    [cosine, sine]: [f32; 2],
) -> Reference<f32> {
    let per_s = TWO_PI * frequency_hz;
    Reference {
        position_m: centre_m + amplitude_m * sine,
        velocity_m_per_s: amplitude_m * per_s * cosine,
        acceleration_m_per_s2: -amplitude_m * per_s * per_s * sine,
    }
}

/// Up from nought, down through it, and back, at a place within a turn.
fn triangle(turns: f32) -> f32 {
    if turns < 0.25 {
        4.0 * turns
    } else if turns < 0.75 {
        2.0 - 4.0 * turns
    } else {
        4.0 * turns - 4.0
    }
}

/// The cosine that excites an axis, to 0.11 %: under half a step of the 12-bit converter up to an
/// amplitude of 1.1 V, at half of the cost (docs/model.md, Approximations). What is commanded
/// stands in the recording.
#[inline(never)]
fn cosine_of_turns(turns: f32) -> f32 {
    F32Ext::cos(TWO_PI * turns)
}

/// Eight harmonics of a root mean square of 1: each has half of it, as 8 (1/2)^2/2 = 1.
fn harmonics(turns: f32) -> f32 {
    let mut sum = 0.0;
    let mut harmonic = 0.0;
    for phase in PHASES {
        harmonic += 1.0;
        sum += 0.5 * cosine_of_turns(harmonic * turns + phase);
    }
    sum
}

impl Pulse {
    fn step(&mut self, dt_s: f32, lengths_s: [f32; 2]) -> f32 {
        if self.left_s <= 0.0 {
            self.part = if self.part >= 2 {
                self.draw(lengths_s);
                0
            } else {
                self.part + 1
            };
            self.left_s += self.length_s;
        }
        self.left_s -= dt_s;
        match self.part {
            0 => self.way,
            1 => -self.way,
            _ => 0.0,
        }
    }

    /// Length and way of the next pulse (xorshift, Marsaglia 2003).
    fn draw(&mut self, [shortest_s, longest_s]: [f32; 2]) {
        let mut random = self.random;
        random ^= random << 13;
        random ^= random >> 17;
        random ^= random << 5;
        self.random = random;
        self.way = if random & 1 == 0 { 1.0 } else { -1.0 };
        let share = f32::from((random >> 16) as u16) * (1.0 / 65_536.0);
        self.length_s = shortest_s + share * (longest_s - shortest_s);
        self.left_s = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const DT_S: f32 = 1e-3;

    /// Openings of a step, tick by tick.
    fn openings(step: Step) -> Vec<f32> {
        let mut course = Course::new(step);
        let mut all = Vec::new();
        while !course.is_over() {
            match course.step(DT_S, 0.0) {
                Asked::Opening(opening_v) => all.push(opening_v),
                other => panic!("{other:?}"),
            }
        }
        all
    }

    #[test]
    fn val_a_multisine_has_its_root_mean_square_and_a_low_peak() {
        let all = openings(Step::Multisine {
            seconds: 2.0,
            rms_v: 0.5,
            base_hz: 1.0,
        });
        let square = all.iter().map(|one| one * one).sum::<f32>() / all.len() as f32;
        assert!((square.sqrt() - 0.5).abs() < 1e-3, "{}", square.sqrt());
        let peak = all.iter().fold(0.0_f32, |most, one| most.max(one.abs()));
        // Eight sines in step would have a crest of 4.
        assert!(peak < 0.5 * 2.0, "{peak}");
        let mean = all.iter().sum::<f32>() / all.len() as f32;
        assert!(mean.abs() < 1e-3, "{mean}");
    }

    #[test]
    fn val_a_triangle_goes_through_its_corners() {
        let all = openings(Step::Triangle {
            seconds: 1.6,
            amplitude_v: 0.5,
            period_s: 0.8,
        });
        for (tick, expected_v) in [(0, 0.0), (200, 0.5), (400, 0.0), (600, -0.5), (1400, -0.5)] {
            assert!(
                (all[tick] - expected_v).abs() < 3e-3,
                "{tick}: {}",
                all[tick]
            );
        }
    }

    /// Zero crossings of a chirp from 2 to 6 Hz over 4 s: 16 turns.
    #[test]
    fn val_a_chirp_turns_as_often_as_its_mean_frequency_says() {
        let all = openings(Step::Chirp {
            seconds: 4.0,
            amplitude_v: 1.0,
            from_hz: 2.0,
            to_hz: 6.0,
        });
        let rises = all
            .windows(2)
            .filter(|pair| pair[0] < 0.0 && pair[1] >= 0.0);
        assert_eq!(rises.count(), 15);
        assert!(all.iter().all(|one| one.abs() <= 1.0));
    }

    #[test]
    fn val_the_exciting_cosine_is_within_its_error() {
        let errors = (-20_000..20_000).map(|step| {
            let turns = step as f32 * 3.7e-4;
            let exact = (f64::from(turns) * core::f64::consts::TAU).cos();
            (f64::from(cosine_of_turns(turns)) - exact).abs()
        });
        let most = errors.fold(0.0, f64::max);
        assert!((0.5e-3..1.1e-3).contains(&most), "{most}");
    }

    /// A minute of a sine keeps amplitude and phase.
    #[test]
    fn val_a_turned_sine_is_the_sine() {
        let mut swing = Swing::default();
        for tick in 0..60_000_u32 {
            let [cosine, sine] = swing.step(0.5e-3);
            let angle = f64::from(tick) * 0.5e-3 * core::f64::consts::TAU;
            let off = (f64::from(cosine) - angle.cos()).hypot(f64::from(sine) - angle.sin());
            assert!(off < 2e-3, "{off} at {tick}");
        }
    }

    #[test]
    fn prop_pulses_go_there_and_back_and_rest() {
        let all = openings(Step::Bursts {
            seconds: 20.0,
            amplitude_v: 0.8,
            shortest_s: 0.02,
            longest_s: 0.1,
        });
        let mean = all.iter().sum::<f32>() / all.len() as f32;
        assert!(mean.abs() < 0.8 * 0.1 / 20.0 * 2.0, "{mean}");
        let resting = all.iter().filter(|one| **one == 0.0).count();
        let share = resting as f32 / all.len() as f32;
        assert!((share - 1.0 / 3.0).abs() < 0.03, "{share}");
    }

    #[test]
    fn prop_a_hold_after_a_move_keeps_its_place_and_after_the_valve_takes_the_load_s() {
        let moved = Step::Move {
            seconds: DT_S,
            to_m: 0.05,
        };
        let hold = Step::Hold { seconds: 1.0 };
        let mut course = Course::new(moved);
        let at = |place_m: f32| Asked::Reference(Reference::at(place_m));
        assert_eq!(course.step(DT_S, 0.01), at(0.05));
        course.follow_with(hold);
        assert_eq!(course.step(DT_S, 0.049), at(0.05));
        let open = Step::Opening {
            seconds: DT_S,
            from_v: 0.0,
            to_v: 0.0,
        };
        course.follow_with(open);
        assert_eq!(course.step(DT_S, 0.05), Asked::Opening(0.0));
        course.follow_with(hold);
        assert_eq!(course.step(DT_S, 0.031), at(0.031));
        assert_eq!(course.step(DT_S, 0.032), at(0.031));
    }
}
