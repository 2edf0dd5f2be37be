//! The fault campaign in small: every fault once at every moment. The whole one
//! is `cargo xtask faults`, which writes `docs/faults.md`.

use firmware::codes::{AdcCode, AdcCodes, DacCode};
use firmware::control_task::ControlTask;
use firmware::fault::Fault;
use firmware::start::{cause_of, finding_of};
use firmware::tick::{Command, Sample, State};
use host_sim::closed_loop::{HostController, control_task, wrongly_known};
use host_sim::fault_campaign::{CASES, Moment, fault_list, normal_run, run_case};
use host_sim::rig::Rig;
use model_core::controller::Controller;
use model_core::paper;
use model_core::reference::Reference;
use proptest::prelude::*;

const PAPER: &str = include_str!("../../host-sim/rigs/paper.toml");
/// The nearest step of 12 bits to 5 V.
const NULL: DacCode = DacCode(2048 * 16);

fn rig(text: &str) -> Rig {
    Rig::parse(text, "paper.toml").expect("a rig")
}

fn task() -> ControlTask {
    ControlTask::new(Controller::new(paper::axis()))
}

/// At rest in the middle, the chambers at 4 bar.
fn at_rest(tick: u32) -> Sample {
    Sample {
        tick,
        codes: AdcCodes::from_array([32_768, 26_208, 26_208, 45_872, 32_768]),
        reference: Reference {
            position_m: 0.0,
            velocity_m_per_s: 0.0,
            acceleration_m_per_s2: 0.0,
        },
    }
}

fn run_to(task: &mut ControlTask, ticks: u32) -> Command {
    (0..ticks)
        .map(|tick| task.tick(&at_rest(tick)))
        .last()
        .expect("a tick")
}

#[test]
fn prop_every_fault_ends_at_the_null_within_its_tick_and_says_what_it_is() {
    let rig = rig(PAPER);
    for (place, case) in CASES.iter().enumerate() {
        for moment in Moment::ALL {
            let seed = 1 + place as u64;
            let known = wrongly_known(&rig, seed);
            let mut drive = HostController::new(control_task(&known).expect("an axis"));
            let outcome = run_case(&rig, &mut drive, case, moment, seed).expect("a sound run");
            let what = format!("{} {moment:?}: {outcome:?}", case.name);
            assert!(outcome.was_at_null && outcome.came_back, "{what}");
            match outcome.fault {
                Some(fault) => assert!(case.faults.contains(&fault), "{what}"),
                None => assert!(case.needs_motion, "{what}"),
            }
        }
    }
}

#[test]
fn prop_single_samples_that_nothing_can_excuse_are_seen_in_their_tick() {
    let sound = at_rest(50);
    let with = |place: usize, code: u16| {
        let mut codes = sound.codes.to_array();
        codes[place] = code;
        AdcCodes::from_array(codes)
    };
    for channel in 0..5 {
        for (code, fault) in [(0xFFFF, Fault::FailedConversion), (0, Fault::OutOfRange)] {
            let mut task = task();
            assert_eq!(run_to(&mut task, 50).state, State::Track);
            let codes = with(channel, code);
            let command = task.tick(&Sample { codes, ..sound });
            assert_eq!((command.state, command.fault), (State::Fault, fault.code()));
            assert_eq!(command.valve, NULL);
            let finding = task.latched().expect("a fault");
            assert_eq!(usize::from(finding.detail), channel);
        }
    }
}

#[test]
fn prop_few_missed_samples_are_bridged_and_counted() {
    let mut task = task();
    run_to(&mut task, 50);
    for missed in [1, 3] {
        let next = task.tick(&at_rest(task_tick(&task) + 1 + missed));
        assert_eq!(next.state, State::Track);
    }
    assert_eq!(counted(&task), 4);
    let command = task.tick(&at_rest(1000));
    assert_eq!(command.fault, Fault::MissedTicks.code());

    fn counted(task: &ControlTask) -> u32 {
        task.status(firmware::start::ResetCause::PowerOn, false)
            .counters
            .missed_ticks
    }
    fn task_tick(task: &ControlTask) -> u32 {
        49 + counted(task) + u32::from(counted(task) > 0)
    }
}

#[test]
fn prop_the_way_out_of_a_fault_is_the_acknowledgement_alone() {
    let mut task = task();
    run_to(&mut task, 50);
    task.note_fault(Fault::DacMismatch.at(0));
    for tick in 50..200 {
        let command = task.tick(&at_rest(tick));
        assert_eq!((command.state, command.valve), (State::Fault, NULL));
    }
    // A reset does not help.
    let kept = cause_of(task.latched());
    let mut task = self::task();
    task.recall(finding_of(kept).expect("a fault"));
    let command = task.tick(&at_rest(0));
    assert_eq!(command.fault, Fault::DacMismatch.code());
    assert!(task.acknowledge());
    assert_eq!(task.tick(&at_rest(1)).state, State::Idle);
    let nothing = Reference {
        position_m: f32::NAN,
        ..at_rest(0).reference
    };
    for tick in 2..50 {
        let command = task.tick(&Sample {
            reference: nothing,
            ..at_rest(tick)
        });
        assert_eq!((command.state, command.valve), (State::Idle, NULL));
    }
    assert_eq!(task.tick(&at_rest(50)).state, State::Track);
    assert!(!task.acknowledge(), "there is nothing to acknowledge");
}

