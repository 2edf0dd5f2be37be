//! Faults that happen to the firmware in QEMU: its commands are the host's, byte
//! for byte, up to the fault, in it, and on the way back.
//!
//! Without QEMU this test says so and passes; in continuous integration it fails.

use firmware::control_task::{ControlTask, Sample};
use firmware::link::{CommandRecord, Order};
use host_sim::closed_loop::{Drive, DriveError, HostController, RemoteController};
use host_sim::fault_campaign::{CASES, Case, Moment, Supervised, run_case};
use host_sim::rig::Rig;
use model_core::controller::Controller;
use model_core::paper;
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::time::{Duration, Instant};
use xtask::qemu::Machine;
use xtask::{image, qemu};

const PATIENCE: Duration = Duration::from_secs(20);

/// Two controllers that must agree; the second is the one in QEMU.
struct Both {
    host: HostController,
    firmware: RemoteController<TcpStream>,
    ticks: u32,
}

impl Drive for Both {
    fn command(&mut self, sample: &Sample) -> Result<CommandRecord, DriveError> {
        let expected = self.host.command(sample)?;
        let answer = self.firmware.command(sample)?;
        assert_eq!(bits(&answer), bits(&expected), "tick {}", sample.tick);
        self.ticks += 1;
        Ok(answer)
    }
}

impl Supervised for Both {
    fn order(&mut self, order: Order) -> Result<(), DriveError> {
        Supervised::order(&mut self.host, order)?;
        Supervised::order(&mut self.firmware, order)
    }
}

/// A command with its numbers as they are on the wire.
fn bits(command: &CommandRecord) -> (u32, u16, u8, u8, [u32; 4]) {
    (
        command.tick,
        command.valve.0,
        command.state,
        command.fault,
        command.estimate.map(f32::to_bits),
    )
}

fn connect(address: SocketAddr) -> TcpStream {
    let begin = Instant::now();
    loop {
        match TcpStream::connect(address) {
            Ok(stream) => {
                stream.set_nodelay(true).expect("no delay");
                stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
                return stream;
            }
            Err(error) => assert!(begin.elapsed() < PATIENCE, "QEMU does not listen: {error}"),
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn compare(image: &Path, rig: &Rig, case: &Case, moment: Moment) -> u32 {
    let (machine, address) = Machine::start(image, &[]).expect("QEMU starts");
    let mut both = Both {
        host: HostController::new(ControlTask::new(Controller::new(paper::axis()))),
        firmware: RemoteController::greet(connect(address)).expect("the firmware greets"),
        ticks: 0,
    };
    let outcome = run_case(rig, &mut both, case, moment, 1).expect("a sound run");
    let what = format!("{} {moment:?}: {outcome:?}", case.name);
    assert!(outcome.was_at_null && outcome.came_back, "{what}");
    assert!(outcome.fault.is_some() || case.needs_motion, "{what}");
    let stream = both.firmware.end().expect("the run ends");
    let status = machine.wait(PATIENCE).expect("it ends");
    drop(stream);
    assert!(status.success(), "{what}: {status}");
    both.ticks
}

/// Compares every so many cases, the moments in turn.
fn compare_every(step: usize) {
    if let Err(failure) = qemu::need_qemu() {
        assert!(std::env::var_os("CI").is_none(), "{failure}");
        println!("SKIPPED: faults in QEMU: {failure}");
        return;
    }
    let image = image::build(image::MPS2).expect("the image builds");
    let rig = include_str!("../../host-sim/rigs/paper.toml");
    let rig = Rig::parse(rig, "paper.toml").expect("a rig");
    let moments = Moment::ALL.iter().cycle();
    let ticks: u32 = CASES
        .iter()
        .step_by(step)
        .zip(moments)
        .map(|(case, moment)| compare(&image, &rig, case, *moment))
        .sum();
    assert!(ticks > 10_000, "{ticks} ticks");
}

#[test]
fn val_faults_in_qemu_are_those_of_the_host_to_the_byte() {
    compare_every(3);
}

#[test]
#[ignore = "minutes: all cases; run it with `--ignored`"]
fn val_all_faults_in_qemu_are_those_of_the_host_to_the_byte() {
    compare_every(1);
}
