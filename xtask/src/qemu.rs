//! The firmware in QEMU's machine mps2-an386, its serial line on a socket.

use crate::image;
use crate::setup::{self, QEMU};
use crate::shell::{self, Outcome, as_typed, cargo, command};
use firmware::settings::{Settings, Wiring, record};
use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Where the image expects the first slot of settings, see the board's link.x.
const SETTINGS_ADDRESS: &str = "0x003F0000";
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// What was asked for.
#[derive(Debug, Default, PartialEq)]
struct Request {
    rig: Option<String>,
    serial: Option<String>,
    seconds: Option<u64>,
    unchecked: bool,
}

/// The task `qemu`: the firmware waits for a plant that connects.
pub fn run(options: &[String]) -> Outcome {
    let request = parse(options)?;
    let address: SocketAddr = request
        .serial
        .as_deref()
        .ok_or("qemu: where shall the plant connect? Say --serial 127.0.0.1:PORT")?
        .parse()
        .map_err(|error| format!("qemu: --serial wants an address like 127.0.0.1:7000: {error}"))?;
    need_qemu()?;
    let image = image::build(image::MPS2)?;
    let mut machine = machine(&image, address);
    match &request.rig {
        Some(rig) => load_settings(&mut machine, rig, request.unchecked)?,
        None if request.unchecked => {}
        None => _ = machine.args(with_settings(&checked_settings()?)),
    }
    println!("{}", as_typed(&machine));
    println!("qemu: waiting for a plant at {address}");
    match request.seconds {
        // In place of this program: whoever ends it ends QEMU.
        None => Err(format!("{QEMU} did not start: {}", machine.exec()).into()),
        Some(seconds) => run_for(machine, address, Duration::from_secs(seconds)),
    }
}

fn parse(options: &[String]) -> Outcome<Request> {
    let mut request = Request::default();
    let mut words = options.iter();
    while let Some(word) = words.next() {
        let mut value = || {
            let value = words.next().cloned();
            value.ok_or_else(|| format!("qemu: {word} wants a value"))
        };
        match word.as_str() {
            "--rig" => request.rig = Some(value()?),
            "--unchecked" => request.unchecked = true,
            "--serial" => request.serial = Some(value()?),
            "--seconds" => {
                let seconds = value()?;
                let number = seconds.parse();
                let wrong = |_| format!("qemu: --seconds wants a whole number, not {seconds}");
                request.seconds = Some(number.map_err(wrong)?);
            }
            other => return Err(format!("qemu: unknown option {other}").into()),
        }
    }
    Ok(request)
}

/// Fails where QEMU is not installed, and says what to do.
pub fn need_qemu() -> Outcome {
    if setup::has_qemu() {
        return Ok(());
    }
    Err(format!("{QEMU} is not installed: `cargo xtask setup` installs it").into())
}

/// QEMU with this image. An instruction takes a nanosecond of virtual time, which
/// does not sleep: only so is a run the same every time.
fn machine(image: &Path, serial: SocketAddr) -> Command {
    let mut machine = command(QEMU, &["-M", "mps2-an386", "-cpu", "cortex-m4"]);
    machine
        .args(["-icount", "shift=0,sleep=off", "-display", "none"])
        .args(["-monitor", "none", "-parallel", "none"])
        .args(["-semihosting-config", "enable=on,target=native"])
        .arg("-serial")
        .arg(format!("tcp:{serial},server=on,wait=on,nodelay=on"))
        .arg("-kernel")
        .arg(image);
    machine
}

/// Has QEMU put a rig's settings where the image looks for them.
fn load_settings(machine: &mut Command, rig: &str, is_unchecked: bool) -> Outcome {
    // The program runs in the root of the repository, the user perhaps elsewhere.
    let rig = Path::new(rig)
        .canonicalize()
        .map_err(|error| format!("{rig}: {error}"))?;
    let rig = rig.to_string_lossy();
    let directory = shell::target_directory().join(image::MPS2);
    fs::create_dir_all(&directory).map_err(|e| format!("{}: {e}", directory.display()))?;
    let settings = directory.join("settings.bin");
    let settings = settings.to_string_lossy();
    let mut words = vec!["run", "--release", "--quiet", "-p", "host-sim", "--"];
    words.extend(["settings", "--rig", &rig, "--out", &settings]);
    words.extend((!is_unchecked).then_some("--wiring-checked"));
    shell::run(&mut cargo(&words))?;
    machine.args(with_settings(&settings));
    Ok(())
}

