//! A board on the host: the firmware's control task, settings, telemetry and
//! status before a simulated axis, behind the same frames as the serial line of a
//! board with converters of its own. For trying out what one would do to a board.
//!
//! Its time stands still while nobody is connected. It forgets its settings when
//! the program ends.

use std::io::{self, Read, Write};
use std::net::TcpListener;
use std::time::{Duration, Instant};

use firmware::codes::{AdcCodes, DacCode, ValveConverter};
use firmware::control_task::ControlTask;
use firmware::crash;
use firmware::experiment::frames as experiment;
use firmware::link::{self, FromPlant, Order};
use firmware::settings::Wiring;
use firmware::settings::slots::{LEAST_SLOT_BYTES, Slot, SlotStorage, Slots, StorageFault};
use firmware::settings::transfer::Transfer;
use firmware::start::ResetCause;
use firmware::status::Program;
use firmware::telemetry::{self, Streaming, Tap, read_stream};
use firmware::tick::{Sample, State};
use model_core::reference::Reference;

use super::port::BAUD;
use crate::model::AxisFault;
use crate::plant::{Plant, PlantSettings};
use crate::rig::Rig;
use crate::settings::{connection, controller};
use crate::wire::{Heard, Wire};

/// Ticks between looks at the wire.
const TICKS_AT_ONCE: u32 = 10;
/// Reading must end soon, for the axis moves meanwhile.
const READ_WAIT: Duration = Duration::from_millis(1);
/// A look at the wire takes at least so long, also where time is short.
const LEAST_LOOK: Duration = Duration::from_millis(1);
/// Status reports, as a board sends them unasked: five a second.
const STATUS_PERIOD_S: f64 = 0.2;
const NANOSECONDS_PER_SECOND: f64 = 1e9;
/// The valve's middle, in force before the first command.
const MIDDLE: DacCode = DacCode(0x8000);
/// The firmware's code in this program.
const PROGRAM: Program = Program::of(
    [
        env!("CARGO_PKG_VERSION_MAJOR"),
        env!("CARGO_PKG_VERSION_MINOR"),
        env!("CARGO_PKG_VERSION_PATCH"),
    ],
    None,
);
/// Nothing is asked for.
const NO_REFERENCE: Reference<f32> = Reference {
    position_m: f32::NAN,
    velocity_m_per_s: f32::NAN,
    acceleration_m_per_s2: f32::NAN,
};

/// Two slots of settings in memory.
#[derive(Clone, Debug)]
pub struct MemorySlots(pub [[u8; LEAST_SLOT_BYTES]; 2]);

impl MemorySlots {
    /// Two that nothing was ever written to.
    pub fn blank() -> Self {
        Self([[firmware::settings::record::ERASED; LEAST_SLOT_BYTES]; 2])
    }
}

impl SlotStorage for MemorySlots {
    fn bytes(&self, slot: Slot) -> &[u8] {
        &self.0[slot as usize]
    }
    fn erase(&mut self, slot: Slot) -> Result<(), StorageFault> {
        self.0[slot as usize].fill(firmware::settings::record::ERASED);
        Ok(())
    }
    fn program(&mut self, slot: Slot, offset: usize, bytes: &[u8]) -> Result<(), StorageFault> {
        let place = self.0[slot as usize].get_mut(offset..offset + bytes.len());
        place.ok_or(StorageFault)?.copy_from_slice(bytes);
        Ok(())
    }
}

/// What is behind a board: sensors and a valve.
pub trait Axis {
    /// What the converters say now.
    fn codes(&mut self) -> AdcCodes;
    /// A tick later; the command takes over then.
    fn advance(&mut self, command: DacCode);
}

impl Axis for Plant {
    fn codes(&mut self) -> AdcCodes {
        self.codes_of_sensors()
    }

    fn advance(&mut self, command: DacCode) {
        Self::advance(self, command);
    }
}

/// A board and its axis.
pub struct Twin<A = Plant> {
    task: ControlTask,
    axis: A,
    tap: Tap,
    slots: Slots<MemorySlots>,
    transfer: Transfer,
    reference: Reference<f32>,
    tick: u32,
    tick_s: f64,
    ticks_per_status: u32,
}

impl Twin {
    /// A board with the settings of `known`, its wiring checked or not, at the axis of `rig`, at rest.
    ///
    /// # Errors
    /// Where one of the rigs is no whole axis.
    pub fn new(
        rig: &Rig,
        (known, wiring): (&Rig, Wiring),
        plant: PlantSettings,
    ) -> Result<Self, AxisFault> {
        let tick_s = plant.tick_s;
        Self::before(Plant::new(rig, plant)?, (known, wiring), tick_s)
    }
}

