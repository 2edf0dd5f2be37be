//! An axis that is wired the wrong way round is found out before it has gone anywhere.

use firmware::fault::Fault;
use host_sim::closed_loop::{HostController, control_task, wrongly_known};
use host_sim::fault_campaign::{FirstStart, Wiring, first_start};
use host_sim::rig::Rig;

const PAPER: &str = include_str!("../../host-sim/rigs/paper.toml");
/// Supplies, Pa absolute: 3 and 7 bar gauge.
const SUPPLIES_PA: [f64; 2] = [4.0e5, 8.0e5];
const SEEDS: u64 = 10;

fn first_starts(wiring: Wiring) -> Vec<FirstStart> {
    first_starts_of("", wiring)
}

/// Of an axis that holds something that its settings do not know.
fn first_starts_of(unknown: &str, wiring: Wiring) -> Vec<FirstStart> {
    let rig_of = |text: &str| Rig::parse(text, "paper.toml").expect("a rig");
    let (paper, whole) = (rig_of(PAPER), rig_of(&format!("{PAPER}{unknown}")));
    let mut all = Vec::new();
    for supply_pa in SUPPLIES_PA {
        let supplied = [("supply.pressure_Pa".to_owned(), supply_pa)]
            .into_iter()
            .collect();
        let rig = whole.with_values(&supplied);
        for seed in 1..=SEEDS {
            let known = wrongly_known(&paper.with_values(&supplied), seed);
            let mut drive = HostController::new(control_task(&known).expect("an axis"));
            let outcome = first_start(&rig, &mut drive, wiring, seed).expect("a sound run");
            all.push(outcome);
        }
    }
    all
}

fn farthest_m(outcomes: &[FirstStart]) -> f64 {
    outcomes.iter().map(|one| one.went_m).fold(0.0, f64::max)
}

#[test]
fn prop_what_is_wired_rightly_starts() {
    for outcome in first_starts(Wiring::Right) {
        assert_eq!(outcome.fault, None);
        assert!(outcome.apart_m < 0.1e-3, "{outcome:?}");
    }
}

#[test]
fn val_a_valve_or_gauges_the_wrong_way_round_move_nothing() {
    for wiring in [Wiring::ReversedValve, Wiring::ExchangedGauges] {
        let outcomes = first_starts(wiring);
        for outcome in &outcomes {
            let fault = outcome.fault.map(|(fault, _)| fault);
            assert_eq!(fault, Some(Fault::WrongPolarity), "{wiring:?}: {outcome:?}");
        }
        assert!(farthest_m(&outcomes) < 2e-3, "{wiring:?}");
    }
}

#[test]
fn val_a_motion_the_wrong_way_round_is_found_out() {
    for wiring in [
        Wiring::ExchangedPorts,
        Wiring::ReversedMotion,
        Wiring::ReversedPosition,
        Wiring::ReversedVelocity,
    ] {
        let outcomes = first_starts(wiring);
        for outcome in &outcomes {
            assert!(outcome.fault.is_some(), "{wiring:?}: {outcome:?}");
        }
        assert!(farthest_m(&outcomes) < 2e-3, "{wiring:?}: {outcomes:?}");
    }
}

/// A spool that answers late, which the settings do not know, does not turn the force over and throw the load back:
/// the farthest way, m, of all starts the wrong way round.
#[test]
fn val_a_slow_spool_or_a_tube_does_not_carry_a_wrong_motion_far() {
    let spool = |hz: f64| {
        format!("\n[effects.spool-dynamics]\nnatural_frequency_Hz = {hz:.1}\ndamping_ratio = 0.7\n")
    };
    let tube = "\n[effects.tube-line]\nlength_m = 1.5\ndiameter_m = 0.004\n".to_owned();
    for (unknown, most_m) in [(spool(15.0), 10e-3), (spool(30.0), 4e-3), (tube, 3.5e-3)] {
        for wiring in [
            Wiring::ExchangedPorts,
            Wiring::ReversedMotion,
            Wiring::ReversedPosition,
            Wiring::ReversedVelocity,
        ] {
            let outcomes = first_starts_of(&unknown, wiring);
            let far_m = farthest_m(&outcomes);
            assert!(far_m < most_m, "{unknown} {wiring:?}: {far_m} m");
            let is_said = outcomes.iter().all(|outcome| outcome.fault.is_some());
            assert!(is_said, "{unknown} {wiring:?}: {outcomes:?}");
        }
    }
}
