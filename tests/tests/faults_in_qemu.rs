//! Faults that happen to the firmware in QEMU: its commands are the host's, byte
//! for byte, up to the fault, in it, and on the way back. A sixth of the cases, each
//! at one moment; `cargo xtask faults` has all of them at all moments.
//!
//! Without QEMU this test says so and passes; in continuous integration it fails.

use firmware::control_task::ControlTask;
use host_sim::closed_loop::{HostController, RemoteController};
use host_sim::fault_campaign::{Both, CASES, Case, Moment, run_case};
use host_sim::rig::Rig;
use model_core::controller::Controller;
use model_core::paper;
use std::path::Path;
use std::time::Duration;
use xtask::qemu::Machine;
use xtask::{image, qemu};

const PATIENCE: Duration = Duration::from_secs(20);

fn compare(image: &Path, rig: &Rig, case: &Case, moment: Moment) {
    let checked = qemu::checked_settings().expect("a file");
    let machine = Machine::start(image, &qemu::with_settings(&checked)).expect("QEMU starts");
    let plant = machine.connect(PATIENCE).expect("QEMU listens");
    let mut both = Both {
        expected: HostController::new(ControlTask::new(Controller::new(paper::axis()))),
        driving: RemoteController::greet(plant).expect("the firmware greets"),
    };
    let outcome = run_case(rig, &mut both, case, moment, 1).expect("a sound run");
    let what = format!("{} {moment:?}: {outcome:?}", case.name);
    assert!(outcome.was_at_null && outcome.came_back, "{what}");
    assert!(outcome.fault.is_some() || case.needs_motion, "{what}");
    let stream = both.driving.end().expect("the run ends");
    let status = machine.wait(PATIENCE).expect("it ends");
    drop(stream);
    assert!(status.success(), "{what}: {status}");
}

#[test]
fn val_faults_in_qemu_are_those_of_the_host_to_the_byte() {
    if let Err(failure) = qemu::need_qemu() {
        assert!(std::env::var_os("CI").is_none(), "{failure}");
        println!("SKIPPED: faults in QEMU: {failure}");
        return;
    }
    let image = image::build(image::MPS2).expect("the image builds");
    let rig = include_str!("../../host-sim/rigs/paper.toml");
    let rig = Rig::parse(rig, "paper.toml").expect("a rig");
    let moments = Moment::ALL.iter().cycle();
    for (case, moment) in CASES.iter().step_by(6).zip(moments) {
        compare(&image, &rig, case, *moment);
    }
}
