//! Steady flow of the valve over command and pressure ratio, with a flow meter
//! at port A (figures 4 to 7 of the seed paper).

use super::recording::{Channel, Recording, command_v, time_s};
use super::rig::{L_PER_MIN_KG_PER_S, Rig};
use super::{BenchCase, Setup};
use crate::case::nameplate::AMBIENT;
use crate::plant::gas::Node;

const ROWS_PER_S: f64 = 200.0;
const ROWS_PER_LEVEL: usize = 200;
/// What the engineer takes for the null.
const NULL_V: f64 = 5.0;
/// Pressure at port A while the command is stepped: 5 bar gauge, and less
/// where the supply is low. Supplies begin at 6 bar absolute, from which next
/// to nothing would flow into 5 bar gauge.
const PORT_PA: f64 = AMBIENT.pressure_pa + 5e5;
const HIGHEST_RATIO: f64 = 0.8;
/// Openings whose areas are in the truth.
const OPENINGS_V: [f64; 6] = [0.5, 1.0, 2.0, 3.0, 4.0, 4.5];
/// Openings and steps of the sweep of the pressure ratio.
const SWEPT_V: [f64; 2] = [2.0, 4.0];
const RATIOS: usize = 15;
const RATIO_RANGE: [f64; 2] = [0.97, 0.15];
/// Port A cannot be swept below the surroundings: a little above is its least.
const LEAST_PA: f64 = 1.03 * AMBIENT.pressure_pa;
/// Time in which the regulator at port A follows, and how much it gives way to
/// the flow: 1 % of 500 kPa at 0.02 kg/s.
const REGULATOR_S: f64 = 0.06;
const YIELDS_PA_S_PER_KG: f64 = 2.5e5;
/// The flow meter: settling, noise, converter, drift; l/min (ANR).
const METER_S: f64 = 0.05;
const METER_NOISE_L_MIN: f64 = 0.3;
const METER_RELATIVE_NOISE: f64 = 1e-3;
const METER_STEP_L_MIN: f64 = 0.05;
const METER_DRIFT_L_MIN: f64 = 0.3;

/// A level that is held: command and set pressure at port A.
type Level = (f64, f64);

pub(super) fn draw(setup: &mut Setup) -> BenchCase {
    let supply_pa = setup.axis.nameplate.supply_pa;
    let runs = [
        ("staircase.csv", staircase(supply_pa)),
        ("ratio.csv", sweep(supply_pa)),
    ];
    let mut recordings = Vec::new();
    for (recording, (name, levels)) in runs.iter().enumerate() {
        recordings.push(record(setup, recording, name, levels));
    }
    let plate = &setup.axis.nameplate;
    let mut truth = super::truth([
        ("valve.null_V", plate.null_v),
        ("valve.critical_pressure_ratio", plate.critical_ratio),
    ]);
    truth.extend(setup.axis.named_areas(&OPENINGS_V));
    BenchCase {
        rig_toml: rig(setup),
        recordings,
        truth,
    }
}

/// Steps of 0.5 V, and of 0.05 V within 0.6 V of the null.
fn staircase(supply_pa: f64) -> Vec<Level> {
    let port_pa = PORT_PA.min(HIGHEST_RATIO * supply_pa);
    let coarse = (-10_i32..=10).map(|step| 0.5 * f64::from(step));
    let fine = (-12_i32..=12).map(|step| 0.05 * f64::from(step));
    let mut openings_v: Vec<f64> = coarse
        .filter(|opening_v| opening_v.abs() > 0.61)
        .chain(fine)
        .collect();
    openings_v.sort_by(f64::total_cmp);
    openings_v
        .iter()
        .map(|opening_v| (command_v(NULL_V + opening_v), port_pa))
        .collect()
}

/// The pressure ratio from the highest to the lowest, at two openings.
fn sweep(supply_pa: f64) -> Vec<Level> {
    let [highest, lowest] = RATIO_RANGE;
    let mut levels = Vec::new();
    for opening_v in SWEPT_V {
        for step in 0..RATIOS {
            let share = step as f64 / (RATIOS - 1) as f64;
            let port_pa = supply_pa * (highest + share * (lowest - highest));
            levels.push((NULL_V + opening_v, port_pa.max(LEAST_PA)));
        }
    }
    levels
}

/// Mass flow from the valve into what is at port A.
fn flow_kg_per_s(setup: &Setup, command_v: f64, port_pa: f64) -> f64 {
    let port = Node {
        pressure_pa: port_pa,
        ..AMBIENT
    };
    let paths = setup.axis.paths(command_v);
    let flow = setup.axis.flow();
    let into = flow.stream(paths.supply_m2[0], setup.axis.supply(), port);
    let out = flow.stream(paths.exhaust_m2[0], port, AMBIENT);
    into.mass_kg_per_s - out.mass_kg_per_s
}