/// A slot with the built-in settings, for an axis whose wiring was checked: as an image is
/// delivered it follows no reference.
pub fn checked_settings() -> Outcome<String> {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let settings = Settings {
        wiring: Wiring::Checked,
        ..Settings::built_in()
    };
    let record = record::encode(1, &settings).ok_or("settings: longer than any record")?;
    let directory = shell::target_directory().join("settings");
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let own = directory.join(format!("checked-{}-{number}.bin", std::process::id()));
    let file = directory.join("checked.bin");
    let write = || {
        fs::create_dir_all(&directory)?;
        fs::write(&own, &record)?;
        // Whoever reads it meanwhile finds a whole one.
        fs::rename(&own, &file)
    };
    write().map_err(|error| format!("{}: {error}", file.display()))?;
    Ok(file.to_string_lossy().into_owned())
}

/// What has QEMU load a file of settings.
pub fn with_settings(file: &str) -> [String; 2] {
    let device = format!("loader,file={file},addr={SETTINGS_ADDRESS},force-raw=on");
    ["-device".to_owned(), device]
}

fn run_for(mut machine: Command, address: SocketAddr, duration: Duration) -> Outcome {
    let child = machine.spawn();
    let child = child.map_err(|error| format!("{QEMU} did not start: {error}"))?;
    let status = Machine { child, address }.wait(duration)?;
    if status.success() {
        return Ok(());
    }
    Err(format!("the firmware ended with {status}").into())
}

/// A running machine; it ends with this value.
#[derive(Debug)]
pub struct Machine {
    child: Child,
    /// Where it waits for a plant.
    address: SocketAddr,
}

impl Machine {
    /// Starts an image that waits for a plant. `more` goes to QEMU as it is.
    pub fn start(image: &Path, more: &[String]) -> Outcome<Self> {
        need_qemu()?;
        let address = free_address().map_err(|error| format!("no free port: {error}"))?;
        let mut machine = machine(image, address);
        machine.args(more).stdin(Stdio::null());
        // It tells that it waits, and that nothing runs but the plant.
        machine.stdout(Stdio::null()).stderr(Stdio::null());
        let child = machine.spawn();
        let child = child.map_err(|error| format!("{QEMU} did not start: {error}"))?;
        Ok(Self { child, address })
    }

    /// The plant's end of the serial line, as soon as QEMU listens. A read on it
    /// takes as long at most.
    pub fn connect(&self, at_most: Duration) -> Outcome<TcpStream> {
        let begin = Instant::now();
        loop {
            match plug_in(self.address, at_most) {
                Ok(stream) => return Ok(stream),
                Err(error) if begin.elapsed() > at_most => {
                    return Err(format!("{QEMU} does not listen: {error}").into());
                }
                Err(_) => std::thread::sleep(LOOK_EVERY),
            }
        }
    }

    /// Waits for its end, at most for a while.
    pub fn wait(mut self, at_most: Duration) -> Outcome<ExitStatus> {
        let begin = Instant::now();
        loop {
            let status = self.child.try_wait();
            if let Some(status) = status.map_err(|error| format!("{QEMU}: {error}"))? {
                return Ok(status);
            }
            if begin.elapsed() > at_most {
                let waited = shell::in_words(at_most);
                return Err(format!("no plant ended the run within {waited}").into());
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        // Both fail only where it has ended already.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

fn plug_in(address: SocketAddr, at_most: Duration) -> io::Result<TcpStream> {
    let stream = TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(at_most))?;
    Ok(stream)
}

/// A free port, given out once: until QEMU listens there it is free for the system, which
/// may offer it again. Of two machines at one port one plant would be turned away.
fn free_address() -> io::Result<SocketAddr> {
    static GIVEN_OUT: Mutex<BTreeSet<u16>> = Mutex::new(BTreeSet::new());
    loop {
        let address = TcpListener::bind("127.0.0.1:0")?.local_addr()?;
        let mut given_out = GIVEN_OUT.lock().unwrap_or_else(PoisonError::into_inner);
        if given_out.insert(address.port()) {
            return Ok(address);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Vec<String> {
        line.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn options_are_read_and_wrong_ones_named() {
        let request = parse(&words("--serial 127.0.0.1:7000 --rig a.toml --seconds 3")).unwrap();
        assert_eq!(request.serial.as_deref(), Some("127.0.0.1:7000"));
        assert_eq!(
            (request.rig.as_deref(), request.seconds),
            (Some("a.toml"), Some(3))
        );
        let failure = |line: &str| parse(&words(line)).unwrap_err().to_string();
        assert_eq!(failure("--fast"), "qemu: unknown option --fast");
        assert_eq!(failure("--rig"), "qemu: --rig wants a value");
        assert!(failure("--seconds soon").contains("not soon"));
        let failure = run(&words("--serial here")).unwrap_err().to_string();
        assert!(failure.contains("127.0.0.1:7000"), "{failure}");
    }
}
