//! The comparison: a PID controller as an engineer would put it on such an axis
//! today.
//!
//! ```text
//! e = r - x
//! v = kp e + ki integral(e) + kd (dr/dt - dx/dt) + kf dr/dt + ka d2r/dt2
//! u = null + v + jump(v)
//! ```
//!
//! with velocity feedback from the velocity sensor, feedforward of velocity and
//! acceleration, and the valve's overlap jumped over: `jump` rises to the dead zone of the rig's
//! valve table within a narrow band about v = 0. At rest within the tolerance
//! band the valve goes to its null and stays there until the error is twice the
//! band, without which such a controller hunts. The integral is limited, and
//! stands still at rest and while the valve is at its end.
//!
//! The gains are searched for, per rig, by [`super::tune`].

use super::drive::{Drive, DriveError};
use crate::model::AxisFault;
use crate::plant::PlantSettings;
use crate::rig::{FeedsAWhen, Rig};
use firmware::codes::{CommandShaper, ValveConverter};
use firmware::link::CommandRecord;
use firmware::tick::{Sample, State};

/// Gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidGains {
    /// kp, V/m.
    pub proportional_v_per_m: f64,
    /// ki, V/(m s).
    pub integral_v_per_m_s: f64,
    /// kd, V s/m.
    pub derivative_v_s_per_m: f64,
    /// kf, V s/m.
    pub feedforward_v_s_per_m: f64,
    /// ka, V s2/m.
    pub acceleration_v_s2_per_m: f64,
    /// What is jumped over, in parts of the dead zone: more than 1 where the
    /// first of the open valve, too, is too little to move the load.
    pub jump_share: f64,
    /// The band of v over which the jump rises, V.
    pub jump_band_v: f64,
    /// The tolerance at rest, m.
    pub rest_band_m: f64,
}

impl PidGains {
    /// For the paper's rig: what `cargo run --release --example tune_pid --
    /// rigs/paper.toml 110` found, to three digits.
    pub const PAPER: Self = Self {
        proportional_v_per_m: 51.6,
        integral_v_per_m_s: 31.5,
        derivative_v_s_per_m: 4.85,
        feedforward_v_s_per_m: 0.570,
        acceleration_v_s2_per_m: 0.0417,
        jump_share: 4.11,
        jump_band_v: 0.00743,
        rest_band_m: 3.70e-5,
    };

    /// The gains in one row, for a search.
    pub fn to_array(self) -> [f64; 8] {
        [
            self.proportional_v_per_m,
            self.integral_v_per_m_s,
            self.derivative_v_s_per_m,
            self.feedforward_v_s_per_m,
            self.acceleration_v_s2_per_m,
            self.jump_share,
            self.jump_band_v,
            self.rest_band_m,
        ]
    }

    /// The gains of a row.
    pub fn from_array(row: [f64; 8]) -> Self {
        let [
            proportional_v_per_m,
            integral_v_per_m_s,
            derivative_v_s_per_m,
            feedforward_v_s_per_m,
            acceleration_v_s2_per_m,
            jump_share,
            jump_band_v,
            rest_band_m,
        ] = row;
        Self {
            proportional_v_per_m,
            integral_v_per_m_s,
            derivative_v_s_per_m,
            feedforward_v_s_per_m,
            acceleration_v_s2_per_m,
            jump_share,
            jump_band_v,
            rest_band_m,
        }
    }
}

/// The most that the integral may ask for, V.
const LARGEST_INTEGRAL_V: f64 = 1.0;
/// Half of the valve's range of 0..10 V, V.
const HALF_RANGE_V: f64 = 5.0;

/// The controller.
#[derive(Clone, Debug)]
pub struct PidController {
    gains: PidGains,
    null_v: f64,
    dead_zone_v: f64,
    towards_a: f64,
    integral_v: f64,
    rests: bool,
    shaper: CommandShaper,
}