fn record(setup: &Setup, recording: usize, name: &str, levels: &[Level]) -> (String, String) {
    let noises = setup.noises;
    let duration_s = (levels.len() * ROWS_PER_LEVEL) as f64 / ROWS_PER_S;
    let mut pressure = noises.pressure(recording, 0);
    let mut supply = noises.pressure(recording, 1);
    let mut meter = Channel::new(noises.of(recording, 2), METER_NOISE_L_MIN, METER_STEP_L_MIN)
        .with_relative_noise(METER_RELATIVE_NOISE)
        .with_drift(METER_DRIFT_L_MIN, duration_s);
    let follows = |lag_s: f64| -libm::expm1(-1.0 / (ROWS_PER_S * lag_s));
    let mut port_pa = levels[0].1;
    let mut metered_l_min = 0.0;
    let mut file = Recording::new(name, "t_s,u_V,p_a_Pa,p_s_Pa,flow_l_min");
    for row in 0..levels.len() * ROWS_PER_LEVEL {
        let now_s = time_s(row, ROWS_PER_S);
        let (command_v, set_pa) = levels[row / ROWS_PER_LEVEL];
        let flow = flow_kg_per_s(setup, command_v, port_pa);
        metered_l_min += follows(METER_S) * (flow / L_PER_MIN_KG_PER_S - metered_l_min);
        file.row([
            (now_s, 4),
            (command_v, 4),
            (pressure.reads(now_s, port_pa), 1),
            (supply.reads(now_s, setup.axis.nameplate.supply_pa), 1),
            (meter.reads(now_s, metered_l_min), 3),
        ]);
        let yielding_pa = set_pa + YIELDS_PA_S_PER_KG * flow;
        port_pa += follows(REGULATOR_S) * (yielding_pa - port_pa);
    }
    file.finish()
}

/// The noise that is stated: that at half of the largest flow.
fn stated_noise_kg_per_s(setup: &Setup) -> f64 {
    let half_l_min = 0.5 * flow_kg_per_s(setup, 10.0, LEAST_PA) / L_PER_MIN_KG_PER_S;
    let relative_l_min = METER_RELATIVE_NOISE * half_l_min;
    libm::hypot(METER_NOISE_L_MIN, relative_l_min) * L_PER_MIN_KG_PER_S
}

fn rig(setup: &mut Setup) -> String {
    let mut rig = Rig::new();
    rig.command();
    rig.pressure("p_a");
    rig.pressure("p_s");
    let sensor = [
        stated_noise_kg_per_s(setup),
        METER_STEP_L_MIN * L_PER_MIN_KG_PER_S,
    ];
    rig.signal("flow_a", "flow_l_min", "l/min(ANR)", sensor);
    rig.surroundings();
    rig.supply(&setup.axis);
    rig.data_sheet_valve(&setup.axis, &mut setup.random, NULL_V);
    rig.uncertain("valve.null_V", 0.1);
    rig.finish()
}

#[cfg(test)]
mod tests {
    use super::super::Experiment;
    use super::*;

    #[test]
    fn prop_the_flow_changes_its_sign_with_the_opening() {
        let setup = Setup::new(Experiment::ValveFlow, 1);
        let null_v = setup.axis.nameplate.null_v;
        assert!(flow_kg_per_s(&setup, null_v + 1.0, PORT_PA) > 1e-4);
        assert!(flow_kg_per_s(&setup, null_v - 1.0, PORT_PA) < -1e-4);
    }

    #[test]
    fn val_the_last_rows_of_a_level_show_the_steady_flow() {
        // 50 rows: noise 0.13 l/min at most, a drift of 0.3 l/min, and what
        // the port's transmitter (35 Pa) is worth.
        const TOLERANCE_L_MIN: f64 = 0.9;
        let setup = Setup::new(Experiment::ValveFlow, 1);
        let levels = sweep(setup.axis.nameplate.supply_pa);
        let (_, text) = record(&setup, 1, "ratio.csv", &levels);
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(1)
            .map(|row| row.split(',').map(|item| item.parse().unwrap()).collect())
            .collect();
        for (level, (command_v, _)) in levels.iter().enumerate() {
            let last = &rows[level * ROWS_PER_LEVEL + 150..(level + 1) * ROWS_PER_LEVEL];
            let mean = |column: usize| last.iter().map(|row| row[column]).sum::<f64>() / 50.0;
            let expected = flow_kg_per_s(&setup, *command_v, mean(2)) / L_PER_MIN_KG_PER_S;
            let got = mean(4);
            assert!(
                (got - expected).abs() < TOLERANCE_L_MIN,
                "level {level}: {got} l/min, expected {expected}"
            );
        }
    }
}
