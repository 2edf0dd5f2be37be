//! The one that talks to the board.

use super::feed::Feed;
use crate::board::orders::{self, begin_stream};
use crate::board::port::{Port, PortError};
use crate::board::recorder::Recorder;
use crate::board::send::{Kept, send};
use crate::converted;
use crate::output::Pending;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::settings::{settings, wired};
use crate::text::file_name;
use data_files::Target;
use firmware::link;
use firmware::settings::record::encode_content;
use firmware::status::Status;
use firmware::telemetry::{read_tick, stream};
use model_core::reference::Reference;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// How often orders are looked for.
const GLANCE: Duration = Duration::from_millis(20);
/// How often the board is asked how it is.
const STATUS_EVERY: Duration = Duration::from_millis(500);
/// A board that streams and is silent for so long is gone.
const SILENCE: Duration = Duration::from_secs(3);
/// From one attempt to find it again to the next.
const AGAIN: Duration = Duration::from_secs(1);

/// What a page wishes.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(tag = "do", rename_all = "kebab-case")]
pub enum Order {
    /// Send the load to a place, mm.
    Move {
        /// Where to.
        to_mm: f64,
    },
    /// Let go: the valve to its null.
    Stop,
    /// Leave the fault.
    Acknowledge,
    /// A gain, until the next start.
    Gain {
        /// Its key in the rig's `[controller]`.
        key: String,
        /// Its value.
        value: f64,
    },
    /// The settings as they are, for good.
    Store,
    /// Begin or end a recording.
    Record {
        /// Begin.
        on: bool,
        /// What is recorded is written as MCAP too, once it ends.
        #[serde(default)]
        mcap: bool,
    },
}

/// What is needed to talk to a board.
pub struct Talk {
    /// Its port.
    pub serial: String,
    /// Rate of the port.
    pub baud: u32,
    /// Every so many-th tick is asked for.
    pub decimation: u16,
    /// The rig, whose gains change.
    pub rig: Rig,
    /// What error lines call it.
    pub rig_name: String,
    /// Where recordings go.
    pub folder: PathBuf,
}

impl Talk {
    /// Talks until it is stopped; a board that goes away is looked for again.
    pub fn run(mut self, feed: &Arc<Feed>, orders: &Receiver<Order>, stopped: &AtomicBool) {
        feed.set_gains(self.gains());
        let mut said = String::new();
        while !stopped.load(Ordering::Relaxed) {
            let Err(error) = self.talk(feed, orders, stopped) else {
                break;
            };
            // The same words once, however often it is tried.
            let why = error.to_string();
            if why != said {
                feed.gone(&why);
                said = why;
            }
            for refused in orders.try_iter() {
                feed.note(format!("{}: there is no board", words(&refused)), true);
            }
            std::thread::sleep(AGAIN);
        }
        feed.end_recording();
        pack(&feed.take_to_pack(), &self.rig, feed);
    }

    fn talk(
        &mut self,
        feed: &Arc<Feed>,
        orders: &Receiver<Order>,
        stopped: &AtomicBool,
    ) -> Result<(), orders::OrderError> {
        let mut port = Port::open(&self.serial, self.baud)?;
        let heard = Arc::clone(feed);
        port.watch(move |payload| {
            if let Some(tick) = read_tick(payload) {
                heard.take(&tick);
            } else if let Some(status) = Status::read(payload) {
                heard.report(&status);
            }
        });
        feed.begin(begin_stream(&mut port, self.decimation)?);
        feed.note(format!("connected to {}", self.serial), false);
        let mut heard_at = (Instant::now(), feed.end());
        let mut asked_at: Option<Instant> = None;
        while !stopped.load(Ordering::Relaxed) {
            if asked_at.is_none_or(|at| at.elapsed() > STATUS_EVERY) {
                port.send(&link::ask_status())?;
                asked_at = Some(Instant::now());
            }
            if let Ok(order) = orders.try_recv() {
                self.obey(&mut port, &order, feed)?;
            }
            pump(&mut port)?;
            let waiting = feed.take_to_pack();
            if !waiting.is_empty() {
                // A long recording takes seconds, in which ticks come.
                let (rig, feed) = (self.rig.clone(), Arc::clone(feed));
                std::thread::spawn(move || pack(&waiting, &rig, &feed));
            }
            if feed.end() != heard_at.1 {
                heard_at = (Instant::now(), feed.end());
            } else if heard_at.0.elapsed() > SILENCE {
                return Err(orders::OrderError::NoTicks);
            }
        }
        port.send(&stream(0))?;
        Ok(())
    }

    /// Does what a page wishes; an error is the port's, everything else is said.
    fn obey(
        &mut self,
        port: &mut Port,
        order: &Order,
        feed: &Feed,
    ) -> Result<(), orders::OrderError> {
        let what = words(order);
        let done = match order {
            Order::Move { to_mm } => go(port, *to_mm),
            Order::Stop => orders::stop(port).map(drop).map_err(said),
            Order::Acknowledge => orders::acknowledge(port).map(drop).map_err(said),
            Order::Gain { key, value } => self.set_gain(port, (key, *value), feed),
            Order::Store => self.send(port, Kept::Stored),
            Order::Record { on: true, mcap } => self.record(*mcap, feed),
            Order::Record { on: false, .. } => {
                feed.end_recording();
                Ok(())
            }
        };
        match done {
            Ok(()) => feed.note(what, false),
            Err(Failed::Port(error)) => return Err(error.into()),
            Err(Failed::Refused(why)) => feed.note(format!("{what}: {why}"), true),
        }
        Ok(())
    }

