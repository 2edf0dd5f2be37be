//! The image that people flash, unchanged, in QEMU's netduinoplus2: a STM32F405
//! whose clocks never report ready, without DMA, DAC or a position converter. It
//! must start, find that out within its bounded waits, and say so.

use firmware::fault::Fault;
use firmware::frame::{Decoder, Received};
use firmware::start::ResetCause;
use firmware::status::Status;
use firmware::tick::State;
use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, Instant};
use xtask::{image, qemu};

/// Reports that must arrive: the supervisor runs on, not once.
const REPORTS: usize = 5;
/// Far more than the second that it takes here.
const PATIENCE: Duration = Duration::from_secs(60);

#[test]
fn val_the_flashed_image_starts_without_its_clocks_and_reports_that() {
    qemu::need_qemu().expect("QEMU runs this test");
    let image = image::build(image::STM32F405).expect("the image builds");
    let machine = Machine::start(image.as_os_str());
    let reports = machine.reports();
    for report in &reports {
        assert_eq!(report.state, State::Fault);
        let finding = report.finding.expect("a fault has its cause");
        assert_eq!(finding.fault, Fault::ClockFailed);
        assert_eq!(finding.detail, 0, "the crystal, before any PLL");
        assert_eq!(report.reset_cause, ResetCause::Unknown, "no flag is set");
    }
}

/// A running QEMU whose serial line is read; it ends with this value.
struct Machine {
    child: Child,
    bytes: Receiver<u8>,
}

impl Machine {
    fn start(image: &std::ffi::OsStr) -> Self {
        let mut child = Command::new("qemu-system-arm")
            .args(["-M", "netduinoplus2", "-icount", "shift=0,sleep=off"])
            .args(["-display", "none", "-monitor", "none", "-serial", "stdio"])
            .arg("-kernel")
            .arg(image)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("QEMU starts");
        let mut serial_line = child.stdout.take().expect("it is piped");
        let (sender, bytes) = mpsc::channel();
        thread::spawn(move || {
            let mut byte = [0];
            while serial_line.read_exact(&mut byte).is_ok() && sender.send(byte[0]).is_ok() {}
        });
        Self { child, bytes }
    }

    /// The first reports; whatever else arrives must be whole frames.
    fn reports(&self) -> Vec<Status> {
        let (mut decoder, mut reports) = (Decoder::new(), Vec::new());
        let begin = Instant::now();
        while reports.len() < REPORTS {
            let left = PATIENCE.saturating_sub(begin.elapsed());
            let byte = self.bytes.recv_timeout(left).unwrap_or_else(|error| {
                panic!("{} reports, then: {error}", reports.len());
            });
            match decoder.feed(byte) {
                Received::Nothing => {}
                Received::Payload(payload) => reports.extend(Status::read(payload)),
                Received::Dropped => panic!("a damaged frame after {} reports", reports.len()),
            }
        }
        reports
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        let _ended = self.child.kill();
        let _collected = self.child.wait();
    }
}
