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

    /// Whether its places are all within so much of one.
    pub(super) fn is_about(&self, position_m: f32, most_m: f32) -> bool {
        let is_near = |limit_m: &f32| is_within(limit_m - position_m, [-most_m, most_m]);
        self.position_m.iter().all(is_near)
    }

    /// Why a run that is beyond it ends, and the value that is.
    #[inline]
    pub(super) fn left(&self, now: &Measurements<f32>, force_n: f32) -> Option<(Reason, f32)> {
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
    fn first_left(&self, now: &Measurements<f32>, force_n: f32) -> Option<(Reason, f32)> {
        let both = |most: f32| [-most, most];
        [
            (Reason::Position, now.position_m, self.position_m),
            (
                Reason::Speed,
                now.velocity_m_per_s,
                both(self.speed_m_per_s),
            ),
            (Reason::Pressure, now.pressure_a_pa, self.pressure_pa),
            (Reason::Pressure, now.pressure_b_pa, self.pressure_pa),
            (Reason::Force, force_n, both(self.force_n)),
        ]
        .into_iter()
        .find(|(_, value, range)| !is_within(*value, *range))
        .map(|(reason, value, _)| (reason, value))
    }
}

/// A value that is no number is not.
#[inline]
fn is_within(value: f32, [low, high]: [f32; 2]) -> bool {
    value >= low && value <= high
}
