//! Frames over a serial port or a TCP connection.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use firmware::frame::{Decoder, Received, encode};

/// The board's rate on USART1.
pub const BAUD: u32 = 921_600;
/// How long one reading waits: it bounds how late a time limit is seen.
const READ_WAIT: Duration = Duration::from_millis(20);
const CONNECT_WAIT: Duration = Duration::from_secs(5);
const READ_BYTES: usize = 4096;

/// Why nothing can be said or heard any more; one line.
#[derive(Debug, thiserror::Error)]
pub enum WireError {
    /// The port or the connection could not be opened.
    #[error(
        "{name}: cannot be opened: {cause}, expected a serial port such as /dev/ttyUSB0 or an address such as 127.0.0.1:5555"
    )]
    Open {
        /// As the caller named it.
        name: String,
        /// What the system says.
        cause: String,
    },
    /// The other side hung up.
    #[error("{0}: the connection was closed by the other side")]
    Closed(String),
    /// Reading or writing failed.
    #[error("{name}: {cause}")]
    Broken {
        /// As the caller named it.
        name: String,
        /// What the system says.
        cause: String,
    },
}

trait Stream: Read + Write {}
impl<T: Read + Write> Stream for T {}

/// A wire to a board.
pub struct Wire {
    name: String,
    stream: Box<dyn Stream>,
    decoder: Decoder,
    waiting: VecDeque<Vec<u8>>,
}

impl Wire {
    /// Opens `HOST:PORT` or else a serial port at this rate.
    pub fn open(name: &str, baud: u32) -> Result<Self, WireError> {
        let fault = |cause: String| WireError::Open {
            name: name.into(),
            cause,
        };
        let stream: Box<dyn Stream> = if is_address(name) {
            Box::new(connect(name).map_err(|cause| fault(cause.to_string()))?)
        } else {
            let port = serialport::new(name, baud).timeout(READ_WAIT);
            Box::new(port.open().map_err(|cause| fault(cause.to_string()))?)
        };
        Ok(Self {
            name: name.into(),
            stream,
            decoder: Decoder::new(),
            waiting: VecDeque::new(),
        })
    }

    /// Frames so far that were damaged on the way.
    pub fn damaged(&self) -> u32 {
        self.decoder.dropped()
    }

    /// Sends a payload.
    pub fn send(&mut self, payload: &[u8]) -> Result<(), WireError> {
        let frame = encode(payload).ok_or_else(|| self.broken("the payload is too long"))?;
        let sent = self.stream.write_all(&frame);
        sent.and_then(|()| self.stream.flush())
            .map_err(|cause| self.broken(cause))
    }

    /// The next payload; `None` if there is none until then.
    pub fn receive(&mut self, until: Instant) -> Result<Option<Vec<u8>>, WireError> {
        loop {
            if let Some(payload) = self.waiting.pop_front() {
                return Ok(Some(payload));
            }
            if Instant::now() >= until {
                return Ok(None);
            }
            self.read_some()?;
        }
    }

    fn read_some(&mut self) -> Result<(), WireError> {
        let mut bytes = [0; READ_BYTES];
        let count = match self.stream.read(&mut bytes) {
            Ok(0) => return Err(WireError::Closed(self.name.clone())),
            Ok(count) => count,
            Err(cause) if is_no_news(&cause) => return Ok(()),
            Err(cause) => return Err(self.broken(cause)),
        };
        for byte in bytes.iter().take(count) {
            if let Received::Payload(payload) = self.decoder.feed(*byte) {
                self.waiting.push_back(payload.to_vec());
            }
        }
        Ok(())
    }

    fn broken(&self, cause: impl ToString) -> WireError {
        WireError::Broken {
            name: self.name.clone(),
            cause: cause.to_string(),
        }
    }
}

/// `HOST:PORT`; a path or a name such as COM3 is a serial port.
fn is_address(name: &str) -> bool {
    let port = name.rsplit_once(':').map(|(_, port)| port);
    !name.starts_with('/') && port.is_some_and(|port| port.parse::<u16>().is_ok())
}

fn connect(address: &str) -> io::Result<TcpStream> {
    let begun = Instant::now();
    let stream = loop {
        match TcpStream::connect(address) {
            Ok(stream) => break stream,
            // QEMU may be started together with this program.
            Err(cause)
                if cause.kind() == io::ErrorKind::ConnectionRefused
                    && begun.elapsed() < CONNECT_WAIT =>
            {
                std::thread::sleep(READ_WAIT);
            }
            Err(cause) => return Err(cause),
        }
    };
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(READ_WAIT))?;
    Ok(stream)
}

fn is_no_news(cause: &io::Error) -> bool {
    matches!(
        cause.kind(),
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_addresses_are_told_from_ports() {
        for address in ["127.0.0.1:5555", "localhost:1", "[::1]:80"] {
            assert!(is_address(address), "{address}");
        }
        for port in ["/dev/ttyUSB0", "COM3", "/dev/serial/by-path/usb-0:1"] {
            assert!(!is_address(port), "{port}");
        }
    }

    #[test]
    fn prop_a_port_that_is_not_there_is_one_line() {
        let Err(error) = Wire::open("/dev/no-such-port", BAUD) else {
            panic!("there is no such port");
        };
        let line = error.to_string();
        assert!(line.starts_with("/dev/no-such-port: cannot be opened"));
        assert!(!line.contains('\n'));
    }
}
