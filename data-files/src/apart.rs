//! Reading in a process of its own, with limits of memory and time.
//!
//! A damaged file may claim lengths that no memory holds, and a library that believes it ends the
//! program. So the program that reads recordings names itself as the reader ([`read_apart`]): each
//! file is then read by a child of it that calls [`serve`]. Where no reader is named, as in a
//! library, files are read in the process at hand.

use std::io::{self, Read, Write};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;

use crate::{Kind, Outcome, read_here, said};

static READER: OnceLock<(PathBuf, &'static str)> = OnceLock::new();

/// Memory of a reader beside what its file needs, bytes.
const MEMORY_BYTES: u64 = 1 << 30;
/// Memory for each byte of a file: packed numbers grow on unpacking.
const MEMORY_PER_BYTE: u64 = 64;
/// Time of a reader beside what its file needs, s of a core.
const TIME_S: u64 = 20;
/// A slow format gives so many bytes in a second of a core.
const BYTES_PER_S: u64 = 2_000_000;

/// From now on files are read by this program, called with this argument; it has to [`serve`].
pub fn read_apart(program: PathBuf, argument: &'static str) {
    // Named twice, the first stays: there is one program.
    let _ = READER.set((program, argument));
}

/// Reads one file from `input`, its kind first, within limits, and writes what it holds to `output`.
///
/// # Errors
/// Where the pipes break.
pub fn serve(mut input: impl Read, mut output: impl Write) -> io::Result<()> {
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes)?;
    limit(bytes.len() as u64);
    let outcome: Outcome = match postcard::take_from_bytes::<Kind>(&bytes) {
        Ok((kind, file)) => read_here(kind, file),
        Err(cause) => Err(said(cause)),
    };
    let answer = postcard::to_stdvec(&outcome).map_err(io::Error::other)?;
    output.write_all(&answer)
}

#[cfg(unix)]
fn limit(size: u64) {
    use rlimit::Resource;
    let memory = MEMORY_BYTES.saturating_add(size.saturating_mul(MEMORY_PER_BYTE));
    let time_s = TIME_S + size / BYTES_PER_S;
    // A process may be limited below these already, which is as well.
    let _ = rlimit::setrlimit(Resource::AS, memory, memory);
    let _ = rlimit::setrlimit(Resource::CPU, time_s, time_s);
    let _ = rlimit::setrlimit(Resource::CORE, 0, 0);
}

#[cfg(not(unix))]
fn limit(_size: u64) {}

/// What a file holds, read by a child where the program named itself as the reader.
pub(crate) fn read(kind: Kind, bytes: &[u8]) -> Outcome {
    let Some((program, argument)) = READER.get() else {
        return read_here(kind, bytes);
    };
    let child = Command::new(program)
        .arg(argument)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let child = child.map_err(|cause| format!("its reader cannot be started: {cause}"))?;
    answer(child, kind, bytes)
}

fn answer(mut child: Child, kind: Kind, bytes: &[u8]) -> Outcome {
    if let Some(mut input) = child.stdin.take() {
        let kind = postcard::to_stdvec(&kind).map_err(said)?;
        // A reader that ended early is told by what it does not answer.
        let _ = input.write_all(&kind).and_then(|()| input.write_all(bytes));
    }
    let output = child.wait_with_output().map_err(said)?;
    let damaged = || "it is damaged, and claims more than memory or time allow".to_owned();
    let outcome = Some(output.stdout).filter(|_| output.status.success());
    let outcome: Outcome = postcard::from_bytes(&outcome.ok_or_else(damaged)?).map_err(said)?;
    outcome
}
