//! Rows as JSON datagrams: what PlotJuggler's UDP server reads ("JSON", time from the field `t`).

use super::feed::Feed;
use super::signals::SIGNALS;
use serde_json::{Map, Value, json};
use std::io;
use std::net::{ToSocketAddrs, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// From one look for rows to the next.
const EVERY: Duration = Duration::from_millis(20);
/// Rows taken in one look.
const MOST_ROWS: usize = 1_000;

/// A socket for an address, which is of this machine.
///
/// # Errors
/// Where the address is none, or of another machine.
pub fn socket(address: &str) -> io::Result<UdpSocket> {
    let invalid = |why: String| io::Error::new(io::ErrorKind::InvalidInput, why);
    let place = address.to_socket_addrs()?.next();
    let place = place.ok_or_else(|| invalid("there is no such address".into()))?;
    if !place.ip().is_loopback() {
        let why = format!("{} is another machine, expected 127.0.0.1:PORT", place.ip());
        return Err(invalid(why));
    }
    let socket = UdpSocket::bind(("127.0.0.1", 0))?;
    socket.connect(place)?;
    Ok(socket)
}

/// Sends every row until it is stopped. Nobody need listen.
pub fn run(socket: &UdpSocket, feed: &Feed, stopped: &AtomicBool) {
    let mut place = feed.end();
    while !stopped.load(Ordering::Relaxed) {
        let (rows, after) = feed.rows_from(place, MOST_ROWS);
        place = after;
        let tick_s = feed
            .streaming()
            .map_or(1e-3, |streaming| streaming.tick_s());
        for (tick, values) in &rows {
            let mut fields = Map::from_iter([("t".to_owned(), json!(f64::from(*tick) * tick_s))]);
            for (signal, value) in SIGNALS.iter().zip(values) {
                // A reference that asks for nothing is no number, and no field.
                if value.is_finite() {
                    fields.insert(signal.name.replace(' ', "_"), json!(value));
                }
            }
            let _ = socket.send(Value::Object(fields).to_string().as_bytes());
        }
        if rows.len() < MOST_ROWS {
            std::thread::sleep(EVERY);
        }
    }
}
