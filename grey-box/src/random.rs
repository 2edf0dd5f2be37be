//! Noise that is the same for the same seed, on every machine.

/// SplitMix64 (Steele, Lea, Flood 2014): 64 bits of state, passes BigCrush,
/// enough for the noise of a recording.
#[derive(Clone, Debug)]
pub struct Noise {
    state: u64,
}

impl Noise {
    /// A sequence of its own for each stream of a seed, so that one signal's
    /// noise does not depend on which others there are.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut mixer = Self {
            state: stream.wrapping_mul(0xD1B5_4A32_D192_ED03),
        };
        Self {
            state: seed ^ mixer.bits(),
        }
    }

    fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.state ^ (self.state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// Uniform between -1 and 1.
    fn uniform(&mut self) -> f64 {
        let fraction = (self.bits() >> 11) as f64 / (1_u64 << 53) as f64;
        2.0 * fraction - 1.0
    }

    /// Normal with mean 0 and deviation 1: Marsaglia's polar method, with the
    /// functions of `libm` for the sake of equal bytes.
    pub fn normal(&mut self) -> f64 {
        loop {
            let (x, y) = (self.uniform(), self.uniform());
            let square = x * x + y * y;
            if square > 0.0 && square < 1.0 {
                return x * libm::sqrt(-2.0 * libm::log(square) / square);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_noise_is_standard_normal() {
        const COUNT: usize = 100_000;
        let mut noise = Noise::new(1, 2);
        let draws: Vec<f64> = (0..COUNT).map(|_| noise.normal()).collect();
        let moment =
            |power: i32| draws.iter().map(|draw| draw.powi(power)).sum::<f64>() / COUNT as f64;
        // Five standard errors: 1, 1.4, 3.9 and 9.8 over sqrt(COUNT).
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
}
