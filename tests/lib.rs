//! What the workspace tests share.

pub mod effects;
pub mod thresholds;

use diagnosis::diagnose::{Diagnosis, diagnose};
use host_sim::recording::Recording;
use host_sim::rig::Rig;
use model_core::axis::{Axis, AxisInputs};
use model_core::carriage::CarriageState;
use model_core::chamber::{Chamber, ChamberFlow, ChamberState};
use model_core::real::Real;
use model_core::valve::{FlowLaw, GasState};
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use xtask::practice;

/// A folder of recordings, if it is there: in `$PNEUMA_RECORDINGS`, else beside the workspace in
/// `../shared/recordings`. Where it is missing it says so, and tests that need it pass; in
/// continuous integration (`CI` is set) they fail.
///
/// # Panics
/// If the folder is missing in continuous integration.
pub fn recordings(folder: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings");
    let root = std::env::var_os("PNEUMA_RECORDINGS").map_or(beside, PathBuf::from);
    let folder = root.join(folder);
    if folder.is_dir() {
        return Some(folder);
    }
    let is_ci = std::env::var_os("CI").is_some();
    assert!(
        !is_ci,
        "CI is set and there are no recordings at {}",
        folder.display()
    );
    println!("SKIPPED: no recordings at {}", folder.display());
    println!("SKIPPED: set PNEUMA_RECORDINGS to the folder that holds `real` and `practice`");
    None
}

/// The diagnosis of an axis: `rig.toml`, `train-*.csv` and `held-*.csv` of a folder.
///
/// # Panics
/// If they cannot be read.
pub fn diagnosed(folder: &Path) -> Diagnosis {
    diagnosed_with(folder, |_| ())
}

/// The same with a rig file that states something else.
///
/// # Panics
/// If they cannot be read.
pub fn diagnosed_with(folder: &Path, restate: impl FnOnce(&mut Rig)) -> Diagnosis {
    let mut rig = Rig::read(folder.join("rig.toml")).expect("a rig");
    restate(&mut rig);
    let read = |begin: &str| -> Vec<Recording> {
        let files = practice::recordings(folder, begin).expect("recordings");
        let read = |file: &PathBuf| Recording::read(file, &rig.signals).expect("a recording");
        files.iter().map(read).collect()
    };
    let held_out = || Ok::<_, Infallible>(read("held"));
    let Ok(diagnosis) = diagnose(&rig, read("train"), held_out, &(), &|_| ());
    diagnosis
}

/// The rig file of somebody who knows one flow of the valve and nothing in between: nominal flow and b
/// in place of the areas.
///
/// # Panics
/// If the rig has no valve.
pub fn with_one_flow(rig: &Rig) -> Rig {
    let table = [
        "opening_V",
        "supply_area_m2",
        "exhaust_area_m2",
        "critical_pressure_ratio",
    ];
    let text = rig.to_toml();
    let is_kept = |line: &&str| !table.iter().any(|key| line.contains(key));
    let kept: Vec<&str> = text.lines().filter(is_kept).collect();
    let stated = "[valve]\nnominal_flow_l_min = 700.0\nb = 0.3\nfull_opening_V = 5.0";
    let text = kept.join("\n").replace("[valve]", stated);
    Rig::parse(&text, "rig.toml").expect("a valve with one flow")
}

/// State of [`plain_step`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlainState<R> {
    /// Chamber a.
    pub a: ChamberState<R>,
    /// Chamber b.
    pub b: ChamberState<R>,
    /// Carriage.
    pub carriage: CarriageState<R>,
}

impl<R: Real> PlainState<R> {
    /// At rest, both chambers at the same pressure and temperature.
    pub fn at_rest(position_m: R, pressure_pa: R, temperature_k: R) -> Self {
        Self {
            a: ChamberState::new(pressure_pa, temperature_k),
            b: ChamberState::new(pressure_pa, temperature_k),
            carriage: CarriageState::new(position_m, R::ZERO),
        }
    }
}

