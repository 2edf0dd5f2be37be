//! STM32F405RG at 168 MHz with converters for a real axis: docs/hardware.md.
//!
//! | pin | signal | unit |
//! |---|---|---|
//! | PA0, PA1, PA2 | pressures a, b and supply, 0..10 V behind a divider | ADC1 |
//! | PA3 | velocity, +-10 V behind a divider with an offset | ADC1 |
//! | PA4 | valve, to switch and amplifier | DAC |
//! | PB9 | switch: low centres the valve, high gives it the converter | |
//! | PC0 | valve, behind the amplifier | ADC2 |
//! | PB12 to PB15 | position: select, clock, in, out | SPI2 |
//! | PA15, PC10, PC12 | valve with `spi-dac`: select, clock, out | SPI3 |
//! | PA9, PA10 | serial line, out and in | USART1 |
//! | PB8 | lamp: on while the board runs without a fault of its clocks | |
//!
//! Everything that is waited for, is waited for a bounded time: the image also
//! starts where nothing of all this exists (QEMU's netduinoplus2, whose clocks
//! never report ready), says so, and leaves the valve alone.
#![expect(unsafe_code, reason = "registers, and memory that the DMA writes")]

mod clocks;
mod converters;
mod flash;
mod reset_cause;
mod serial;
mod spi;
mod valve;
mod watchdog;

use super::{Axis, Board, Parts, Stopwatch};
use clocks::{ClockFault, Clocks};
use converters::Converters;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{DWT, SCB, SYST};
use defmt_rtt as _;
use embedded_hal::delay::DelayNs;
use firmware::codes::{AdcCode, AdcCodes, DacCode, FAILED_CONVERSION, ValveConverter};
use firmware::fault::{Channel, Fault, Finding};
use firmware::parts::ads8681::{Ads8681, Span};
use firmware::tick::Sample;
use flash::Flash;
use spi::{Bus, CoreDelay, Device, Edge};
use stm32f4xx_hal::gpio::{GpioExt, Output, PB9, PB12, PinState, Speed};
use stm32f4xx_hal::pac::{self, GPIOB, SPI2};
use stm32f4xx_hal::rcc::Enable;
use valve::Converter;
use watchdog::Watchdog;

/// The chip's interrupts.
pub use stm32f4xx_hal::pac as device;

/// Ticks a second, chosen by a feature.
const TICKS_PER_S: u32 = if cfg!(feature = "8khz") {
    8_000
} else if cfg!(feature = "4khz") {
    4_000
} else if cfg!(feature = "2khz") {
    2_000
} else {
    1_000
};
/// What the position sensor puts out.
const POSITION_SPAN: Span = Span::PlusMinus10V;

/// The board.
pub struct Stm32f405;

impl Board for Stm32f405 {
    type Axis = RealAxis;
    type Stopwatch = CycleCounter;
    type SerialIn = serial::Receiver;
    type SerialOut = serial::Transmitter;
    type Watchdog = Watchdog;
    type Storage = Flash;

    const TICK_PERIOD_NS: u32 = 1_000_000_000 / TICKS_PER_S;
    const BAUD: u32 = serial::BAUD;
    const VALVE_CONVERTER: ValveConverter = Converter::FINENESS;
    const ANSWERS_PLANT: bool = false;

