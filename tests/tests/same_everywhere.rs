//! The run on the host is the run on the chip: a minute of mixed motion with the
//! firmware in QEMU and with the host build, the same bytes over the link.
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

const TICKS: u32 = 60_000;
/// How long QEMU may take to listen, to answer and to end.
const PATIENCE: Duration = Duration::from_secs(30);

/// The rig whose axis the firmware holds as long as there are no settings.
fn paper() -> Rig {
    let text = include_str!("../../host-sim/rigs/paper.toml");
    Rig::parse(text, "paper.toml").expect("the paper's rig")
}

fn driven(drive: &mut dyn Drive) -> Run {
    let course = Course {
        motion: Motion::mixed().repeated(f64::from(TICKS) * PlantSettings::TICK_S),
        ticks: TICKS,
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
fn val_a_minute_of_mixed_motion_is_the_same_on_host_in_qemu_and_replayed() {
    if let Err(failure) = qemu::need_qemu() {
        assert!(std::env::var_os("CI").is_none(), "{failure}");
        println!("SKIPPED: the firmware in QEMU: {failure}");
        return;
    }
    let image = image::build(image::MPS2).expect("the image builds");
    let machine = Machine::start(&image, &[]).expect("QEMU starts");
    let plant = machine.connect(PATIENCE).expect("QEMU listens");
    let mut firmware = RemoteController::greet(plant).expect("a greeting");
    let in_qemu = driven(&mut firmware);
    firmware.end().expect("it is sent");
    assert!(machine.wait(PATIENCE).expect("it ends").success());

    let task = || control_task(&paper()).expect("a controller");
    let on_host = driven(&mut HostController::new(task()));
    for (qemu, host) in in_qemu.rows.iter().zip(&on_host.rows) {
        assert_eq!(
            qemu.command.payload(),
            host.command.payload(),
            "tick {}",
            qemu.sample.tick
        );
    }
    assert_eq!(in_qemu.rows.len(), TICKS as usize);
    let transcript = bytes(&in_qemu);
    assert!(transcript == bytes(&on_host), "the transcripts differ");
    let replay = transcript::replay(&transcript[..], task()).expect("a transcript");
    assert_eq!((replay.ticks, replay.differences), (u64::from(TICKS), 0));

    assert!(on_host.first_fault().is_none());
    let furthest_m = on_host.rows.iter().map(|row| row.truth.position_m.abs());
    assert!(furthest_m.fold(0.0, f64::max) > 0.09, "it moves");
}
