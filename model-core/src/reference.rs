//! Where the load should be, now.

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
