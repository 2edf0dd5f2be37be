//! What a run keeps to.

use super::Reason;
use model_core::controller::Measurements;

/// Places, speed, pressures and force that a run keeps to, as measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Envelope {
    /// Lowest and highest position, m.
    pub position_m: [f32; 2],
    /// Highest speed, m/s.
    pub speed_m_per_s: f32,
    /// Lowest and highest pressure of either chamber, Pa absolute.
    pub pressure_pa: [f32; 2],
    /// Largest force of the gas, N.
    pub force_n: f32,
}

/// What of an envelope was left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// The position.
    Position,
    /// The speed.
    Speed,
    /// A pressure.
    Pressure,
    /// The force.
    Force,
}

impl Bound {
    pub(super) fn reason(self) -> Reason {
        match self {
            Self::Position => Reason::Position,
            Self::Speed => Reason::Speed,
            Self::Pressure => Reason::Pressure,
            Self::Force => Reason::Force,
        }
    }
}

impl Envelope {
    /// The numbers in the order of the wire.
    pub fn to_array(self) -> [f32; 6] {
        let [low_m, high_m] = self.position_m;
        let [low_pa, high_pa] = self.pressure_pa;
        [
            low_m,
            high_m,
            self.speed_m_per_s,
            low_pa,
            high_pa,
            self.force_n,
        ]
    }

    /// From the numbers in the order of the wire.
    pub fn from_array([low_m, high_m, speed_m_per_s, low_pa, high_pa, force_n]: [f32; 6]) -> Self {
        Self {
            position_m: [low_m, high_m],
            speed_m_per_s,
            pressure_pa: [low_pa, high_pa],
            force_n,
        }
    }

    /// Whether there is room in it.
    pub fn is_possible(&self) -> bool {
        let is_finite = self.to_array().into_iter().all(f32::is_finite);
        let [low_m, high_m] = self.position_m;
        let [low_pa, high_pa] = self.pressure_pa;
        is_finite
            && low_m < high_m
            && low_pa < high_pa
            && self.speed_m_per_s > 0.0
            && self.force_n > 0.0
    }

    /// What is beyond it, and its value.
    #[inline]
    pub(super) fn left(&self, now: &Measurements<f32>, force_n: f32) -> Option<(Bound, f32)> {
        let is_kept = is_within(now.position_m, self.position_m)
            && now.velocity_m_per_s.abs() <= self.speed_m_per_s
            && is_within(now.pressure_a_pa, self.pressure_pa)
            && is_within(now.pressure_b_pa, self.pressure_pa)
            && force_n.abs() <= self.force_n;
        if is_kept {
            None
        } else {
            self.first_left(now, force_n)
        }
    }

    #[cold]
    fn first_left(&self, now: &Measurements<f32>, force_n: f32) -> Option<(Bound, f32)> {
        let both = |most: f32| [-most, most];
        [
            (Bound::Position, now.position_m, self.position_m),
            (Bound::Speed, now.velocity_m_per_s, both(self.speed_m_per_s)),
            (Bound::Pressure, now.pressure_a_pa, self.pressure_pa),
            (Bound::Pressure, now.pressure_b_pa, self.pressure_pa),
            (Bound::Force, force_n, both(self.force_n)),
        ]
        .into_iter()
        .find(|(_, value, range)| !is_within(*value, *range))
        .map(|(bound, value, _)| (bound, value))
    }
}

/// A value that is no number is not.
#[inline]
fn is_within(value: f32, [low, high]: [f32; 2]) -> bool {
    value >= low && value <= high
}
