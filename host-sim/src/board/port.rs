//! Frames to and from a board: over a serial port, or TCP to one in QEMU.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use firmware::link::Payload;

use crate::wire::{Heard, Wire};

/// The board's rate on USART1.
pub const BAUD: u32 = 921_600;
/// How long one reading waits: it bounds how late a time limit is seen.
const READ_WAIT: Duration = Duration::from_millis(20);
const CONNECT_WAIT: Duration = Duration::from_secs(5);

/// Why nothing can be said or heard any more; one line.
#[derive(Debug, thiserror::Error)]
pub enum PortError {
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

/// Sees payloads as they come.
type Watcher = Box<dyn FnMut(&Payload)>;

/// Where a board is reached.
pub struct Port {
    name: String,
    wire: Wire<Box<dyn Stream>>,
    /// Sees whatever comes, whoever waits for it.
    watcher: Option<Watcher>,
}

impl Port {
    /// Opens `HOST:PORT` or else a serial port at this rate.
    pub fn open(name: &str, baud: u32) -> Result<Self, PortError> {
        let fault = |cause: String| PortError::Open {
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
            wire: Wire::new(stream),
            watcher: None,
        })
    }

    /// From now on `watcher` sees every payload that comes, before who waits for it: ticks go on
    /// while an answer is waited for.
    pub fn watch(&mut self, watcher: impl FnMut(&Payload) + 'static) {
        self.watcher = Some(Box::new(watcher));
    }

    /// Frames so far that were damaged on the way.
    pub fn damaged(&self) -> u32 {
        self.wire.dropped()
    }

    /// Sends a payload.
    pub fn send(&mut self, payload: &[u8]) -> Result<(), PortError> {
        let sent = self.wire.send(payload);
        sent.map_err(|cause| self.broken(cause))
    }

    /// The next payload; `None` if there is none until then.
    pub fn receive(&mut self, until: Instant) -> Result<Option<Payload>, PortError> {
        match self.wire.receive_until(until) {
            Ok(Heard::Payload(payload)) => {
                if let Some(watcher) = &mut self.watcher {
                    watcher(&payload);
                }
                Ok(Some(payload))
            }
            Ok(Heard::Nothing) => Ok(None),
            Ok(Heard::End) => Err(PortError::Closed(self.name.clone())),
            Err(cause) => Err(self.broken(cause)),
        }
    }

    fn broken(&self, cause: io::Error) -> PortError {
        PortError::Broken {
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
        let Err(error) = Port::open("/dev/no-such-port", BAUD) else {
            panic!("there is no such port");
        };
        let line = error.to_string();
        assert!(line.starts_with("/dev/no-such-port: cannot be opened"));
        assert!(!line.contains('\n'));
    }
}
