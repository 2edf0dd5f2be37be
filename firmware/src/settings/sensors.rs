//! The sensors among the settings: what each shows at the ends of its converter.
//!
//! A converter's code is a voltage at the board's terminal; which pressure, place or
//! speed that is, is the sensor's. The host works it out from the sensor's output and
//! range; the board brings every code to the one scale
//! that all else knows ([`crate::sensing`]).

use super::field::{Fields, SettingsFault, fields};
use crate::codes::{POSITION_M, PRESSURE_PA, Scale, VELOCITY_M_PER_S};
use serde::{Deserialize, Serialize};

/// What each sensor shows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensors {
    /// Position, m about mid-stroke.
    pub position_m: Scale,
    /// Pressure of chamber a, Pa absolute.
    pub pressure_a_pa: Scale,
    /// Pressure of chamber b, Pa absolute.
    pub pressure_b_pa: Scale,
    /// Supply pressure, Pa absolute; both ends alike where there is no sensor and that pressure is
    /// taken for granted.
    pub supply_pressure_pa: Scale,
    /// Velocity, m/s; `None` where it is worked out from the position.
    pub velocity_m_per_s: Option<Scale>,
}

impl Sensors {
    /// Those that the link's scales were made for.
    pub const STANDARD: Self = Self {
        position_m: POSITION_M,
        pressure_a_pa: PRESSURE_PA,
        pressure_b_pa: PRESSURE_PA,
        supply_pressure_pa: PRESSURE_PA,
        velocity_m_per_s: Some(VELOCITY_M_PER_S),
    };

    /// Every number with its range.
    #[rustfmt::skip]
    pub(super) fn fields(&self) -> Fields<10> {
        let velocity = self.velocity_m_per_s.unwrap_or(VELOCITY_M_PER_S);
        fields![
            field("sensors.position_m.lowest", self.position_m.lowest, -10.0, 10.0),
            field("sensors.position_m.highest", self.position_m.highest, -10.0, 10.0),
            field("sensors.pressure_a_pa.lowest", self.pressure_a_pa.lowest, -1e8, 1e8),
            field("sensors.pressure_a_pa.highest", self.pressure_a_pa.highest, -1e8, 1e8),
            field("sensors.pressure_b_pa.lowest", self.pressure_b_pa.lowest, -1e8, 1e8),
            field("sensors.pressure_b_pa.highest", self.pressure_b_pa.highest, -1e8, 1e8),
            field("sensors.supply_pressure_pa.lowest", self.supply_pressure_pa.lowest, -1e8, 1e8),
            field("sensors.supply_pressure_pa.highest", self.supply_pressure_pa.highest, -1e8, 1e8),
            field("sensors.velocity_m_per_s.lowest", velocity.lowest, -100.0, 100.0),
            field("sensors.velocity_m_per_s.highest", velocity.highest, -100.0, 100.0),
        ]
    }

    /// What a sensor shows must follow what it measures.
    pub(super) fn check(&self) -> Result<(), SettingsFault> {
        for (name, scale) in [
            ("sensors.position_m.highest", &self.position_m),
            ("sensors.pressure_a_pa.highest", &self.pressure_a_pa),
            ("sensors.pressure_b_pa.highest", &self.pressure_b_pa),
        ] {
            if (scale.highest - scale.lowest).abs() <= 0.0 {
                let problem = "shows the same at both ends of its converter";
                return Err(SettingsFault::Contradiction(name, problem));
            }
        }
        Ok(())
    }
}
