//! Heat transfer that changes while the gas flows is seen by runs of several lengths.
//!
//! The vessel is integrated here: internal energy and mass, a steady stream through a nozzle.

use bench::{Experiment, Outcome};
use grey_box::laws::Track;
use grey_box::recording::Recording;
use grey_box::rig::Rig;

const RIG: &str = r#"
format = "rig/1"
[signals]
t = { column = "t", unit = "s" }
u = { column = "u", unit = "V" }
p_a = { column = "p_a", unit = "Pa(abs)", noise = 100.0 }
[gas]
gamma = 1.4
gas_constant_J_kgK = 287.0
[environment]
pressure_Pa = 101325.0
temperature_K = 293.15
[vessel]
volume_m3 = 0.0003
surface_m2 = 0.03
[chambers]
model = "energy-balance"
heat_transfer_charging_W_m2K = 60.0
heat_transfer_discharging_W_m2K = 60.0
"#;
const VOLUME_M3: f64 = 0.0003;
const SURFACE_M2: f64 = 0.03;
const WALL_K: f64 = 293.15;
const GAS_CONSTANT: f64 = 287.0;
const CV: f64 = GAS_CONSTANT / 0.4;
const CP: f64 = 1.4 * CV;
/// The runs' lengths, and the time over which the heat transfer falls.
const FLOWING_S: [f64; 6] = [0.05, 0.1, 0.2, 0.3, 0.5, 0.8];
const STREAM_KG_PER_S: f64 = 1.5e-3;
const REST_S: f64 = 0.5;
const SETTLING_S: f64 = 12.0;

/// Pressure in a charging run; the heat transfer is that of the time since the opening.
fn run(flowing_s: f64, heat_transfer: &dyn Fn(f64) -> f64) -> Recording {
    let (step_s, steps) = (1e-4, 10);
    let mut mass_kg = 101_325.0 * VOLUME_M3 / (GAS_CONSTANT * WALL_K);
    let mut energy_j = mass_kg * CV * WALL_K;
    let mut random = grey_box::random::Noise::new(7, (1e3 * flowing_s) as u64);
    let (mut times, mut commands, mut pressures) = (Vec::new(), Vec::new(), Vec::new());
    let rows = ((REST_S + flowing_s + SETTLING_S) * 1e3) as usize;
    for row in 0..rows {
        let open_s = row as f64 * 1e-3 - REST_S;
        let flows = open_s > -1e-9 && open_s < flowing_s - 1e-9;
        times.push(row as f64 * 1e-3);
        commands.push(if flows { 6.0 } else { 5.0 });
        pressures.push(0.4 * energy_j / VOLUME_M3 + 100.0 * random.normal());
        for step in 0..steps {
            let now_s = open_s + f64::from(step) * step_s;
            let stream = if flows { STREAM_KG_PER_S } else { 0.0 };
            let temperature_k = energy_j / (mass_kg * CV);
            let heat_w = heat_transfer(now_s.max(0.0)) * SURFACE_M2 * (WALL_K - temperature_k);
            energy_j += (CP * WALL_K * stream + heat_w) * step_s;
            mass_kg += stream * step_s;
        }
    }
    let signals = [("u", commands), ("p_a", pressures)].map(|(name, all)| (name.to_owned(), all));
    Recording::from_signals(format!("{flowing_s}"), times, signals.into())
}

fn evaluated(heat_transfer: &dyn Fn(f64) -> f64) -> Outcome {
    let rig = Rig::parse(RIG, "rig.toml").expect("a rig");
    let recordings: Vec<Recording> = FLOWING_S
        .iter()
        .map(|one| run(*one, heat_transfer))
        .collect();
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    Experiment::HeatTransfer
        .evaluate(&rig, &tracks)
        .expect("numbers")
}

/// The line of the picture at the opening and at the last stop.
fn line(outcome: &Outcome) -> [f64; 2] {
    let curves = outcome.pictures.iter().flat_map(|one| &one.curves);
    let mut over_time = curves.filter(|one| one.name == "charging, over time");
    let points = &over_time.next().expect("a line over time").points;
    [points[0].1, points[1].1]
}

#[test]
fn val_a_heat_transfer_that_falls_while_the_gas_flows_is_said() {
    let outcome = evaluated(&|time_s| (120.0 - 100.0 * time_s).max(40.0));
    let [from, to] = line(&outcome);
    assert!(
        (from - 120.0).abs() < 8.0 && (to - 40.0).abs() < 8.0,
        "{from} {to}"
    );
    let said = |part: &str| outcome.notes.iter().any(|note| note.contains(part));
    assert!(said("while charging changes"), "{:?}", outcome.notes);
}

#[test]
fn val_a_steady_heat_transfer_is_not_said_to_change() {
    let outcome = evaluated(&|_| 80.0);
    let [from, to] = line(&outcome);
    assert!(
        (from - 80.0).abs() < 5.0 && (to - 80.0).abs() < 5.0,
        "{from} {to}"
    );
    let said = |part: &str| outcome.notes.iter().any(|note| note.contains(part));
    assert!(said("the same all the time"), "{:?}", outcome.notes);
    let number = outcome
        .number("chambers.heat_transfer_charging_W_m2K")
        .expect("a number");
    assert!(
        (number.value - 80.0).abs() < 3.0 * number.deviation,
        "{number:?}"
    );
}