    fn start(mut core: cortex_m::Peripherals) -> Parts<Self> {
        // SAFETY: the start-up code's one call; nobody else has them.
        let mut chip = unsafe { pac::Peripherals::steal() };
        let reset_cause = reset_cause::take(&chip.RCC);
        let watchdog = Watchdog::start(chip.IWDG);
        let clocks = clocks::start(&mut chip.RCC, &chip.FLASH, &chip.PWR);
        tell(&clocks, &chip.FLASH);

        let rcc = &mut chip.RCC;
        let (a, b, c) = (
            chip.GPIOA.split(rcc),
            chip.GPIOB.split(rcc),
            chip.GPIOC.split(rcc),
        );
        let _analogue = (
            (
                a.pa0.into_analog(),
                a.pa1.into_analog(),
                a.pa2.into_analog(),
            ),
            (
                a.pa3.into_analog(),
                a.pa4.into_analog(),
                c.pc0.into_analog(),
            ),
        );
        let _serial = (
            a.pa9.into_alternate::<7>().speed(Speed::Medium),
            a.pa10.into_alternate::<7>().internal_pull_up(true),
        );
        // A mode out of the pull-down: an open wire gives zeroes, which no sound
        // frame of the position converter is.
        let _position = (
            b.pb13.into_alternate::<5>().speed(Speed::High),
            b.pb14.into_alternate::<5>().internal_pull_down(true),
            b.pb15.into_alternate::<5>().speed(Speed::High),
        );
        let lamp = PinState::from(clocks.fault.is_none());
        let _lamp = b.pb8.into_push_pull_output_in_state(lamp);
        let select = b.pb12.into_push_pull_output_in_state(PinState::High);

        let delay = CoreDelay::new(clocks.core_hz);
        SPI2::enable(rcc);
        let Ok(device) = Device::new(Bus::new(chip.SPI2, Edge::First), select, delay);
        let position = Ads8681::new(device, delay, POSITION_SPAN);

        #[cfg(not(feature = "spi-dac"))]
        let valve = Converter::start(rcc, chip.DAC);
        #[cfg(feature = "spi-dac")]
        let valve = {
            pac::SPI3::enable(rcc);
            let _clock = c.pc10.into_alternate::<6>().speed(Speed::High);
            let _out = c.pc12.into_alternate::<6>().speed(Speed::High);
            let select = a.pa15.into_push_pull_output_in_state(PinState::High);
            Converter::start(Bus::new(chip.SPI3, Edge::Second), select, delay)
        };

        let (serial_in, serial_out) = serial::start(rcc, chip.USART1, clocks.apb2_hz);
        let converters = Converters::new(
            rcc,
            (chip.TIM2, chip.DMA2),
            (chip.ADC1, chip.ADC2),
            &chip.ADC_COMMON,
        );
        start_supervision(&mut core.SYST, clocks.core_hz);
        watchdog.end_patience();

        // The hardware's middle, until the start's last act.
        let switch = b.pb9.into_push_pull_output_in_state(PinState::Low);

        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
        Parts {
            axis: RealAxis {
                converters,
                timers_hz: clocks.apb1_timers_hz,
                position,
                valve,
                switch,
                delay,
                is_joined: false,
                measured: valve::MIDDLE,
                written: valve::MIDDLE,
                found: None,
                tick: 0,
            },
            stopwatch: CycleCounter {
                from: 0,
                core_hz: clocks.core_hz,
            },
            serial_in,
            serial_out,
            watchdog,
            storage: Flash::new(chip.FLASH),
            reset_cause,
            finding: clocks.fault.map(finding_of),
        }
    }

    fn sample_streamed() {}

    fn run_ended() {}

    fn isolate_valve() {
        // SAFETY: a write that touches this one pin; the axis owns it, and puts it back only
        // when nothing is wrong any more.
        unsafe { &*GPIOB::ptr() }
            .bsrr()
            .write(|w| w.br9().set_bit());
    }

    fn give_up() -> ! {
        Self::isolate_valve();
        SCB::sys_reset()
    }

    fn stack_bytes() -> u32 {
        0
    }
}

/// How often the supervisor runs.
const SUPERVISIONS_PER_S: u32 = 100;

fn start_supervision(timer: &mut SYST, core_hz: u32) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(core_hz / SUPERVISIONS_PER_S - 1);
    timer.clear_current();
    timer.enable_interrupt();
    timer.enable_counter();
}

#[cortex_m_rt::exception]
fn SysTick() {
    rtic::pend(pac::Interrupt::TIM7);
}

fn finding_of(fault: ClockFault) -> Finding {
    Fault::ClockFailed.at(match fault {
        ClockFault::Crystal => 0,
        ClockFault::Pll => 1,
    })
}

/// Tells the log, if somebody listens.
fn tell(clocks: &Clocks, flash: &pac::FLASH) {
    defmt::info!("core at {} Hz", clocks.core_hz);
    if flash.optcr().read().bor_lev().is_bor_off() {
        defmt::warn!("brown-out reset is off: set its level, see docs/hardware.md");
    }
}

/// The converters' axis.
pub struct RealAxis {
    converters: Converters,
    /// Clock of the ticks' timer.
    timers_hz: u32,
    position: Ads8681<Device<SPI2, PB12<Output>>, CoreDelay>,
    valve: Converter,
    /// High gives the valve to the converter; low, and in reset, it stands at the middle.
    switch: PB9<Output>,
    delay: CoreDelay,
    is_joined: bool,
    /// What the amplifier had to put out when its voltage was measured last.
    measured: DacCode,
    /// The last command, which is put out from the next tick's begin on.
    written: DacCode,
    /// What the board itself has found since the last tick.
    found: Option<Finding>,
    tick: u32,
}

/// Time for the amplifier to follow the switch: thirteen times the 15 us of its input.
const SETTLE_US: u32 = 200;
/// Tries to reach the position converter at the start, each after a millisecond: its supply and
/// its reference take 20 ms at most (to be checked against its data sheet).
const POSITION_TRIES: u32 = 25;
/// Ticks between tries to reach it afterwards, while it does not answer.
const TICKS_PER_TRY: u32 = 128;

/// How far the valve's voltage may be from its command, in codes: 200 mV, the
/// sum of the worst errors of converter, amplifier, divider and ADC being 144 mV
/// (docs/hardware.md).
const VOLTAGE_TOLERANCE: u16 = 1_311;

