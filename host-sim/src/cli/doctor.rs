//! `pneuma doctor`: whether what commissioning stands on is there, before anything moves.

use super::CommandError;
use super::inputs::bad_input;
use crate::board::orders::{self, OrderError};
use crate::board::port::{BAUD, Port};
use crate::board::words;
use crate::check::Check;
use crate::rig::Rig;
use crate::settings::settings;
use crate::text::file_name;
use clap::Args;
use firmware::settings::Wiring;
use firmware::tick::State;
use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Look whether program, folder, rig file and board are fit for work. Nothing moves.
///
/// Exit status 0 if all is well, 2 if something stands in the way.
#[derive(Args, Clone, Debug)]
pub struct DoctorArguments {
    /// The rig file.
    #[arg(long)]
    pub rig: Option<PathBuf>,
    /// The board's serial port, or HOST:PORT; without it the ports that are there are listed.
    #[arg(long)]
    pub serial: Option<String>,
    /// Rate of the serial port.
    #[arg(long, default_value_t = BAUD)]
    pub baud: u32,
    /// Where results are to go.
    #[arg(long, default_value = ".")]
    pub folder: PathBuf,
}

/// What was looked at, and what was found.
struct Look {
    what: &'static str,
    found: Found,
    said: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Found {
    Well,
    /// It works, and had better be known.
    Note,
    /// It stands in the way.
    Wrong,
}

impl fmt::Display for Look {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mark = match self.found {
            Found::Well => "ok   ",
            Found::Note => "note ",
            Found::Wrong => "WRONG",
        };
        write!(out, "{mark}  {:9} {}", self.what, self.said)
    }
}

fn look(what: &'static str, found: Found, said: impl Into<String>) -> Look {
    let said = said.into();
    Look { what, found, said }
}

/// Runs the command, writing to `out`.
///
/// # Errors
/// If something stands in the way.
pub fn run(arguments: &DoctorArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let mut wrong = 0;
    let mut tell = |look: Look| {
        wrong += usize::from(look.found == Found::Wrong);
        writeln!(out, "{look}").and_then(|()| out.flush())
    };
    tell(program())?;
    tell(clock())?;
    tell(folder(&arguments.folder))?;
    if let Some(path) = &arguments.rig {
        for one in rig(path) {
            tell(one)?;
        }
    }
    match &arguments.serial {
        None => tell(ports())?,
        Some(serial) => {
            for one in board(serial, arguments.baud) {
                tell(one)?;
            }
        }
    }
    match wrong {
        0 => Ok(()),
        1 => Err(bad_input("one thing stands in the way, see the line above")),
        many => Err(bad_input(format!(
            "{many} things stand in the way, see the lines above"
        ))),
    }
}

fn program() -> Look {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let said = format!("pneuma {}, {cores} cores", env!("CARGO_PKG_VERSION"));
    if cfg!(debug_assertions) {
        return look(
            "program",
            Found::Note,
            said + "; built for development: --release is several times faster",
        );
    }
    look("program", Found::Well, said)
}

/// Sheets and recordings are dated: a board computer without a battery begins in 1970.
fn clock() -> Look {
    const YEAR_2025_S: u64 = 1_735_689_600;
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let now = jiff::Timestamp::now();
    if since.is_ok_and(|since| since.as_secs() > YEAR_2025_S) {
        return look("clock", Found::Well, format!("{now:.0}"));
    }
    look(
        "clock",
        Found::Note,
        format!("{now:.0}: results will bear a wrong date, set the clock"),
    )
}

fn folder(path: &Path) -> Look {
    let shown = file_name(&path.display().to_string());
    let written = tempfile::NamedTempFile::new_in(path).and_then(|mut file| {
        file.write_all(&[0; 1 << 16])
            .and_then(|()| file.as_file().sync_all())
    });
    match written {
        Ok(()) => look("folder", Found::Well, format!("{shown}: can be written to")),
        Err(error) => look(
            "folder",
            Found::Wrong,
            format!("{shown}: {error}, expected a folder that can be written to"),
        ),
    }
}

