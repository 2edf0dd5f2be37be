//! The controller's bandwidths and limits among the settings: what they are,
//! their ranges, and both ways between them and the controller's own.
//!
//! The ranges catch a slip of units or a damaged number. Whether a loop of the
//! range is stable on a rig is another matter: docs/settings.md says which gain
//! to change for what, and how.

use super::field::{Field, Fields, Rows, SettingsFault, field, fields};
use model_core::controller;
use model_core::left_out::DELAY_CAPACITY;
use model_core::observer::ObserverGains;
use model_core::reference::MotionLimits;
use serde::{Deserialize, Serialize};

/// Gains of the controller, see [`model_core::controller::Gains`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gains {
    /// Of the observer: the pressures, 1/s.
    pub observer_pressure_per_s: f32,
    /// Of the observer: position and velocity, 1/s.
    pub observer_motion_per_s: f32,
    /// Of the observer: the disturbance force, 1/s.
    pub observer_disturbance_per_s: f32,
    /// Of the observer: the edges of the valve, 1/s; 0 does not learn them.
    pub observer_edge_per_s: f32,
    /// Of the observer: the friction, 1/s; 0 does not learn it.
    pub observer_friction_per_s: f32,
    /// Of the position loop, rad/s.
    pub position_per_s: f32,
    /// Damping ratio of the position loop.
    pub damping: f32,
    /// Of the force loop, 1/s.
    pub force_per_s: f32,
    /// By how much the feedforward runs ahead: tick, hold and spool, s.
    pub lead_s: f32,
    /// Speed at which an error moves the bristle of the feedforward, 1/s.
    pub approach_per_s: f32,
    /// Share of the Coulomb friction by which stiction may be exceeded.
    pub breakaway_margin: f32,
    /// Speed above which a load that should stand still has slipped, m/s.
    pub slip_m_per_s: f32,
    /// Error below which the load may come to rest, m.
    pub rest_error_m: f32,
    /// Error above which rest is given up, m.
    pub lost_error_m: f32,
    /// Error that rest does not correct, m.
    pub indifferent_m: f32,
    /// Of the force where rest corrects, 1/s.
    pub rest_force_per_s: f32,
    /// Of a move to a set-point: velocity, m/s.
    pub move_velocity_m_per_s: f32,
    /// Of a move to a set-point: acceleration, m/s2.
    pub move_acceleration_m_per_s2: f32,
    /// Of a move to a set-point: jerk, m/s3.
    pub move_jerk_m_per_s3: f32,
}

/// The bandwidths among them, which come first.
const BANDWIDTHS: usize = 9;

impl Default for Gains {
    /// The controller's standard gains.
    fn default() -> Self {
        controller::Gains::standard().into()
    }
}

impl Gains {
    /// Every number with its range, named `controller.KEY`; the bandwidths first.
    pub fn fields(&self) -> impl ExactSizeIterator<Item = Field> {
        self.listed().iter()
    }

    #[rustfmt::skip]
    pub(super) fn listed(&self) -> Fields<19> {
        fields![
            field("controller.observer_pressure_per_s", self.observer_pressure_per_s, 1.0, 4e3),
            field("controller.observer_motion_per_s", self.observer_motion_per_s, 1.0, 4e3),
            field("controller.observer_disturbance_per_s", self.observer_disturbance_per_s, 0.0, 1e3),
            field("controller.observer_edge_per_s", self.observer_edge_per_s, 0.0, 100.0),
            field("controller.observer_friction_per_s", self.observer_friction_per_s, 0.0, 1e3),
            field("controller.position_per_s", self.position_per_s, 1.0, 500.0),
            field("controller.force_per_s", self.force_per_s, 1.0, 2e3),
            field("controller.approach_per_s", self.approach_per_s, 0.0, 1e3),
            field("controller.rest_force_per_s", self.rest_force_per_s, 0.0, 500.0),
            field("controller.damping", self.damping, 0.1, 5.0),
            field("controller.lead_s", self.lead_s, 0.0, 0.05),
            field("controller.breakaway_margin", self.breakaway_margin, 0.0, 5.0),
            field("controller.slip_m_per_s", self.slip_m_per_s, 1e-5, 1.0),
            field("controller.rest_error_m", self.rest_error_m, 1e-7, 0.01),
            field("controller.lost_error_m", self.lost_error_m, 1e-7, 0.01),
            field("controller.indifferent_m", self.indifferent_m, 0.0, 0.01),
            field("controller.move_velocity_m_per_s", self.move_velocity_m_per_s, 5e-3, 10.0),
            field("controller.move_acceleration_m_per_s2", self.move_acceleration_m_per_s2, 1e-2, 200.0),
            field("controller.move_jerk_m_per_s3", self.move_jerk_m_per_s3, 0.1, 1e5),
        ]
    }

