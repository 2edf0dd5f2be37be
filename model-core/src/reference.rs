//! Where the load should be, now; and the way onto a reference that jumps.
//!
//! A reference is streamed, an instant a tick. As long as it hangs together it is
//! followed as it is. Where it jumps (a new set-point, a stream that begins
//! elsewhere than the load stands, a sine that begins at full speed) the gap is
//! closed by a quintic, the motion of least jerk, in the time that the limits ask
//! for:
//!
//! ```text
//! r = R(t) + o(t/T),   o = o0 + v0 T s + a0 T^2 s^2/2 + c3 s^3 + c4 s^4 + c5 s^5
//! c3 = -10 o0 - 6 v0 T - 3/2 a0 T^2
//! c4 =  15 o0 + 8 v0 T + 3/2 a0 T^2
//! c5 =  -6 o0 - 3 v0 T - 1/2 a0 T^2          so that o, o', o'' vanish at s = 1
//! ```
//!
//! So a set-point that only steps makes a jerk-limited point-to-point move.

use crate::real::Real;

/// One instant of a reference motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference<R> {
    /// Position, m.
    pub position_m: R,
    /// Velocity, m/s.
    pub velocity_m_per_s: R,
    /// Acceleration, m/s2.
    pub acceleration_m_per_s2: R,
}

impl<R: Real> Reference<R> {
    /// Standing still.
    pub fn at(position_m: R) -> Self {
        Self {
            position_m,
            velocity_m_per_s: R::ZERO,
            acceleration_m_per_s2: R::ZERO,
        }
    }

    /// A moment later, with this acceleration.
    fn later(&self, dt_s: R) -> Self {
        let half = R::from_f64(0.5);
        Self {
            position_m: self.position_m
                + dt_s * (self.velocity_m_per_s + half * dt_s * self.acceleration_m_per_s2),
            velocity_m_per_s: self.velocity_m_per_s + dt_s * self.acceleration_m_per_s2,
            ..*self
        }
    }

    fn minus(&self, other: &Self) -> Self {
        Self {
            position_m: self.position_m - other.position_m,
            velocity_m_per_s: self.velocity_m_per_s - other.velocity_m_per_s,
            acceleration_m_per_s2: self.acceleration_m_per_s2 - other.acceleration_m_per_s2,
        }
    }
}

/// What a gap may be closed with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLimits<R> {
    /// Velocity, m/s.
    pub velocity_m_per_s: R,
    /// Acceleration, m/s2.
    pub acceleration_m_per_s2: R,
    /// Jerk, m/s3.
    pub jerk_m_per_s3: R,
}

/// A jump below these is none: what rounding, streaming and the sensors' noise at
/// the start of a task make.
const TOLERANCE_M: f64 = 50e-6;
const TOLERANCE_M_PER_S: f64 = 10e-3;
/// The shortest way back, s.
const LEAST_DURATION_S: f64 = 0.02;

/// Follows a streamed reference, and joins it where it jumps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Follower<R> {
    target: Reference<R>,
    followed: Reference<R>,
    /// The gap when the reference jumped.
    gap: Reference<R>,
    elapsed_s: R,
    duration_s: R,
}

impl<R: Real> Follower<R> {
    /// Standing still at a position.
    pub fn at(position_m: R) -> Self {
        let here = Reference::at(position_m);
        Self {
            target: here,
            followed: here,
            gap: Reference::at(R::ZERO),
            elapsed_s: R::ZERO,
            duration_s: R::ZERO,
        }
    }

    /// The reference to follow at this tick, for the one that is streamed.
    pub fn step(
        &mut self,
        limits: &MotionLimits<R>,
        target: &Reference<R>,
        dt_s: R,
    ) -> Reference<R> {
        let jump = target.minus(&self.target.later(dt_s));
        if jump.position_m.abs() > R::from_f64(TOLERANCE_M)
            || jump.velocity_m_per_s.abs() > R::from_f64(TOLERANCE_M_PER_S)
        {
            self.gap = self.followed.later(dt_s).minus(target);
            self.elapsed_s = R::ZERO;
            self.duration_s = limits.duration_s(&self.gap);
        }
        self.target = *target;
        self.followed = *target;
        if self.elapsed_s < self.duration_s {
            let left = self.gap_left();
            self.followed = Reference {
                position_m: target.position_m + left.position_m,
                velocity_m_per_s: target.velocity_m_per_s + left.velocity_m_per_s,
                acceleration_m_per_s2: target.acceleration_m_per_s2 + left.acceleration_m_per_s2,
            };
            self.elapsed_s += dt_s;
        }
        self.followed
    }