impl PidController {
    /// A controller that knows of the rig its valve's null and overlap.
    pub fn new(rig: &Rig, gains: PidGains) -> Result<Self, AxisFault> {
        let valve = rig
            .valve
            .as_ref()
            .ok_or_else(|| AxisFault::missing("valve"))?;
        Ok(Self {
            gains,
            null_v: valve.null_v,
            dead_zone_v: dead_zone_v(&valve.opening_v, &valve.supply_area_m2),
            towards_a: match valve.feeds_a_when {
                FeedsAWhen::AboveNull => 1.0,
                FeedsAWhen::BelowNull => -1.0,
            },
            integral_v: 0.0,
            rests: false,
            shaper: CommandShaper::new(ValveConverter::TwelveBits),
        })
    }

    /// The voltage about the null, positive towards +x.
    fn drive_v(&mut self, sample: &Sample) -> f64 {
        let gains = self.gains;
        let measured = sample.codes.measurements();
        let reference = &sample.reference;
        let error_m = f64::from(reference.position_m - measured.position_m);
        let reference_m_per_s = f64::from(reference.velocity_m_per_s);
        let error_m_per_s = reference_m_per_s - f64::from(measured.velocity_m_per_s);
        if self.stays(reference_m_per_s, error_m) {
            return 0.0;
        }
        let linear_v = gains.proportional_v_per_m * error_m
            + self.integral_v
            + gains.derivative_v_s_per_m * error_m_per_s
            + gains.feedforward_v_s_per_m * reference_m_per_s
            + gains.acceleration_v_s2_per_m * f64::from(reference.acceleration_m_per_s2);
        let jump = (linear_v / gains.jump_band_v).clamp(-1.0, 1.0) * gains.jump_share;
        let wanted_v = linear_v + jump * self.dead_zone_v;
        if wanted_v.abs() < HALF_RANGE_V {
            let step_v = gains.integral_v_per_m_s * error_m * PlantSettings::TICK_S;
            self.integral_v =
                (self.integral_v + step_v).clamp(-LARGEST_INTEGRAL_V, LARGEST_INTEGRAL_V);
        }
        wanted_v
    }

    /// Whether the load is where it should be, at rest.
    fn stays(&mut self, reference_m_per_s: f64, error_m: f64) -> bool {
        let band_m = self.gains.rest_band_m * if self.rests { 2.0 } else { 1.0 };
        self.rests = reference_m_per_s.abs() <= 0.0 && error_m.abs() < band_m;
        self.rests
    }
}

impl Drive for PidController {
    fn command(&mut self, sample: &Sample) -> Result<CommandRecord, DriveError> {
        let command_v = self.null_v + self.towards_a * self.drive_v(sample);
        let measured = sample.codes.measurements();
        Ok(CommandRecord {
            tick: sample.tick,
            valve: self.shaper.code(command_v as f32, self.null_v as f32),
            state: State::Track as u8,
            fault: 0,
            estimate: [measured.position_m, measured.velocity_m_per_s, 0.0, 0.0],
        })
    }
}

/// The opening up to which the area does not rise, V.
fn dead_zone_v(opening_v: &[f64], area_m2: &[f64]) -> f64 {
    let shut_m2 = area_m2.first().copied().unwrap_or(0.0);
    opening_v
        .iter()
        .zip(area_m2)
        .take_while(|(_, area_m2)| **area_m2 <= shut_m2)
        .last()
        .map_or(0.0, |(opening_v, _)| *opening_v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_the_dead_zone_ends_where_the_area_rises() {
        let opening_v = [0.0, 0.1, 0.3, 5.0];
        let found = dead_zone_v(&opening_v, &[1.0, 1.0, 1.0, 9.0]);
        assert!((found - 0.3).abs() < 1e-12);
        let found = dead_zone_v(&opening_v, &[1.0, 2.0, 3.0, 9.0]);
        assert!(found.abs() < 1e-12);
    }

    #[test]
    fn prop_gains_come_back_from_their_row() {
        let row = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
        let bits = |row: [f64; 8]| row.map(f64::to_bits);
        let back = PidGains::from_array(row).to_array();
        assert_eq!(bits(back), bits(row));
    }
}
