//! Many runs of a scenario: their bands against a case with a known answer.

use std::path::Path;

use host_sim::scenario::Scenario;
use host_sim::simulate::ensemble::ensemble;
use host_sim::simulate::simulate;

fn sine() -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/sine.toml");
    let mut scenario = Scenario::read(&path).expect("a scenario");
    scenario.duration_s = scenario.duration_s.min(1.0);
    scenario
}

#[test]
fn val_of_a_rig_that_is_known_the_band_is_a_line() {
    let mut scenario = sine();
    scenario.rig.uncertainty = [("carriage.mass_kg".to_owned(), 0.0)].into();
    let exact = simulate(&scenario).expect("it runs").samples;
    let found = ensemble(&scenario, 5, 1).expect("they run");
    assert_eq!((found.time_s.len(), found.stopped), (exact.len(), 0));
    for ([low, middle, high], row) in found.bands[0].rows.iter().zip(&exact) {
        assert!(low.to_bits() == high.to_bits() && low.to_bits() == middle.to_bits());
        assert!((middle - 1e3 * row.position_m).abs() < 1e-9);
    }
}

/// At its first rows nothing but the start's pressure matters, which is that of the supply by a
/// constant share: of a normal number cut at two deviations 90 of 100 lie within 1.472 deviations.
#[test]
fn val_the_band_of_a_number_is_that_of_its_distribution() {
    let mut scenario = sine();
    scenario.rig.uncertainty = [("supply.pressure_Pa".to_owned(), 0.05)].into();
    let found = ensemble(&scenario, 400, 3).expect("they run");
    let pressure = found
        .bands
        .iter()
        .find(|band| band.name == "p_a_kPa")
        .expect("a signal");
    let [low, middle, high] = pressure.rows[0];
    let nominal = 1e-3 * simulate(&scenario).expect("it runs").samples[0].pressure_a_pa;
    assert!(
        (middle / nominal - 1.0).abs() < 0.01,
        "{middle} of {nominal}"
    );
    // The quantiles of the cut distribution, by its integral; of 400 runs good to a tenth.
    let expected = 2.0 * 1.472 * 0.05;
    let width = (high - low) / middle;
    assert!(
        (width / expected - 1.0).abs() < 0.12,
        "{width} of {expected}"
    );
}

#[test]
fn prop_the_same_seed_gives_the_same_bands() {
    let scenario = sine();
    let runs = |seed| ensemble(&scenario, 6, seed).expect("they run");
    assert_eq!(runs(1), runs(1));
    assert_ne!(runs(1), runs(2));
}