    /// What the tick allows: no bandwidth beyond its rate, where a correction
    /// would throw further than the error is, and no longer lead than the line of
    /// forces that are not due yet.
    pub(super) fn check_tick(&self, dt_s: f32) -> Result<(), SettingsFault> {
        let fastest_per_s = 1.0 / dt_s;
        let listed = self.listed();
        let rows = listed.rows();
        let values = rows.values.get(..BANDWIDTHS).unwrap_or(rows.values);
        Rows { values, ..rows }.check_to(fastest_per_s)?;
        let longest_s = dt_s * (DELAY_CAPACITY - 2) as f32;
        field("controller.lead_s", self.lead_s, 0.0, longest_s).check()
    }
}

impl From<controller::Gains<f32>> for Gains {
    fn from(gains: controller::Gains<f32>) -> Self {
        Self {
            observer_pressure_per_s: gains.observer.pressure_per_s,
            observer_motion_per_s: gains.observer.motion_per_s,
            observer_disturbance_per_s: gains.observer.disturbance_per_s,
            observer_edge_per_s: gains.observer.edge_per_s,
            observer_friction_per_s: gains.observer.friction_per_s,
            position_per_s: gains.position_per_s,
            damping: gains.damping,
            force_per_s: gains.force_per_s,
            lead_s: gains.lead_s,
            approach_per_s: gains.approach_per_s,
            breakaway_margin: gains.breakaway_margin,
            slip_m_per_s: gains.slip_m_per_s,
            rest_error_m: gains.rest_error_m,
            lost_error_m: gains.lost_error_m,
            indifferent_m: gains.indifferent_m,
            rest_force_per_s: gains.rest_force_per_s,
            move_velocity_m_per_s: gains.motion.velocity_m_per_s,
            move_acceleration_m_per_s2: gains.motion.acceleration_m_per_s2,
            move_jerk_m_per_s3: gains.motion.jerk_m_per_s3,
        }
    }
}

impl From<Gains> for controller::Gains<f32> {
    fn from(gains: Gains) -> Self {
        Self {
            observer: ObserverGains {
                pressure_per_s: gains.observer_pressure_per_s,
                motion_per_s: gains.observer_motion_per_s,
                disturbance_per_s: gains.observer_disturbance_per_s,
                edge_per_s: gains.observer_edge_per_s,
                friction_per_s: gains.observer_friction_per_s,
            },
            position_per_s: gains.position_per_s,
            damping: gains.damping,
            force_per_s: gains.force_per_s,
            lead_s: gains.lead_s,
            approach_per_s: gains.approach_per_s,
            breakaway_margin: gains.breakaway_margin,
            slip_m_per_s: gains.slip_m_per_s,
            rest_error_m: gains.rest_error_m,
            lost_error_m: gains.lost_error_m,
            indifferent_m: gains.indifferent_m,
            rest_force_per_s: gains.rest_force_per_s,
            motion: MotionLimits {
                velocity_m_per_s: gains.move_velocity_m_per_s,
                acceleration_m_per_s2: gains.move_acceleration_m_per_s2,
                jerk_m_per_s3: gains.move_jerk_m_per_s3,
            },
        }
    }
}
