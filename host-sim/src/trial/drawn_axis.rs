//! An axis of `truth-plant` behind a board's converters.

use crate::board::twin::Axis;
use crate::plant::valve_v;
use firmware::codes::{AdcCodes, DacCode, POSITION_M, PRESSURE_PA, Scale, VELOCITY_M_PER_S};
use truth_plant::{Plant, Sample};

/// The axis, and the command in force.
pub struct DrawnAxis {
    plant: Plant,
    held_v: f64,
}

impl DrawnAxis {
    /// With the valve at its middle.
    pub fn new(plant: Plant) -> Self {
        Self { plant, held_v: 5.0 }
    }
}

impl Axis for DrawnAxis {
    fn codes(&mut self) -> AdcCodes {
        codes(&self.plant.sample())
    }

    /// A command takes hold one tick after its sample, as on the board.
    fn advance(&mut self, command: DacCode) {
        self.plant.advance(self.held_v);
        self.held_v = valve_v(command);
    }
}

/// The codes of the board's converters for what the plant's sensors say.
pub(super) fn codes(measured: &Sample) -> AdcCodes {
    const STEP_16_BIT: f32 = 1.0;
    const STEP_12_BIT: f32 = 16.0;
    // The highest code is that of a failed conversion.
    let code = |scale: Scale, value: f64, step: f32| {
        let place = (scale.place(value as f32) / step).round() * step;
        place.min(f32::from(u16::MAX) - step) as u16
    };
    let [a_pa, b_pa] = measured.pressure_pa;
    AdcCodes::from_array([
        code(POSITION_M, measured.position_m, STEP_16_BIT),
        code(PRESSURE_PA, a_pa, STEP_12_BIT),
        code(PRESSURE_PA, b_pa, STEP_12_BIT),
        code(PRESSURE_PA, measured.supply_pa, STEP_12_BIT),
        code(VELOCITY_M_PER_S, measured.speed_m_per_s, STEP_16_BIT),
    ])
}
