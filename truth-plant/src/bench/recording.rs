//! Recordings of a bench: channels with noise, zero error, drift and a
//! converter, written as comma-separated text.

use std::fmt::Write as _;

use crate::case::nameplate::{POSITION_NOISE_M, PRESSURE_NOISE_PA};
use crate::plant::sensors::{POSITION_STEP_M, PRESSURE_STEP_PA};
use crate::random::{Purpose, Random};

/// Most channels of a recording and recordings of an experiment, so that each
/// channel has a sequence of its own.
const CHANNELS: usize = 16;
const RECORDINGS: usize = 64;

/// The sequences of the channels of an experiment.
#[derive(Clone, Copy)]
pub(super) struct Noises {
    seed: u64,
    experiment: usize,
}

impl Noises {
    pub(super) fn new(seed: u64, experiment: usize) -> Self {
        Self { seed, experiment }
    }

    /// The sequence of a channel in a recording.
    pub(super) fn of(&self, recording: usize, channel: usize) -> Random {
        let number = (self.experiment * RECORDINGS + recording) * CHANNELS + channel;
        Random::new(self.seed, Purpose::BenchNoise(number))
    }

    /// A pressure transmitter of the axis.
    pub(super) fn pressure(&self, recording: usize, channel: usize) -> Channel {
        let random = self.of(recording, channel);
        Channel::new(random, PRESSURE_NOISE_PA, PRESSURE_STEP_PA)
    }

    /// The position sensor of the axis.
    pub(super) fn position(&self, recording: usize, channel: usize) -> Channel {
        let random = self.of(recording, channel);
        Channel::new(random, POSITION_NOISE_M, POSITION_STEP_M)
    }
}

/// A slow wave of the zero that starts at 0.
#[derive(Clone, Copy, Default)]
struct Drift {
    amplitude: f64,
    turns_per_s: f64,
    phase_rad: f64,
}

impl Drift {
    fn at(&self, time_s: f64) -> f64 {
        let angle_rad = 2.0 * core::f64::consts::PI * self.turns_per_s * time_s;
        self.amplitude * (libm::sin(angle_rad + self.phase_rad) - libm::sin(self.phase_rad))
    }
}

/// A sensor with its converter.
pub(super) struct Channel {
    random: Random,
    noise: f64,
    /// Noise in proportion to the reading.
    relative_noise: f64,
    step: f64,
    zero: f64,
    drift: Drift,
}

impl Channel {
    pub(super) fn new(random: Random, noise: f64, step: f64) -> Self {
        Self {
            random,
            noise,
            relative_noise: 0.0,
            step,
            zero: 0.0,
            drift: Drift::default(),
        }
    }

    /// With further noise in proportion to the reading.
    pub(super) fn with_relative_noise(mut self, share: f64) -> Self {
        self.relative_noise = share;
        self
    }

    /// With a constant zero error of up to this size.
    pub(super) fn with_zero(mut self, largest: f64) -> Self {
        self.zero = self.random.between(-largest, largest);
        self
    }

    /// With a zero that moves by up to this much in a recording of this length.
    pub(super) fn with_drift(mut self, range: f64, duration_s: f64) -> Self {
        // A sine's highest and lowest value lie two amplitudes apart.
        self.drift = Drift {
            amplitude: 0.5 * range * self.random.between(0.3, 1.0),
            turns_per_s: self.random.between(0.4, 1.2) / duration_s,
            phase_rad: self.random.between(0.0, 2.0 * core::f64::consts::PI),
        };
        self
    }

    /// What the converter shows of a value.
    pub(super) fn reads(&mut self, time_s: f64, value: f64) -> f64 {
        // Two independent draws: their variances add.
        let relative = if self.relative_noise > 0.0 {
            self.relative_noise * value * self.random.normal()
        } else {
            0.0
        };
        let noisy = value + relative + self.noise * self.random.normal();
        let shown = noisy + self.zero + self.drift.at(time_s);
        // The sum makes a plain zero of a negative one.
        libm::round(shown / self.step) * self.step + 0.0
    }
}

/// The text of a recording.
pub(super) struct Recording {
    name: String,
    text: String,
}

impl Recording {
    /// With these column names, separated by commas.
    pub(super) fn new(name: impl Into<String>, header: &str) -> Self {
        Self {
            name: name.into(),
            text: format!("{header}\n"),
        }
    }

    /// A row of values, each with its number of decimals.
    pub(super) fn row<const COUNT: usize>(&mut self, values: [(f64, usize); COUNT]) {
        for (column, (value, decimals)) in values.into_iter().enumerate() {
            let comma = if column > 0 { "," } else { "" };
            // Writing into a String cannot fail.
            let _ = write!(self.text, "{comma}{value:.decimals$}");
        }
        self.text.push('\n');
    }

    /// File name and text.
    pub(super) fn finish(self) -> (String, String) {
        (self.name, self.text)
    }
}

/// Moment of a row.
pub(super) fn time_s(row: usize, rows_per_s: f64) -> f64 {
    row as f64 / rows_per_s
}

/// Rows of that many seconds.
pub(super) fn rows(duration_s: f64, rows_per_s: f64) -> usize {
    libm::round(duration_s * rows_per_s) as usize
}

/// The command as it is written: with four decimals, from a generator that is
/// finer than the axis' converter.
pub(super) fn command_v(wanted_v: f64) -> f64 {
    libm::round(wanted_v * 1e4) / 1e4
}
