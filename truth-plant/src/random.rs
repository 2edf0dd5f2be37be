//! Random numbers that are the same for the same seed on every machine.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// What a sequence of random numbers is for. Each purpose of a seed has a
/// sequence of its own: taking an effect out of a case leaves its plant, its
/// excitation and its noise as they were.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Purpose {
    /// The values of the plant.
    Plant,
    /// The errors of what the engineer typed.
    Belief,
    /// Which effects there are.
    Choice,
    /// The size of the effect with this position in the case.
    Effect(usize),
    /// What drives the recording with this position.
    Excitation(usize),
    /// The noise of a signal of the recording with this position.
    Noise(usize, Signal),
    /// How far the rig lies outside of what its file can say.
    Nature,
    /// When an effect is present in the recording with this position.
    Onset(usize),
    /// What a test bench needs beyond the axis: its draws with this number.
    Bench(usize),
    /// The noise of a bench's channel with this number.
    BenchNoise(usize),
}

/// A signal with noise of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Signal {
    PressureA,
    PressureB,
    SupplyPressure,
    Position,
    Velocity,
}

impl Purpose {
    fn stream(self) -> u64 {
        let (family, index) = match self {
            Self::Plant => (0, 0),
            Self::Belief => (1, 0),
            Self::Choice => (2, 0),
            Self::Nature => (2, 1),
            Self::Effect(position) => (3, position),
            Self::Excitation(recording) => (4, recording),
            Self::Onset(recording) => (5, recording),
            Self::Noise(recording, signal) => (6 + signal as u64, recording),
            Self::Bench(draws) => (11, draws),
            Self::BenchNoise(channel) => (12, channel),
        };
        (family << 32) | index as u64
    }
}

/// A sequence of random numbers.
#[derive(Clone, Debug)]
pub(crate) struct Random {
    bits: ChaCha8Rng,
    spare_normal: Option<f64>,
}

impl Random {
    pub(crate) fn new(seed: u64, purpose: Purpose) -> Self {
        let mut bits = ChaCha8Rng::seed_from_u64(seed);
        bits.set_stream(purpose.stream());
        Self {
            bits,
            spare_normal: None,
        }
    }

    /// Uniform in `[0, 1)`.
    pub(crate) fn fraction(&mut self) -> f64 {
        (self.bits.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform between two values.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.fraction()
    }

    /// Uniform in the logarithm, within `factor` of `centre` either way.
    pub(crate) fn around(&mut self, centre: f64, factor: f64) -> f64 {
        centre * libm::pow(factor, self.between(-1.0, 1.0))
    }

    /// One of the items.
    pub(crate) fn one_of<'a, T>(&mut self, items: &'a [T]) -> &'a T {
        let position = (self.fraction() * items.len() as f64) as usize;
        &items[position.min(items.len() - 1)]
    }

    /// True with this probability.
    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.fraction() < probability
    }

    /// 1 or -1.
    pub(crate) fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// Normal with mean 0 and deviation 1 (Box and Muller 1958).
    pub(crate) fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare_normal.take() {
            return spare;
        }
        // 1 - fraction lies in (0, 1]: the logarithm is finite.
        let radius = (-2.0 * libm::log(1.0 - self.fraction())).sqrt();
        let angle_rad = 2.0 * core::f64::consts::PI * self.fraction();
        self.spare_normal = Some(radius * libm::sin(angle_rad));
        radius * libm::cos(angle_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_normal_numbers_have_the_moments_of_the_normal_law() {
        const COUNT: usize = 100_000;
        let mut random = Random::new(7, Purpose::Plant);
        let draws: Vec<f64> = (0..COUNT).map(|_| random.normal()).collect();
        let moment =
            |power: i32| draws.iter().map(|draw| draw.powi(power)).sum::<f64>() / COUNT as f64;
        // Five standard errors: 1, 1.41, 3.87 and 9.8 over sqrt(COUNT).
        for (power, expected, tolerance) in [
            (1, 0.0, 0.016),
            (2, 1.0, 0.023),
            (3, 0.0, 0.062),
            (4, 3.0, 0.16),
        ] {
            let got = moment(power);
            assert!((got - expected).abs() < tolerance, "moment {power}: {got}");
        }
    }

    #[test]
    fn prop_purposes_do_not_share_a_sequence() {
        let mut first = Random::new(1, Purpose::Plant);
        let mut second = Random::new(1, Purpose::Noise(0, Signal::PressureA));
        let equal = (0..64).any(|_| first.bits.next_u64() == second.bits.next_u64());
        assert!(!equal);
    }
}
