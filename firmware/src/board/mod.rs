//! The boards, behind one contract in the axis' own terms. The only place that
//! knows registers, and the only one with `unsafe`.
//!
//! | board | what it is |
//! |---|---|
//! | `stm32f405` | the chip between real converters and a real valve: docs/hardware.md |
//! | `mps2` | the machine mps2-an386 of QEMU, lock-step with a plant |
//!
//! A board also brings the module `device`: its interrupts, under the names of
//! the STM32F405, and `NVIC_PRIO_BITS`. The application binds
//!
//! | interrupt | task | raised by |
//! |---|---|---|
//! | `DMA2_STREAM0` | control | a sample that is complete |
//! | `USART1` | receive | a byte on the serial line |
//! | `TIM7` | supervise | the board, some hundred times a second, independent of samples where it has time |
//! | `UART5` | transmit | software |

use firmware::codes::{DacCode, ValveConverter};
use firmware::fault::Finding;
use firmware::settings::slots::SlotStorage;
use firmware::start::ResetCause;
use firmware::tick::Sample;

mod exceptions;
mod kept;

#[cfg(feature = "mps2")]
mod mps2;
#[cfg(feature = "mps2")]
pub use mps2::{Mps2 as Chosen, device};

#[cfg(feature = "stm32f405")]
mod stm32f405;
#[cfg(feature = "stm32f405")]
pub use stm32f405::{Stm32f405 as Chosen, device};

#[cfg(not(any(feature = "mps2", feature = "stm32f405")))]
compile_error!("choose a board: --features mps2, or stm32f405");

pub use kept::{keep, keep_crash, kept_crash, take_kept};

/// Converters and valve.
pub trait Axis {
    /// The start's last act: whatever takes its time is over. The valve is given to its
    /// converter, if that and what is behind it are at the middle, and the ticks begin.
    fn begin(&mut self);
    /// Acknowledges the tick and takes its sample. `streamed` is the latest that
    /// came over the serial line: all of it where a plant is behind the line,
    /// the reference alone where the board has converters of its own.
    fn sample(&mut self, streamed: &Sample) -> Sample;
    /// What the board itself has found wrong with this sample or with the last
    /// command; after [`sample`](Self::sample).
    fn finding(&mut self) -> Option<Finding>;
    /// Writes the valve's converter.
    fn write_valve(&mut self, code: DacCode);
    /// Gives the valve to the converter, or to the hardware, which holds its middle.
    fn switch_valve(&mut self, is_joined: bool);
}

/// Counts what a piece of code costs.
pub trait Stopwatch {
    /// Counts in a second.
    fn counts_per_s(&self) -> u32;
    /// Begins to count.
    fn start(&mut self);
    /// Counts since the start; at most those of a second need to be right.
    fn stop(&mut self) -> u32;
}

/// The serial line, inwards.
pub trait SerialIn {
    /// The byte that raised the interrupt, which is acknowledged; `None` where it
    /// came damaged. One more byte raises it again.
    fn byte(&mut self) -> Option<u8>;
}

/// The serial line, outwards. Called by the lowest task only: it may wait for the line.
pub trait SerialOut {
    /// Sends all bytes.
    fn send(&mut self, bytes: &[u8]);
}

/// Resets the board unless it is fed.
pub trait Watchdog {
    /// All is well.
    fn feed(&mut self);
}

/// A board that has started.
pub struct Parts<B: Board> {
    /// Converters and valve.
    pub axis: B::Axis,
    /// For the control task.
    pub stopwatch: B::Stopwatch,
    /// The serial line, inwards.
    pub serial_in: B::SerialIn,
    /// The serial line, outwards.
    pub serial_out: B::SerialOut,
    /// The watchdog.
    pub watchdog: B::Watchdog,
    /// The two slots of settings.
    pub storage: B::Storage,
    /// Why the board started.
    pub reset_cause: ResetCause,
    /// What is wrong with the board.
    pub finding: Option<Finding>,
}

/// A board.
pub trait Board: Sized {
    /// Converters and valve.
    type Axis: Axis;
    /// What counts.
    type Stopwatch: Stopwatch;
    /// The serial line, inwards.
    type SerialIn: SerialIn;
    /// The serial line, outwards.
    type SerialOut: SerialOut;
    /// The watchdog.
    type Watchdog: Watchdog;
    /// The two slots of settings.
    type Storage: SlotStorage;

    /// Time between samples.
    const TICK_PERIOD_NS: u32;
    /// Bits a second of the serial line.
    const BAUD: u32;
    /// How fine the valve's converter is.
    const VALVE_CONVERTER: ValveConverter;
    /// Whether a plant at the serial line waits for each command.
    const ANSWERS_PLANT: bool;

    /// Brings the board up; interrupts are masked.
    fn start(core: cortex_m::Peripherals) -> Parts<Self>;
    /// A sample came over the serial line; a board without converters takes its
    /// arrival as the tick.
    fn sample_streamed();
    /// The plant has ended the run.
    fn run_ended();
    /// Takes the valve from the converter at once, whoever runs; the hardware holds its middle.
    fn isolate_valve();
    /// Nothing can be trusted any more; the cause is kept. Starts anew, or ends.
    fn give_up() -> !;
    /// The most bytes that the stack has held; 0 where nothing watches it.
    fn stack_bytes() -> u32;
}