fn rig(path: &Path) -> Vec<Look> {
    let shown = file_name(&path.display().to_string());
    let (rig, faults) = match Rig::read_faults(path) {
        Ok(read) => read,
        Err(error) => return vec![look("rig", Found::Wrong, error.to_string())],
    };
    let check = Check::of_rig(&shown, &rig, &faults);
    if let Some(first) = check.rig_faults.first() {
        let more = check.rig_faults.len() - 1;
        let said = format!("{first}; {more} more: pneuma check --rig {shown}");
        return vec![look("rig", Found::Wrong, said)];
    }
    let mut looks = vec![look(
        "rig",
        Found::Well,
        format!("{shown}: a rig file, {} laws", check.laws.len()),
    )];
    looks.extend(
        check
            .unusual
            .iter()
            .map(|one| look("rig", Found::Note, one.as_str())),
    );
    if !check.exact.is_empty() {
        let said = format!(
            "{} numbers have no [uncertainty] and count as exact: a wrong one looks like missing physics",
            check.exact.len()
        );
        looks.push(look("rig", Found::Note, said));
    }
    looks.push(match settings(&rig) {
        Ok(_) => look(
            "settings",
            Found::Well,
            "the rig file makes a board's settings",
        ),
        Err(error) => look("settings", Found::Wrong, format!("{shown}: {error}")),
    });
    looks
}

fn ports() -> Look {
    let found = match serialport::available_ports() {
        Ok(found) => found,
        Err(error) => return look("ports", Found::Note, format!("cannot be listed: {error}")),
    };
    if found.is_empty() {
        let said = "no serial port is there: plug the board in, or name it with --serial";
        return look("ports", Found::Note, said);
    }
    let names: Vec<String> = found
        .into_iter()
        .map(|port| file_name(&port.port_name))
        .collect();
    look(
        "ports",
        Found::Well,
        format!("{}; --serial looks at the board there", names.join(", ")),
    )
}

fn board(serial: &str, baud: u32) -> Vec<Look> {
    let mut port = match Port::open(serial, baud) {
        Ok(port) => port,
        Err(error) => {
            let remedy =
                "; plugged in, used by no other program, and yours to open (group dialout)?";
            return vec![look("port", Found::Wrong, error.to_string() + remedy)];
        }
    };
    let mut looks = vec![look(
        "port",
        Found::Well,
        format!("{}: open", file_name(serial)),
    )];
    match answers(&mut port) {
        Ok(more) => looks.extend(more),
        Err(error) => looks.push(look(
            "board",
            Found::Wrong,
            format!("{error}; powered, {baud} baud, RX and TX crossed?"),
        )),
    }
    looks
}

fn answers(port: &mut Port) -> Result<Vec<Look>, OrderError> {
    let status = orders::status(port)?;
    let program =
        words::program(&status).unwrap_or_else(|| "firmware of an unknown version".into());
    let mut looks = vec![look("board", Found::Well, program)];
    looks.push(if status.state == State::Fault {
        let line = status.finding.map(words::fault_line).unwrap_or_default();
        look(
            "state",
            Found::Wrong,
            format!("{line}; then `pneuma board acknowledge`"),
        )
    } else {
        look("state", Found::Well, words::state(status.state))
    });
    if status.has_built_in_settings {
        looks.push(look(
            "settings",
            Found::Note,
            "the board's are built in: send those of a rig with `pneuma settings`",
        ));
    }
    if status.wiring == Wiring::Unchecked {
        looks.push(look(
            "wiring",
            Found::Note,
            "unchecked: `pneuma board check-wiring` before anything moves",
        ));
    }
    if let Some(crash) = orders::last_crash(port)? {
        looks.push(look("crash", Found::Note, words::crash_line(&crash)));
    }
    looks.push(line_quality(port)?);
    Ok(looks)
}

/// A second of signs of life: how much of what the board sends arrives.
fn line_quality(port: &mut Port) -> Result<Look, OrderError> {
    let (damaged, mut answered) = (port.damaged(), 0_u32);
    let until = Instant::now() + Duration::from_secs(1);
    let mut slowest = Duration::ZERO;
    while Instant::now() < until {
        let asked = Instant::now();
        orders::status(port)?;
        slowest = slowest.max(asked.elapsed());
        answered += 1;
    }
    let damaged = port.damaged() - damaged;
    let said = format!(
        "{answered} questions answered in a second, the slowest in {} ms, {damaged} frames damaged",
        slowest.as_millis()
    );
    if damaged > 0 {
        return Ok(look(
            "line",
            Found::Wrong,
            said + ": a shorter cable, a common ground, a lower baud",
        ));
    }
    Ok(look("line", Found::Well, said))
}
