//! The plant and the firmware's controller, tick by tick.

use firmware::codes::{AdcCode, AdcCodes, DacCode};
use firmware::control_task::ControlTask;
use firmware::tick::Sample;
use grey_box::model::AxisFault;
use grey_box::rig::RigError;
use host_sim::plant::PlantSettings;
use model_core::reference::Reference;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::of_rig;
use crate::rig::Rig;

/// The codes of the converters at a tick: position, both pressures, supply, velocity.
type Codes = (u16, u16, u16, u16, u16);

fn tupled(codes: &AdcCodes) -> Codes {
    let AdcCodes {
        position,
        pressure_a,
        pressure_b,
        supply_pressure,
        velocity,
    } = codes;
    (
        position.0,
        pressure_a.0,
        pressure_b.0,
        supply_pressure.0,
        velocity.0,
    )
}

fn untupled(codes: Codes) -> AdcCodes {
    AdcCodes {
        position: AdcCode(codes.0),
        pressure_a: AdcCode(codes.1),
        pressure_b: AdcCode(codes.2),
        supply_pressure: AdcCode(codes.3),
        velocity: AdcCode(codes.4),
    }
}

/// A rig that makes no axis.
fn of_axis(rig: &Rig, fault: AxisFault) -> PyErr {
    of_rig(RigError {
        file: rig.name.clone(),
        line: None,
        key: Some(fault.key),
        problem: fault.problem,
        expected: fault.expected,
    })
}

/// A simulated axis behind the board's converters.
#[pyclass(module = "pneuma")]
pub struct Plant {
    inner: host_sim::plant::Plant,
}

#[pymethods]
impl Plant {
    #[new]
    #[pyo3(signature = (rig, start_m = 0.0, seed = 1))]
    fn new(rig: &Rig, start_m: f64, seed: u64) -> PyResult<Self> {
        let settings = PlantSettings::at(start_m, seed);
        let inner = host_sim::plant::Plant::new(&rig.inner, settings)
            .map_err(|fault| of_axis(rig, fault))?;
        Ok(Self { inner })
    }

    /// The converters' codes now; each call draws new noise.
    fn sample(&mut self) -> Codes {
        tupled(&self.inner.sample())
    }

    /// A millisecond under the present command, then the answer takes over.
    fn advance(&mut self, valve_code: u16) {
        self.inner.advance(DacCode(valve_code));
    }

    /// What no converter shows, SI.
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let truth = self.inner.truth();
        let numbers = [
            ("t", truth.time_s),
            ("u", truth.command_v),
            ("p_a", truth.pressure_a_pa),
            ("p_b", truth.pressure_b_pa),
            ("p_s", truth.supply_pressure_pa),
            ("x", truth.position_m),
            ("v", truth.velocity_m_s),
            ("temperature_a", truth.temperature_a_k),
            ("temperature_b", truth.temperature_b_k),
            ("friction", truth.friction_n),
        ];
        let dict = PyDict::new(py);
        for (name, value) in numbers {
            dict.set_item(name, value)?;
        }
        Ok(dict)
    }
}

/// The firmware's control task for a rig: the very bytes of the board.
#[pyclass(module = "pneuma")]
pub struct Controller {
    inner: ControlTask,
    tick: u32,
}

#[pymethods]
impl Controller {
    #[new]
    fn new(rig: &Rig) -> PyResult<Self> {
        let inner =
            host_sim::closed_loop::control_task(&rig.inner).map_err(|fault| of_axis(rig, fault))?;
        Ok(Self { inner, tick: 0 })
    }

    /// One tick: the converters' codes and a reference (m, m/s, m/s2; NaN asks for nothing) to the
    /// valve's code, the state, the fault (0: none), and what the observer believes
    /// (m, m/s, N, N).
    #[pyo3(signature = (codes, position_m, velocity_m_per_s = 0.0, acceleration_m_per_s2 = 0.0))]
    fn tick(
        &mut self,
        codes: Codes,
        position_m: f32,
        velocity_m_per_s: f32,
        acceleration_m_per_s2: f32,
    ) -> (u16, String, u8, [f32; 4]) {
        let sample = Sample {
            tick: self.tick,
            codes: untupled(codes),
            reference: Reference {
                position_m,
                velocity_m_per_s,
                acceleration_m_per_s2,
            },
        };
        self.tick = self.tick.wrapping_add(1);
        let command = self.inner.tick(&sample);
        let state = format!("{:?}", command.state).to_lowercase();
        (
            command.valve.0,
            state,
            command.fault,
            command.estimate.to_array(),
        )
    }
}