/// One step of the axis made of the paper's laws alone, without the code of any
/// left-out effect. Returns the mean net mass flow into each chamber, kg/s.
///
/// It is what [`Axis::step`] must equal bit by bit while every effect is
/// neutral, and it gives the flows that a mass balance needs.
pub fn plain_step<R: Real>(
    axis: &Axis<R>,
    state: &mut PlainState<R>,
    inputs: &AxisInputs<R>,
) -> [R; 2] {
    let supply = GasState {
        pressure_pa: inputs.supply_pressure_pa,
        temperature_k: axis.supply_temperature_k,
    };
    let areas = axis.valve.areas(inputs.command_v);
    let pneumatics = &axis.pneumatics;
    let ends = (supply, pneumatics.ambient);
    let flow_a = |gas| {
        let paths = (areas.supply_a_m2, areas.exhaust_a_m2);
        port_flow(&pneumatics.law, paths, ends, gas)
    };
    let flow_b = |gas| {
        let paths = (areas.supply_b_m2, areas.exhaust_b_m2);
        port_flow(&pneumatics.law, paths, ends, gas)
    };
    let (chamber_a, chamber_b) = (&pneumatics.chamber_a, &pneumatics.chamber_b);
    let from_m = state.carriage.position_m.value;
    let ahead_m = from_m + axis.dt_s * R::from_f64(0.5) * state.carriage.velocity_m_per_s;
    let half_a = chamber_a.stroke(from_m, ahead_m);
    let middle_a = chamber_a.predict(&mut state.a, &half_a, flow_a, axis.dt_s);
    let half_b = chamber_b.stroke(from_m, ahead_m);
    let middle_b = chamber_b.predict(&mut state.b, &half_b, flow_b, axis.dt_s);
    let drive_n = axis
        .carriage
        .drive_n(middle_a.pressure_pa, middle_b.pressure_pa);
    axis.carriage
        .step(&mut state.carriage, &axis.friction, drive_n, axis.dt_s);
    let to_m = state.carriage.position_m.value;
    let whole_a = chamber_a.stroke(from_m, to_m);
    let passed_a = chamber_a.complete(&mut state.a, middle_a, &whole_a, flow_a, axis.dt_s);
    let whole_b = chamber_b.stroke(from_m, to_m);
    let passed_b = chamber_b.complete(&mut state.b, middle_b, &whole_b, flow_b, axis.dt_s);
    [passed_a.mass_kg_per_s, passed_b.mass_kg_per_s]
}

/// Flow into a gas from the supply, less that to the exhaust.
fn port_flow<R: Real>(
    law: &FlowLaw<R>,
    (supply_m2, exhaust_m2): (R, R),
    (supply, ambient): (GasState<R>, GasState<R>),
    gas: GasState<R>,
) -> ChamberFlow<R> {
    let filling = law.flow(supply_m2, supply, gas);
    let emptying = law.flow(exhaust_m2, gas, ambient);
    ChamberFlow::NONE
        .with(
            filling.mass_flow_kg_per_s,
            filling.slope_2_kg_per_s_pa,
            supply.temperature_k,
            gas.temperature_k,
        )
        .with(
            -emptying.mass_flow_kg_per_s,
            -emptying.slope_1_kg_per_s_pa,
            ambient.temperature_k,
            gas.temperature_k,
        )
}

/// Mass of the gas in a chamber, kg.
pub fn mass_kg(chamber: &Chamber<f64>, state: &ChamberState<f64>, position_m: f64) -> f64 {
    state.pressure_pa.value * chamber.geometry.volume_m3(position_m)
        / (chamber.gas.gas_constant_j_per_kg_k * state.temperature_k.value)
}

/// Internal energy of the gas in a chamber, J.
pub fn energy_j(chamber: &Chamber<f64>, state: &ChamberState<f64>, position_m: f64) -> f64 {
    state.pressure_pa.value * chamber.geometry.volume_m3(position_m)
        / (chamber.gas.heat_capacity_ratio - 1.0)
}

/// Root mean square.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values {
        sum += value * value;
        count += 1.0;
    }
    (sum / f64::max(count, 1.0)).sqrt()
}
