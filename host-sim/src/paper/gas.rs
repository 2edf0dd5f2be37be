//! Figures 8 and 9: temperature and heat transfer of the gas in a chamber.

use bench::{Kind, Picture};
use model_core::chamber::{
    Chamber, ChamberFlow, ChamberState, ThermalModel, stop_method_temperature_k,
};
use model_core::valve::{FlowLaw, GasState};

use super::Figure;
use crate::model::{Side, Values};
use crate::rig::Rig;

/// Step of the simulations, s.
const STEP_S: f64 = 1e-4;
/// How long a chamber is filled or emptied, s.
const OPEN_S: f64 = 0.8;
/// When runs of the stop method are stopped, s.
const STOPS_S: [f64; 7] = [0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8];
/// Time after a stop until the pressure has settled, s.
const SETTLED_S: f64 = 15.0;
/// Open area, m2: a valve that is opened by about a volt.
const OPEN_M2: f64 = 2.5e-6;

/// A chamber at the end of the stroke, joined to supply or surroundings through an orifice.
struct Bench {
    chamber: Chamber<f64>,
    law: FlowLaw<f64>,
    outside: GasState<f64>,
    position_m: f64,
    start_pa: f64,
}

/// Time, pressure and temperature.
type Course = Vec<(f64, f64, f64)>;

pub(super) fn figures(rig: &Rig) -> Result<Vec<Figure>, String> {
    let values = Values::<f64>::of(rig);
    let chamber = values.chamber(Side::A).ok_or("the rig has no cylinder")?;
    let law = values
        .valve()
        .and_then(Result::ok)
        .ok_or("the rig has no valve")?
        .law;
    let ambient = values.ambient();
    let supply = GasState {
        pressure_pa: values
            .get("supply.pressure_Pa")
            .ok_or("the rig has no supply")?,
        ..ambient
    };
    let position_m = 0.5
        * values
            .get("cylinder.stroke_m")
            .ok_or("the rig has no stroke")?;
    let filled = Bench {
        chamber,
        law,
        outside: supply,
        position_m,
        start_pa: ambient.pressure_pa,
    };
    let emptied = Bench {
        chamber,
        law,
        outside: ambient,
        position_m,
        start_pa: supply.pressure_pa,
    };
    Ok(vec![
        temperatures(rig, &filled, &emptied)?,
        coefficients(rig),
    ])
}

impl Bench {
    fn with_thermal(&self, thermal: ThermalModel<f64>) -> Self {
        let chamber = Chamber {
            thermal,
            ..self.chamber
        };
        Self { chamber, ..*self }
    }

    fn with_heat_transfer(&self, coefficient: f64) -> Self {
        let chamber = Chamber {
            heat_transfer_charging_w_per_m2_k: coefficient,
            heat_transfer_discharging_w_per_m2_k: coefficient,
            ..self.chamber
        };
        Self { chamber, ..*self }
    }

    /// Open up to a time, then shut.
    fn run(&self, open_s: f64, until_s: f64) -> Course {
        let wall_k = self.chamber.wall_temperature_k;
        let mut state = ChamberState::new(self.start_pa, wall_k);
        let stroke = self.chamber.stroke(self.position_m, self.position_m);
        let mut course = Vec::new();
        for step in 0..(until_s / STEP_S).round() as usize {
            let time_s = step as f64 * STEP_S;
            let gas = state.gas_state();
            course.push((time_s, gas.pressure_pa, gas.temperature_k));
            let area_m2 = if time_s < open_s { OPEN_M2 } else { 0.0 };
            let flow = |inside: GasState<f64>| {
                let flow = self.law.flow(area_m2, self.outside, inside);
                let (outside_k, inside_k) = (self.outside.temperature_k, inside.temperature_k);
                ChamberFlow::NONE.with(
                    flow.mass_flow_kg_per_s,
                    flow.slope_2_kg_per_s_pa,
                    outside_k,
                    inside_k,
                )
            };
            self.chamber.step(&mut state, &stroke, flow, STEP_S);
        }
        course
    }

    /// The temperature at a stop by the settled pressure.
    fn stopped_k(&self, stop_s: f64) -> f64 {
        let course = self.run(stop_s, stop_s + SETTLED_S);
        let at_stop = course.partition_point(|one| one.0 < stop_s);
        let settled_pa = course.last().map_or(f64::NAN, |last| last.1);
        stop_method_temperature_k(
            course[at_stop].1,
            settled_pa,
            self.chamber.wall_temperature_k,
        )
    }
}

/// Some of the points of a course, the temperature over time.
fn over_time(course: &Course) -> Vec<(f64, f64)> {
    course
        .iter()
        .step_by(20)
        .map(|one| (one.0, one.2))
        .collect()
}

fn temperatures(rig: &Rig, filled: &Bench, emptied: &Bench) -> Result<Figure, String> {
    let values = Values::<f64>::of(rig);
    let index = |key: &str| values.get(key).ok_or(format!("{key} is missing"));
    let reduced = ThermalModel::Polytropic {
        expansion_index: index("chambers.expansion_index")?,
        compression_index: index("chambers.compression_index")?,
        reference_pressure_pa: filled.outside.pressure_pa,
    };
    let mut pictures = Vec::new();
    for (name, bench) in [
        ("Charging from ambient pressure", filled),
        ("Discharging from 7 bar", emptied),
    ] {
        let picture = Picture::new(name, ("time", "s"), ("temperature", "K"));
        let course = |bench: &Bench| over_time(&bench.run(OPEN_S, OPEN_S));
        let stops = STOPS_S
            .iter()
            .map(|stop_s| (*stop_s, bench.stopped_k(*stop_s)));
        pictures.push(
            picture
                .with("full balance (3)", Kind::Law, course(bench))
                .with("stop method (7), simulated", Kind::Points, stops.collect())
                .with(
                    "reduced model (6)",
                    Kind::Given,
                    course(&bench.with_thermal(reduced)),
                )
                .with(
                    "without heat transfer",
                    Kind::Recorded,
                    course(&bench.with_heat_transfer(0.0)),
                ),
        );
    }
    Ok(Figure {
        number: "8",
        title: "Gas temperature while a chamber is charged and discharged",
        says: "Measured by the stop method (7) at the end of the stroke; the full balance (3) has h = 50 W/(m² K) while charging and 20 while discharging, the reduced model (6) indices of 1.18 in compression and 1.11 in expansion (Beater).",
        assumed: "An open area of 2.5 mm², and a dead volume of 25 cm³. The reduced model takes the gas to be at ambient temperature at the supply pressure, as the paper prints it: a chamber that was at rest at another pressure then begins at a wrong temperature.",
        pictures,
    })
}

fn coefficients(rig: &Rig) -> Figure {
    let values = Values::<f64>::of(rig);
    let of = |key: &str| values.get_or(key, 0.0);
    let level = |value: f64| vec![(0.0, value), (OPEN_S, value)];
    let picture = Picture::new(
        "Heat transfer coefficient",
        ("time", "s"),
        ("heat transfer", "W/(m² K)"),
    )
    .with(
        "charging, the paper",
        Kind::Law,
        level(of("chambers.heat_transfer_charging_W_m2K")),
    )
    .with(
        "discharging, the paper",
        Kind::Given,
        level(of("chambers.heat_transfer_discharging_W_m2K")),
    );
    Figure {
        number: "9",
        title: "Heat transfer coefficient",
        says: "50 W/(m² K) while charging, 20 while discharging.",
        assumed: "Constant in time: the course that the figure shows is not in the text. What a virtual bench shows of it, run by run, stands in the procedure below.",
        pictures: vec![picture],
    }
}
