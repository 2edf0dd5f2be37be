//! `pneuma scope`: a board's signals live, on a page of this machine.

use std::io::Write;
use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::channel;
use std::thread;

use clap::Args;

use super::CommandError;
use super::inputs::{bad_input, read_rig};
use super::stop::stop_wish;
use crate::board::port::BAUD;
use crate::board::recorder::check_signals;
use crate::scope::board::Talk;
use crate::scope::feed::Feed;
use crate::scope::server::{Site, hello, serve};
use crate::scope::udp;
use crate::settings::settings;
use crate::text::file_name;

/// Show a board's signals live in a browser, and turn its gains.
///
/// The page is on the loopback address only; its address, with a token, is the first line. Ends with
/// Ctrl-C.
#[derive(Args, Clone, Debug)]
pub struct ScopeArguments {
    /// The board's serial port, or HOST:PORT.
    #[arg(long, visible_alias = "connect")]
    pub serial: String,
    /// The rig file: gains, and the columns of recordings.
    #[arg(long)]
    pub rig: PathBuf,
    /// Where recordings are put.
    #[arg(long, default_value = ".")]
    pub folder: PathBuf,
    /// Show every N-th tick.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub decimate: u16,
    /// The port of the page; 0 takes a free one.
    #[arg(long, default_value_t = 0)]
    pub port: u16,
    /// Send the rows as JSON datagrams too, as PlotJuggler reads them.
    #[arg(long, value_name = "127.0.0.1:9870")]
    pub udp: Option<String>,
    /// Rate of the serial port.
    #[arg(long, default_value_t = BAUD)]
    pub baud: u32,
}

/// Time of a tick that a board has before it says so, s.
const USUAL_TICK_S: f64 = 1e-3;

/// Runs the command, writing to `out`.
///
/// # Errors
/// If the rig makes no settings or the page cannot be served.
pub fn run(arguments: &ScopeArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let rig = read_rig(&arguments.rig)?;
    let rig_name = file_name(&arguments.rig.display().to_string());
    settings(&rig).map_err(|error| bad_input(format!("{rig_name}: {error}")))?;
    check_signals(&rig, &rig_name).map_err(bad_input)?;
    if !arguments.folder.is_dir() {
        let folder = arguments.folder.display();
        return Err(bad_input(format!(
            "{folder}: is no folder, expected one for recordings"
        )));
    }
    let datagrams = arguments.udp.as_ref().map(|address| {
        udp::socket(address).map_err(|error| bad_input(format!("{address}: {error}")))
    });
    let datagrams = datagrams.transpose()?;
    let listener = TcpListener::bind(("127.0.0.1", arguments.port))
        .map_err(|error| bad_input(format!("port {}: {error}", arguments.port)))?;
    let host = listener.local_addr()?.to_string();
    let token = secret()?;
    let stopped = stop_wish()?;
    let feed = Arc::new(Feed::default());
    let (orders, wishes) = channel();
    let port = file_name(&arguments.serial);
    let site = Arc::new(Site {
        feed: Arc::clone(&feed),
        orders,
        hello: hello(&rig, &port, &secret()?, (USUAL_TICK_S, arguments.decimate)),
        token: token.clone(),
        host: host.clone(),
        stopped: Arc::clone(&stopped),
    });
    writeln!(out, "http://{host}/?token={token}")?;
    out.flush()?;
    let talk = Talk {
        serial: arguments.serial.clone(),
        baud: arguments.baud,
        decimation: arguments.decimate,
        rig,
        rig_name,
        folder: arguments.folder.clone(),
    };
    let served = thread::scope(|threads| {
        let (heard, ended) = (&feed, &stopped);
        threads.spawn(move || talk.run(heard, &wishes, ended));
        if let Some(socket) = &datagrams {
            threads.spawn(|| udp::run(socket, &feed, &stopped));
        }
        let served = serve(listener, site);
        stopped.store(true, Ordering::Relaxed);
        served
    });
    let losses = feed.losses();
    if losses.is_any() {
        writeln!(out, "{losses}")?;
    }
    Ok(served?)
}

/// A word that nobody guesses.
fn secret() -> Result<String, CommandError> {
    let mut bytes = [0_u8; 16];
    getrandom::fill(&mut bytes)
        .map_err(|error| bad_input(format!("no random numbers: {error}")))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}
