//! Settings to a board: announce, send pieces, commit.

use std::time::{Duration, Instant};

use firmware::settings::record::Content;
use firmware::settings::transfer::{self, Kind, LONGEST_CHUNK, Verdict, read_answer};

use super::port::{Port, PortError};

/// Time for an answer to an announcement or a piece.
const ANSWER_WAIT: Duration = Duration::from_millis(300);
/// Time for the answer to the commit: building takes some milliseconds on the
/// board, storing some more.
const COMMIT_WAIT: Duration = Duration::from_secs(2);
const ATTEMPTS: usize = 5;

/// Why the board does not use the settings as wished; one line.
#[derive(Debug, thiserror::Error)]
pub enum SendError {
    /// The port failed.
    #[error(transparent)]
    Port(#[from] PortError),
    /// Silence.
    #[error(
        "the board does not answer ({ATTEMPTS} attempts): is it powered, is this its port, is its firmware running?"
    )]
    NoAnswer,
    /// The board says no.
    #[error("the board refused the settings: {}{}", .field, .verdict.explanation())]
    Refused {
        /// Why.
        verdict: Verdict,
        /// The number at fault and a colon, or nothing.
        field: String,
    },
    /// The board uses them, but will not after its next start.
    #[error("the settings are {}", .0.explanation())]
    NotKept(Verdict),
}

/// Whether settings outlast the next start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// Used and stored.
    Stored,
    /// Used until then.
    UntilStart,
}

impl Kept {
    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            Self::Stored => "in use and stored",
            Self::UntilStart => "in use until the next start",
        }
    }
}

/// Sends a content and has it used; tells how many bytes have arrived.
pub fn send(
    port: &mut Port,
    content: &Content,
    kept: Kept,
    mut arrived: impl FnMut(usize),
) -> Result<(), SendError> {
    exchange(port, &transfer::begin(content), Kind::Begin, 0, ANSWER_WAIT)?;
    let mut offset = 0;
    while let Some(chunk) = transfer::chunk(content, offset) {
        let end = content.len().min(offset + LONGEST_CHUNK);
        offset = exchange(port, &chunk, Kind::Chunk, end, ANSWER_WAIT)?;
        arrived(offset);
    }
    let (wish, kind) = match kept {
        Kept::Stored => (transfer::commit(), Kind::Commit),
        Kept::UntilStart => (transfer::try_out(), Kind::TryOut),
    };
    exchange(port, &wish, kind, content.len(), COMMIT_WAIT)?;
    Ok(())
}

/// Sends a frame until the board has taken it; returns how many bytes it has.
fn exchange(
    port: &mut Port,
    payload: &[u8],
    kind: Kind,
    bytes_then: usize,
    wait: Duration,
) -> Result<usize, SendError> {
    for _ in 0..ATTEMPTS {
        port.send(payload)?;
        if let Some(received) = answer(port, kind, bytes_then, Instant::now() + wait)? {
            return Ok(received);
        }
    }
    Err(SendError::NoAnswer)
}

/// The answer to a frame of this kind; late answers to earlier pieces and
/// frames about other things are passed over.
fn answer(
    port: &mut Port,
    kind: Kind,
    bytes_then: usize,
    until: Instant,
) -> Result<Option<usize>, SendError> {
    while let Some(payload) = port.receive(until)? {
        let Some(answer) = read_answer(&payload) else {
            continue;
        };
        if answer.kind != kind as u8 {
            continue;
        }
        match answer.verdict {
            Verdict::Taken if answer.received < bytes_then => {}
            Verdict::Taken => return Ok(Some(answer.received)),
            verdict @ (Verdict::InUseNotErased | Verdict::InUseNotStored) => {
                return Err(SendError::NotKept(verdict));
            }
            verdict => {
                let field = match answer.field {
                    "" => String::new(),
                    name => format!("{name}: "),
                };
                return Err(SendError::Refused { verdict, field });
            }
        }
    }
    Ok(None)
}
