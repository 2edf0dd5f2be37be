//! Frames over a byte stream: a socket, a serial port, a file.
//!
//! One reader for all of them. A stream that has nothing to say within its own
//! read timeout is an error to [`Wire::receive`], which waits for ever, and
//! none to [`Wire::receive_until`], which has a time limit of its own; the
//! stream's timeout bounds how late that limit is seen.

use firmware::frame::{Decoder, Frame, Received, encode};
use firmware::link::Payload;
use std::io::{self, Read, Write};
use std::time::Instant;

const READ_BYTES: usize = 4096;

/// Frames over a byte stream.
pub struct Wire<S> {
    stream: S,
    decoder: Decoder,
    bytes: Box<[u8; READ_BYTES]>,
    next: usize,
    end: usize,
}

/// What came within a time limit.
#[derive(Clone, Debug, PartialEq, Eq)]
#[expect(
    clippy::large_enum_variant,
    reason = "it lives as long as a match; a box for each frame would cost more"
)]
pub enum Heard {
    /// A sound payload.
    Payload(Payload),
    /// Nothing until then.
    Nothing,
    /// The other side has hung up.
    End,
}

/// Bytes read: some, none yet, or no more.
enum Filled {
    Some,
    NotYet(io::Error),
    End,
}

impl<S> Wire<S> {
    /// A wire on which nothing has been sent.
    pub fn new(stream: S) -> Self {
        Self {
            stream,
            decoder: Decoder::new(),
            bytes: Box::new([0; READ_BYTES]),
            next: 0,
            end: 0,
        }
    }

    /// Frames dropped so far, damaged on the way.
    pub fn dropped(&self) -> u32 {
        self.decoder.dropped()
    }

    /// The stream, given back; bytes that were read and not asked for are lost.
    pub fn into_stream(self) -> S {
        self.stream
    }

    /// The next sound payload among the bytes that are here.
    fn decode(&mut self) -> Option<Payload> {
        while let Some(byte) = self.bytes[..self.end].get(self.next) {
            self.next += 1;
            if let Received::Payload(payload) = self.decoder.feed(*byte)
                && let Ok(payload) = Payload::from_slice(payload)
            {
                return Some(payload);
            }
        }
        None
    }
}

impl<S: Read> Wire<S> {
    /// The next sound payload; `None` at the end of the stream.
    pub fn receive(&mut self) -> io::Result<Option<Payload>> {
        loop {
            if let Some(payload) = self.decode() {
                return Ok(Some(payload));
            }
            match self.fill()? {
                Filled::Some => {}
                Filled::NotYet(error) => return Err(error),
                Filled::End => return Ok(None),
            }
        }
    }

    /// What comes until then; a payload that is here already in any case.
    pub fn receive_until(&mut self, until: Instant) -> io::Result<Heard> {
        loop {
            if let Some(payload) = self.decode() {
                return Ok(Heard::Payload(payload));
            }
            if Instant::now() >= until {
                return Ok(Heard::Nothing);
            }
            if matches!(self.fill()?, Filled::End) {
                return Ok(Heard::End);
            }
        }
    }

    fn fill(&mut self) -> io::Result<Filled> {
        self.next = 0;
        self.end = 0;
        loop {
            match self.stream.read(&mut self.bytes[..]) {
                Ok(0) => return Ok(Filled::End),
                Ok(count) => {
                    self.end = count;
                    return Ok(Filled::Some);
                }
                Err(error) => match error.kind() {
                    io::ErrorKind::Interrupted => {}
                    io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
                        return Ok(Filled::NotYet(error));
                    }
                    _ => return Err(error),
                },
            }
        }
    }
}

impl<S: Write> Wire<S> {
    /// Sends a payload.
    pub fn send(&mut self, payload: &[u8]) -> io::Result<()> {
        self.stream.write_all(&framed(payload)?)?;
        self.stream.flush()
    }
}

/// A payload as it goes onto the wire.
pub fn framed(payload: &[u8]) -> io::Result<Frame> {
    let too_long = || io::Error::other("a payload longer than any frame");
    encode(payload).ok_or_else(too_long)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;
    use std::time::Duration;

    /// What reading gives, piece by piece; behind the last piece the end.
    struct Pieces(VecDeque<io::Result<Vec<u8>>>);

    impl Read for Pieces {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            let Some(piece) = self.0.pop_front() else {
                return Ok(0);
            };
            let piece = piece?;
            bytes[..piece.len()].copy_from_slice(&piece);
            Ok(piece.len())
        }
    }

    fn pieces() -> Wire<Pieces> {
        let frame = framed(&[1, 0, 2]).expect("it fits").to_vec();
        let (head, tail) = frame.split_at(3);
        let mut damaged = frame.clone();
        damaged[2] ^= 1;
        let nothing = || Err(io::ErrorKind::WouldBlock.into());
        Wire::new(Pieces(VecDeque::from([
            nothing(),
            Ok(head.to_vec()),
            Err(io::ErrorKind::Interrupted.into()),
            nothing(),
            Ok([tail, &damaged, &frame].concat()),
            nothing(),
        ])))
    }

    #[test]
    fn prop_within_a_time_limit_pauses_are_borne_and_the_end_is_told() {
        let mut wire = pieces();
        let soon = Instant::now() + Duration::from_secs(60);
        for _ in 0..2 {
            let heard = wire.receive_until(soon).expect("it reads");
            let expected = Payload::from_slice(&[1, 0, 2]).expect("it fits");
            assert_eq!(heard, Heard::Payload(expected));
        }
        assert_eq!(wire.dropped(), 1);
        assert_eq!(wire.receive_until(soon).expect("it reads"), Heard::End);
        let mut wire = pieces();
        let heard = wire.receive_until(Instant::now()).expect("it reads");
        assert_eq!(heard, Heard::Nothing, "the limit is over");
    }

    #[test]
    fn prop_without_a_limit_a_pause_of_the_stream_is_an_error() {
        let mut wire = pieces();
        let error = wire.receive().expect_err("nothing came");
        assert_eq!(error.kind(), io::ErrorKind::WouldBlock);
    }
}
