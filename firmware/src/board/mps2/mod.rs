//! The machine mps2-an386 of QEMU: a Cortex-M4F in lock-step with a plant at its
//! serial line. A sample that arrives is the tick; the SysTick only measures.

pub mod device;
mod stack;
mod storage;
mod uart;

use super::{Axis, Board, Parts, Stopwatch, Watchdog};
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_semihosting::debug;
use device::Interrupt;
use firmware::codes::{DacCode, ValveConverter};
use firmware::fault::Finding;
use firmware::start::ResetCause;
use firmware::tick::Sample;

/// The machine.
pub struct Mps2;

impl Board for Mps2 {
    type Axis = PlantAxis;
    type Stopwatch = SysTick;
    type SerialIn = uart::Receiver;
    type SerialOut = uart::Transmitter;
    type Watchdog = NoWatchdog;
    type Storage = storage::Memory;

    const TICK_PERIOD_NS: u32 = 1_000_000;
    /// As fast as the plant reads.
    const BAUD: u32 = u32::MAX;
    const VALVE_CONVERTER: ValveConverter = ValveConverter::TwelveBits;
    const ANSWERS_PLANT: bool = true;

    fn start(core: cortex_m::Peripherals) -> Parts<Self> {
        let (serial_in, serial_out) = uart::start();
        Parts {
            axis: PlantAxis { valve: DacCode(0) },
            stopwatch: SysTick(core.SYST),
            serial_in,
            serial_out,
            watchdog: NoWatchdog,
            storage: storage::Memory::start(),
            reset_cause: ResetCause::PowerOn,
            finding: None,
        }
    }

    fn sample_streamed() {
        rtic::pend(Interrupt::DMA2_STREAM0);
    }

    fn run_ended() {
        debug::exit(debug::EXIT_SUCCESS);
    }

    fn isolate_valve() {}

    fn give_up() -> ! {
        debug::exit(debug::EXIT_FAILURE);
        loop {
            cortex_m::asm::wfi();
        }
    }

    fn stack_bytes() -> u32 {
        stack::most_used_bytes()
    }
}

/// The axis as the plant plays it.
pub struct PlantAxis {
    valve: DacCode,
}

impl Axis for PlantAxis {
    fn begin(&mut self) {}

    fn sample(&mut self, streamed: &Sample) -> Sample {
        if streamed.tick.is_multiple_of(TICKS_PER_SUPERVISION) {
            rtic::pend(Interrupt::TIM7);
        }
        *streamed
    }

    fn finding(&mut self) -> Option<Finding> {
        None
    }

    fn write_valve(&mut self, code: DacCode) {
        self.valve = code;
    }

    /// The plant has no switch: it goes by the command.
    fn switch_valve(&mut self, _: bool) {}
}

/// The supervisor's rhythm: by ticks, since time here runs on while the plant
/// computes, and a timer's interrupts would fall differently in every run.
const TICKS_PER_SUPERVISION: u32 = 10;

/// The processor's SysTick at 25 MHz. Under `-icount shift=0` an instruction
/// takes a nanosecond: one count is 40 instructions. It runs only while it
/// measures: a counter that runs on has QEMU work through the plant's time.
pub struct SysTick(SYST);

/// The counter's 24 bits.
const FROM: u32 = 0x00FF_FFFF;

impl Stopwatch for SysTick {
    fn counts_per_s(&self) -> u32 {
        25_000_000
    }

    fn start(&mut self) {
        self.0.set_clock_source(SystClkSource::Core);
        self.0.set_reload(FROM);
        self.0.clear_current();
        self.0.enable_counter();
    }

    fn stop(&mut self) -> u32 {
        let left = SYST::get_current();
        self.0.disable_counter();
        // The first count loads the counter; the one that is under way is taken
        // for whole, so that the figure is never too low.
        if left == 0 { 1 } else { FROM - left + 2 }
    }
}

/// In lock-step time stands still while the plant computes: nothing to watch.
pub struct NoWatchdog;

impl Watchdog for NoWatchdog {
    fn feed(&mut self) {}
}