impl<A: Axis> Twin<A> {
    /// A board with the settings of `known`, its wiring checked or not, before an axis at rest, which is asked every `tick_s`.
    ///
    /// # Errors
    /// Where the rig is no whole axis.
    pub fn before(
        axis: A,
        (known, wiring): (&Rig, Wiring),
        tick_s: f64,
    ) -> Result<Self, AxisFault> {
        let (slots, _) = Slots::start(MemorySlots::blank());
        let mut twin = Self {
            task: ControlTask::of(
                controller(known, tick_s)?,
                &connection(known, wiring)?,
                ValveConverter::TwelveBits,
            ),
            axis,
            tap: Tap::new(MIDDLE),
            slots,
            transfer: Transfer::new(tick_s as f32),
            reference: NO_REFERENCE,
            tick: 0,
            tick_s,
            ticks_per_status: (STATUS_PERIOD_S / tick_s).ceil() as u32,
        };
        // Somebody who connects finds it started.
        for _ in 0..twin.ticks_per_status {
            twin.step();
        }
        Ok(twin)
    }

    /// Waits for the next host and serves it, at `speed` times the speed of time.
    pub fn serve_next(&mut self, listener: &TcpListener, speed: f64) -> io::Result<()> {
        let (stream, _) = listener.accept()?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(READ_WAIT))?;
        self.serve(stream, speed)
    }

    /// Serves a host until it hangs up, at `speed` times the speed of time, or
    /// slower where this computer is. Reading from the stream must end after some
    /// milliseconds without news.
    pub fn serve<S: Read + Write>(&mut self, stream: S, speed: f64) -> io::Result<()> {
        let mut wire = Wire::new(stream);
        match self.serve_wire(&mut wire, speed) {
            Err(error) if has_hung_up(&error) => Ok(()),
            outcome => outcome,
        }
    }

    fn serve_wire<S: Read + Write>(&mut self, wire: &mut Wire<S>, speed: f64) -> io::Result<()> {
        let step = Duration::from_secs_f64(self.tick_s * f64::from(TICKS_AT_ONCE) / speed);
        let mut due = Instant::now();
        loop {
            for _ in 0..TICKS_AT_ONCE {
                self.tick(wire)?;
            }
            due = (due + step).max(Instant::now() + LEAST_LOOK);
            loop {
                match wire.receive_until(due)? {
                    Heard::Payload(payload) => self.take(&payload, wire)?,
                    Heard::Nothing => break,
                    Heard::End => return Ok(()),
                }
            }
        }
    }

    /// One tick of board and axis.
    fn step(&mut self) {
        self.tick = self.tick.wrapping_add(1);
        let sample = Sample {
            tick: self.tick,
            codes: self.axis.codes(),
            reference: self.reference,
        };
        let command = self.task.tick(&sample);
        self.axis.advance(command.valve);
        if command.state == State::Fault {
            // As on the board: nothing moves until somebody asks anew.
            self.reference = NO_REFERENCE;
        }
        self.tap.offer(&sample, &command);
        if self.task.take_void() {
            // Memory does not refuse.
            let _stored = self.slots.void_wiring();
        }
    }

    fn tick<S: Write>(&mut self, wire: &mut Wire<S>) -> io::Result<()> {
        self.step();
        while let Some(record) = self.tap.take() {
            wire.send(&telemetry::tick(&record))?;
        }
        if self.tick.is_multiple_of(self.ticks_per_status) {
            self.tell_status(wire)?;
        }
        Ok(())
    }

    fn tell_status<S: Write>(&self, wire: &mut Wire<S>) -> io::Result<()> {
        let mut status = self.task.status(ResetCause::PowerOn, false);
        status.program = PROGRAM;
        wire.send(&status.payload())
    }

    /// Does what a frame asks for.
    fn take<S: Write>(&mut self, payload: &[u8], wire: &mut Wire<S>) -> io::Result<()> {
        match link::from_plant(payload) {
            Some(FromPlant::Reference(reference)) => {
                self.task.let_go();
                self.reference = reference;
            }
            Some(FromPlant::Order(order @ (Order::Acknowledge | Order::Inject(_)))) => {
                self.task.obey(order);
            }
            Some(FromPlant::AskStatus) => self.tell_status(wire)?,
            Some(FromPlant::Sample(_) | FromPlant::End) => self.count_dropped(),
            None => return self.answer(payload, wire),
        }
        Ok(())
    }

    /// Telemetry and settings.
    fn answer<S: Write>(&mut self, payload: &[u8], wire: &mut Wire<S>) -> io::Result<()> {
        if let Some(wish) = read_stream(payload) {
            let period_ns = (NANOSECONDS_PER_SECOND * self.tick_s).round() as u32;
            let decimation = telemetry::granted_decimation(wish, period_ns, BAUD);
            self.tap.set_decimation(decimation);
            return wire.send(&telemetry::streaming(Streaming {
                decimation,
                tick_period_ns: period_ns,
            }));
        }
        if let Some(wish) = experiment::read_request(payload) {
            return wire.send(&self.task.serve_experiment(&wish).payload());
        }
        if crash::is_asked(payload) {
            return wire.send(&crash::told(None));
        }
        let task = &mut self.task;
        let served = self
            .transfer
            .serve(payload, &mut self.slots, |controller, connection| {
                task.replace_controller(controller, connection)
            });
        match served {
            Some(answer) => wire.send(&answer),
            None => {
                self.count_dropped();
                Ok(())
            }
        }
    }

    fn count_dropped(&mut self) {
        let dropped = &mut self.task.counters_mut().dropped_frames;
        *dropped = dropped.saturating_add(1);
    }
}

fn has_hung_up(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::BrokenPipe
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::ConnectionAborted
    )
}