    /// The gains as the rig has them, those that it does not state at their standard values.
    fn gains(&self) -> BTreeMap<String, f64> {
        let Ok(settings) = settings(&self.rig) else {
            return BTreeMap::new();
        };
        let fields = settings.controller.fields();
        fields
            .map(|field| (bare(field.name).to_owned(), shortest(field.value)))
            .collect()
    }

    fn set_gain(
        &mut self,
        port: &mut Port,
        (key, value): (&str, f64),
        feed: &Feed,
    ) -> Result<(), Failed> {
        let before = self.rig.controller.insert(key.to_owned(), value);
        let sent = self.send(port, Kept::UntilStart);
        if sent.is_err() {
            match before {
                Some(before) => self.rig.controller.insert(key.to_owned(), before),
                None => self.rig.controller.remove(key),
            };
        }
        feed.set_gains(self.gains());
        sent
    }

    fn send(&self, port: &mut Port, kept: Kept) -> Result<(), Failed> {
        let refused = |why: String| Failed::Refused(why);
        let status = orders::status(port).map_err(|error| refused(error.to_string()))?;
        // Gains change nothing of the wiring.
        let settings =
            wired(&self.rig, status.wiring).map_err(|error| refused(error.to_string()))?;
        let content = encode_content(&settings)
            .ok_or_else(|| refused("the settings are longer than any record".into()))?;
        send(port, &content, kept, |_| {}).map_err(|error| match error {
            crate::board::send::SendError::Port(error) => Failed::Port(error),
            other => refused(other.to_string()),
        })
    }

    fn record(&self, as_mcap: bool, feed: &Feed) -> Result<(), Failed> {
        if feed.is_recording() {
            return Err(Failed::Refused("a recording is under way".into()));
        }
        let streaming = feed.streaming();
        let streaming =
            streaming.ok_or_else(|| Failed::Refused("the board does not stream".into()))?;
        let refused = |error: &dyn ToString| Failed::Refused(error.to_string());
        let name = jiff::Timestamp::now()
            .strftime("scope-%Y%m%dT%H%M%SZ.csv")
            .to_string();
        let path = self.folder.join(name);
        let pending = Pending::create(&path).map_err(|error| refused(&error))?;
        let recorder = Recorder::new(pending, &self.rig, &self.rig_name, streaming);
        let recorder = recorder.map_err(|error| refused(&error))?;
        feed.record(recorder, path, as_mcap);
        Ok(())
    }
}

/// Writes recordings that stand as MCAP beside them.
fn pack(recordings: &[PathBuf], rig: &Rig, feed: &Feed) {
    for path in recordings {
        let packed = path.with_extension("mcap");
        let name = file_name(&packed.display().to_string());
        let read = Recording::read(path, &rig.signals).map_err(|error| error.to_string());
        let written =
            read.and_then(|one| converted::write(&one, rig, (&packed, Some(Target::Mcap))));
        match written {
            Ok(_) => feed.note(format!("{name}: written beside it"), false),
            Err(why) => feed.note(format!("{name}: {why}"), true),
        }
    }
}

/// Why an order was not carried out.
enum Failed {
    /// The port broke.
    Port(PortError),
    /// The board, or this program, says no.
    Refused(String),
}

fn said(error: orders::OrderError) -> Failed {
    match error {
        orders::OrderError::Port(error) => Failed::Port(error),
        other => Failed::Refused(other.to_string()),
    }
}

/// Takes what comes until the next glance.
fn pump(port: &mut Port) -> Result<(), PortError> {
    let until = Instant::now() + GLANCE;
    while port.receive(until)?.is_some() {
        if Instant::now() > until {
            break;
        }
    }
    Ok(())
}

/// Sends the load to a place; that it has taken the set-point shows in its ticks.
fn go(port: &mut Port, to_mm: f64) -> Result<(), Failed> {
    let to_m = 1e-3 * to_mm;
    orders::within_reach(to_m).map_err(said)?;
    orders::ready(port).map_err(said)?;
    let set_point = Reference::at(to_m as f32);
    port.send(&link::reference(&set_point))
        .map_err(Failed::Port)
}

/// A key of `[controller]` without its section.
pub fn bare(name: &str) -> &str {
    name.strip_prefix("controller.").unwrap_or(name)
}

/// A number of single precision as it would be typed.
pub fn shortest(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// An order in words.
fn words(order: &Order) -> String {
    match order {
        Order::Move { to_mm } => format!("move to {to_mm} mm"),
        Order::Stop => "stop: the valve to its null".into(),
        Order::Acknowledge => "fault acknowledged".into(),
        Order::Gain { key, value } => format!("{key} = {value}"),
        Order::Store => "settings stored".into(),
        Order::Record { on: true, .. } => "recording begins".into(),
        Order::Record { on: false, .. } => "recording ends".into(),
    }
}
