//! The run on the host is the run on the chip: mixed motion with the firmware in QEMU and
//! with the host build, the same bytes over the link. Continuous integration runs its
//! first seconds; a minute of it is long.
//!
//! Without QEMU this test says so and passes; in continuous integration it fails.

use host_sim::closed_loop::{
    Course, Drive, HostController, RemoteController, Run, control_task, run, transcript,
};
use host_sim::motion::Motion;
use host_sim::plant::{Plant, PlantSettings};
use host_sim::rig::Rig;
use std::time::Duration;
use xtask::qemu::Machine;
use xtask::{image, qemu};

/// How long QEMU may take to listen, to answer and to end.
const PATIENCE: Duration = Duration::from_secs(30);

/// The rig whose axis the firmware holds as long as there are no settings.
fn paper() -> Rig {
    let text = include_str!("../../host-sim/rigs/paper.toml");
    Rig::parse(text, "paper.toml").expect("the paper's rig")
}

fn driven(drive: &mut dyn Drive, ticks: u32) -> Run {
    let course = Course {
        motion: Motion::mixed().repeated(f64::from(ticks) * PlantSettings::TICK_S),
        ticks,
    };
    let mut plant = Plant::new(&paper(), PlantSettings::at(0.0, 1)).expect("a plant");
    run(&mut plant, drive, &course).expect("a run")
}

fn bytes(run: &Run) -> Vec<u8> {
    let mut bytes = Vec::new();
    transcript::write(run, 1_000_000, &mut bytes).expect("memory");
    bytes
}

#[test]
fn val_mixed_motion_is_the_same_on_host_in_qemu_and_replayed() {
    is_the_same(8_000);
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_a_minute_of_mixed_motion_is_the_same_on_host_in_qemu_and_replayed() {
    is_the_same(60_000);
}

fn is_the_same(ticks: u32) {
    if let Err(failure) = qemu::need_qemu() {
        assert!(std::env::var_os("CI").is_none(), "{failure}");
        println!("SKIPPED: the firmware in QEMU: {failure}");
        return;
    }
    let image = image::build(image::MPS2).expect("the image builds");
    let machine = Machine::start(
        &image,
        &qemu::with_settings(&qemu::checked_settings().expect("a file")),
    )
    .expect("QEMU starts");
    let plant = machine.connect(PATIENCE).expect("QEMU listens");
    let mut firmware = RemoteController::greet(plant).expect("a greeting");
    let in_qemu = driven(&mut firmware, ticks);
    firmware.end().expect("it is sent");
    assert!(machine.wait(PATIENCE).expect("it ends").success());

    let task = || control_task(&paper()).expect("a controller");
    let on_host = driven(&mut HostController::new(task()), ticks);
    for (qemu, host) in in_qemu.rows.iter().zip(&on_host.rows) {
        assert_eq!(
            qemu.command.payload(),
            host.command.payload(),
            "tick {}",
            qemu.sample.tick
        );
    }
    assert_eq!(in_qemu.rows.len(), ticks as usize);
    let transcript = bytes(&in_qemu);
    assert!(transcript == bytes(&on_host), "the transcripts differ");
    let replay = transcript::replay(&transcript[..], task()).expect("a transcript");
    assert_eq!((replay.ticks, replay.differences), (u64::from(ticks), 0));

    assert!(on_host.first_fault().is_none());
    let furthest_m = on_host.rows.iter().map(|row| row.truth.position_m.abs());
    assert!(furthest_m.fold(0.0, f64::max) > 0.09, "it moves");
}