impl RealAxis {
    /// Register and voltage against what they should be: of the register what was put out at
    /// this tick's edge, of the voltage what stood there at the end of the tick before, long
    /// after its edge.
    fn valve_finding(&mut self) -> Option<Finding> {
        if self.valve.output() != Converter::as_put_out(self.written) {
            return Some(Fault::DacMismatch.at(0));
        }
        (!self.is_voltage(self.measured)).then(|| Fault::DacMismatch.at(1))
    }

    /// Whether the valve's voltage was the one of a code when it was measured.
    fn is_voltage(&mut self, expected: DacCode) -> bool {
        let expected = Converter::as_put_out(expected);
        let voltage = self.converters.valve_voltage();
        voltage.is_some_and(|voltage| voltage.0.abs_diff(expected.0) <= VOLTAGE_TOLERANCE)
    }

    /// Measures the valve's voltage, which has to be the middle.
    fn is_at_middle(&mut self) -> bool {
        self.delay.delay_us(SETTLE_US);
        self.converters.measure_valve();
        self.delay.delay_us(SETTLE_US);
        self.is_voltage(valve::MIDDLE)
    }

    /// Gives the valve to the converter, if register and voltage are the middle before and after.
    fn join_valve(&mut self) -> Result<(), Finding> {
        if self.valve.output() != valve::MIDDLE {
            return Err(Fault::DacMismatch.at(0));
        }
        if !self.is_at_middle() {
            return Err(Fault::DacMismatch.at(1));
        }
        self.switch_valve(true);
        if self.is_at_middle() {
            return Ok(());
        }
        self.switch_valve(false);
        Err(Fault::DacMismatch.at(1))
    }

    /// Sets the position converter up, which may have its supply later than the chip.
    fn reach_position(&mut self) {
        let answers = (0..POSITION_TRIES).any(|_| {
            let is_set_up = self.position.configure().is_ok();
            let answers = is_set_up && self.position.convert() != FAILED_CONVERSION;
            if !answers {
                self.delay.delay_us(1_000);
            }
            answers
        });
        if !answers {
            defmt::error!("position converter: it does not answer");
        }
    }

    /// The position; a converter that does not answer has lost its settings, or its supply.
    fn position(&mut self) -> AdcCode {
        let code = self.position.convert();
        if code == FAILED_CONVERSION && self.tick.is_multiple_of(TICKS_PER_TRY) {
            // Whether it was reached shows in the next frame.
            let _ = self.position.configure();
        }
        code
    }
}

impl Axis for RealAxis {
    fn begin(&mut self) {
        self.reach_position();
        self.found = self.join_valve().err();
        self.converters.measure_valve();
        self.converters.start(self.timers_hz, TICKS_PER_S);
    }

    fn sample(&mut self, streamed: &Sample) -> Sample {
        self.valve.begin_tick();
        let conversions = self.converters.take();
        let position = self.position();
        self.tick = self.tick.wrapping_add(1);
        // The ring of the serial line is looked at each tick.
        rtic::pend(pac::Interrupt::USART1);
        Sample {
            tick: self.tick,
            codes: AdcCodes {
                position,
                pressure_a: conversions.pressure_a,
                pressure_b: conversions.pressure_b,
                supply_pressure: conversions.supply_pressure,
                velocity: conversions.velocity,
            },
            reference: streamed.reference,
        }
    }

    fn finding(&mut self) -> Option<Finding> {
        let of_valve = self.valve_finding();
        core::mem::take(&mut self.found).or(of_valve)
    }

    fn write_valve(&mut self, code: DacCode) {
        // The amplifier has followed this tick's edge for at least 50 us by now.
        self.measured = if self.is_joined {
            self.written
        } else {
            valve::MIDDLE
        };
        self.converters.measure_valve();
        self.valve.write(code);
        self.written = code;
        if self.converters.is_complete() {
            self.found = Some(Fault::TaskOverrun.at(0));
        } else if !self.converters.is_aligned() {
            self.converters.arm();
            self.found = Some(Fault::FailedConversion.at(Channel::PressureA as u8));
        }
    }

    fn switch_valve(&mut self, is_joined: bool) {
        self.switch.set_state(PinState::from(is_joined));
        self.is_joined = is_joined;
    }
}

/// The core's cycle counter.
pub struct CycleCounter {
    from: u32,
    core_hz: u32,
}

impl Stopwatch for CycleCounter {
    fn counts_per_s(&self) -> u32 {
        self.core_hz
    }

    fn start(&mut self) {
        self.from = DWT::cycle_count();
    }

    fn stop(&mut self) -> u32 {
        DWT::cycle_count().wrapping_sub(self.from)
    }
}

/// The crystal has stopped: the chip runs on its internal oscillator now, at a
/// tenth of its clock. A new start finds that out and reports it, and until then
/// the valve is at its middle, where the reset leaves it.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    super::keep(firmware::start::CRYSTAL_STOPPED);
    Stm32f405::give_up()
}