    fn gap_left(&self) -> Reference<R> {
        let c = R::from_f64;
        let duration = self.duration_s;
        let s = self.elapsed_s / duration;
        let o = self.gap.position_m;
        let v = self.gap.velocity_m_per_s * duration;
        let a = self.gap.acceleration_m_per_s2 * duration * duration;
        let c2 = c(0.5) * a;
        let c3 = -c(10.0) * o - c(6.0) * v - c(1.5) * a;
        let c4 = c(15.0) * o + c(8.0) * v + c(1.5) * a;
        let c5 = -c(6.0) * o - c(3.0) * v - c(0.5) * a;
        Reference {
            position_m: o + s * (v + s * (c2 + s * (c3 + s * (c4 + s * c5)))),
            velocity_m_per_s: (v + s
                * (c(2.0) * c2 + s * (c(3.0) * c3 + s * (c(4.0) * c4 + s * c(5.0) * c5))))
                / duration,
            acceleration_m_per_s2: (c(2.0) * c2
                + s * (c(6.0) * c3 + s * (c(12.0) * c4 + s * c(20.0) * c5)))
                / (duration * duration),
        }
    }
}

impl<R: Real> MotionLimits<R> {
    /// Time to close a gap. The quintic over a distance d in T reaches 1.875 d/T,
    /// 5.77 d/T^2 and 60 d/T^3; one that begins with a velocity v, about 6 v/T.
    fn duration_s(&self, gap: &Reference<R>) -> R {
        let c = R::from_f64;
        let way = gap.position_m.abs();
        let by_velocity = c(1.875) * way / self.velocity_m_per_s;
        let by_acceleration = (c(5.77) * way / self.acceleration_m_per_s2).sqrt();
        let by_jerk = (c(60.0) * way / self.jerk_m_per_s3 + c(1e-9)).powf(c(1.0 / 3.0));
        let by_start = c(6.0) * gap.velocity_m_per_s.abs() / self.acceleration_m_per_s2;
        by_velocity
            .max(by_acceleration)
            .max(by_jerk)
            .max(by_start)
            .max(c(LEAST_DURATION_S))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    const LIMITS: MotionLimits<f64> = MotionLimits {
        velocity_m_per_s: 0.8,
        acceleration_m_per_s2: 10.0,
        jerk_m_per_s3: 500.0,
    };
    const DT_S: f64 = 1e-3;

    fn follow(mut target: impl FnMut(f64) -> Reference<f64>, from_m: f64) -> Vec<Reference<f64>> {
        let mut follower = Follower::at(from_m);
        (0..2000)
            .map(|tick| follower.step(&LIMITS, &target(f64::from(tick) * DT_S), DT_S))
            .collect()
    }

    #[test]
    fn prop_a_stepped_set_point_becomes_a_move_within_the_limits() {
        for to_m in [0.2, -0.05, 0.001] {
            let way = follow(|_| Reference::at(to_m), 0.0);
            for pair in way.windows(2) {
                let (before, after) = (pair[0], pair[1]);
                assert!(
                    after.velocity_m_per_s.abs() <= 0.8
                        && after.acceleration_m_per_s2.abs() <= 10.01
                );
                let jerk = (after.acceleration_m_per_s2 - before.acceleration_m_per_s2) / DT_S;
                assert!(jerk.abs() <= 501.0, "{jerk}");
                let slope = (after.position_m - before.position_m) / DT_S;
                assert!((slope - after.velocity_m_per_s).abs() < 0.01);
            }
            assert_eq!(way[1999], Reference::at(to_m));
        }
    }

    #[test]
    fn prop_a_smooth_stream_is_followed_as_it_is() {
        let sine = |time_s: f64| {
            let w = core::f64::consts::TAU;
            Reference {
                position_m: 0.06 * libm::cos(w * time_s),
                velocity_m_per_s: -0.06 * w * libm::sin(w * time_s),
                acceleration_m_per_s2: -0.06 * w * w * libm::cos(w * time_s),
            }
        };
        for (tick, followed) in follow(sine, 0.06).iter().enumerate() {
            assert_eq!(*followed, sine(tick as f64 * DT_S), "{tick}");
        }
    }

    #[test]
    fn prop_a_stream_that_begins_at_speed_is_joined_without_a_jump() {
        let ramp = |time_s: f64| Reference {
            position_m: 0.2 * time_s,
            velocity_m_per_s: 0.2,
            acceleration_m_per_s2: 0.0,
        };
        let way = follow(ramp, 0.0);
        for pair in way.windows(2) {
            let change = pair[1].velocity_m_per_s - pair[0].velocity_m_per_s;
            assert!(change.abs() <= 10.1 * DT_S, "{change}");
        }
        assert_eq!(way[1999], ramp(1.999));
    }
}