#[test]
fn prop_what_only_a_reset_cures_is_not_acknowledged() {
    let mut task = task();
    task.note_fault(Fault::ClockFailed.at(1));
    assert_eq!(run_to(&mut task, 3).state, State::Fault);
    assert!(!task.acknowledge());
    assert_eq!(task.tick(&at_rest(3)).state, State::Fault);
}

#[test]
fn prop_sensors_without_noise_slow_and_noisy_ones_do_not_trip() {
    let without_noise = ["noise = 250.0", "noise = 4.0e-6", "noise = 1.5e-3"]
        .iter()
        .fold(PAPER.to_owned(), |text, noise| {
            text.replace(noise, "noise = 1e-12")
        });
    let noisy = PAPER
        .replace("noise = 250.0", "noise = 500.0")
        .replace("noise = 4.0e-6", "noise = 10.0e-6");
    let slow = format!(
        "{PAPER}\n[effects.position-time-skew]\ndelay_s = 4e-3\n\
         [effects.pressure-sensor-lag]\ntime_constant_s = 2e-3\n"
    );
    for (what, text) in [
        ("no noise", without_noise),
        ("twice the noise", noisy),
        ("slow sensors", slow),
    ] {
        let plant = rig(&text);
        for seed in [1, 2, 3] {
            let known = wrongly_known(&rig(PAPER), seed);
            let mut drive = HostController::new(control_task(&known).expect("an axis"));
            let run = normal_run(&plant, &mut drive, seed).expect("a run");
            assert_eq!(run.trip, None, "{what}, seed {seed}: {run:?}");
        }
    }
}

#[test]
fn prop_the_book_holds_the_fault_list_of_the_code() {
    let book = include_str!("../../docs/faults.md");
    assert!(
        book.contains(&fault_list()),
        "docs/faults.md is not up to date: `cargo xtask faults`"
    );
}

fn any_sample() -> impl Strategy<Value = (u32, [u16; 5], [f32; 3], bool)> {
    let reference = prop_oneof![
        Just(0.0_f32),
        any::<f32>(),
        -0.3_f32..0.3,
        Just(f32::NAN),
        Just(f32::INFINITY)
    ];
    let tick = prop_oneof![9 => Just(1_u32), 1 => any::<u32>()];
    let sound = [32_768_u16, 26_208, 26_208, 45_872, 32_768];
    let codes = prop_oneof![
        8 => any::<[i8; 5]>().prop_map(move |noise| {
            std::array::from_fn(|place| sound[place].saturating_add_signed(i16::from(noise[place])))
        }),
        1 => any::<[u16; 5]>()
    ];
    (
        tick,
        codes,
        [reference.clone(), reference.clone(), reference],
        any::<bool>(),
    )
}

proptest! {
    #[test]
    fn prop_whatever_comes_a_fault_is_the_null_until_it_is_acknowledged(
        inputs in prop::collection::vec(any_sample(), 1..200),
    ) {
        let mut task = task();
        let mut tick = 0_u32;
        let mut was_fault = false;
        let mut seen_at = 0_u32;
        for (step, codes, [position_m, velocity_m_per_s, acceleration_m_per_s2], orders) in inputs {
            tick = tick.wrapping_add(step);
            let acknowledged = orders && task.acknowledge();
            let command = task.tick(&Sample {
                tick,
                codes: AdcCodes::from_array(codes),
                reference: Reference { position_m, velocity_m_per_s, acceleration_m_per_s2 },
            });
            let is_fault = command.state == State::Fault;
            prop_assert_eq!(is_fault, command.fault != 0);
            if is_fault && (!was_fault || acknowledged) {
                seen_at = tick;
            }
            // A load that starts the wrong way round is braked.
            let is_of_polarity = [Fault::WrongPolarity, Fault::VelocityContradictsPosition]
                .contains(&Fault::from_code(command.fault).unwrap_or(Fault::BrownOut));
            let brakes = is_of_polarity && tick.wrapping_sub(seen_at) <= 20;
            prop_assert!(command.state == State::Track || command.valve == NULL || brakes);
            prop_assert!(!was_fault || acknowledged || is_fault);
            prop_assert!(command.estimate.to_array().into_iter().all(f32::is_finite));
            let has_failed = codes.iter().any(|code| AdcCode(*code) == firmware::codes::FAILED_CONVERSION);
            prop_assert!(!has_failed || is_fault);
            was_fault = is_fault;
        }
    }
}
