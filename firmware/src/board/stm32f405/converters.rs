//! The chip's converters: pressures and velocity, each tick without the core.
//!
//! TIM2's update starts ADC1; ADC1 converts its 16 ranks, the four channels four
//! times over; DMA2 stream 0 brings them; its last transfer is the interrupt
//! that is the control task. ADC2 measures what the valve's amplifier puts out.
//!
//! Time: the ADC's clock is APB2 / 4 = 21 MHz; 28 cycles of sampling and 12 of
//! conversion are 1.9 us, 16 ranks 30.5 us. The sampling capacitor (4 pF, behind
//! 6 kOhm at most: to be checked against the data sheet, DS8626) takes its charge from the 10 nF at the pin,
//! which loses 0.04 % of the step between channels and has it back from its
//! amplifier through 100 Ohm within the 7.6 us to its next turn.

use core::sync::atomic::{AtomicU16, Ordering::Relaxed};
use firmware::codes::{AdcCode, FAILED_CONVERSION};
use stm32f4xx_hal::pac::adc_common::ccr::ADCPRE;
use stm32f4xx_hal::pac::adc1::cr2::{EXTEN, EXTSEL};
use stm32f4xx_hal::pac::adc1::smpr2::SMP10;
use stm32f4xx_hal::pac::tim2::cr2::MMS;
use stm32f4xx_hal::pac::{ADC_COMMON, ADC1, ADC2, DMA2, RCC, TIM2};
use stm32f4xx_hal::rcc::Enable;

/// ADC1's inputs, PA0 to PA3, in the order of [`Conversions`].
const CHANNELS: [u8; 4] = [0, 1, 2, 3];
const ROUNDS: usize = 4;
const RANKS: usize = CHANNELS.len() * ROUNDS;
/// ADC2's input, PC0: the valve's voltage.
const VALVE_CHANNEL: u8 = 10;

/// Where the DMA puts the ranks. It writes for 30 us at the beginning of a tick
/// and the control task reads right after: never both.
static RANK_CODES: [AtomicU16; RANKS] = [const { AtomicU16::new(0) }; RANKS];

/// One tick's conversions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conversions {
    /// Pressure of chamber a.
    pub pressure_a: AdcCode,
    /// Pressure of chamber b.
    pub pressure_b: AdcCode,
    /// Supply pressure.
    pub supply_pressure: AdcCode,
    /// Velocity.
    pub velocity: AdcCode,
}

impl Conversions {
    const FAILED: Self = Self {
        pressure_a: FAILED_CONVERSION,
        pressure_b: FAILED_CONVERSION,
        supply_pressure: FAILED_CONVERSION,
        velocity: FAILED_CONVERSION,
    };
}

/// Timer, converters and DMA.
pub struct Converters {
    timer: TIM2,
    sensors: ADC1,
    valve: ADC2,
    dma: DMA2,
}

impl Converters {
    /// Sets everything up; the ticks begin with [`start`](Self::start). Clocks of
    /// the units are switched on here, the pins already are analogue.
    pub fn new(
        rcc: &mut RCC,
        (timer, dma): (TIM2, DMA2),
        (sensors, valve): (ADC1, ADC2),
        common: &ADC_COMMON,
    ) -> Self {
        TIM2::enable(rcc);
        DMA2::enable(rcc);
        ADC1::enable(rcc);
        ADC2::enable(rcc);
        common.ccr().modify(|_, w| w.adcpre().variant(ADCPRE::Div4));
        let converters = Self {
            timer,
            sensors,
            valve,
            dma,
        };
        converters.set_up_valve();
        converters.set_up_sensors();
        converters
    }

    fn set_up_valve(&self) {
        self.valve
            .smpr1()
            .modify(|_, w| w.smp(0).variant(SMP10::Cycles28));
        // SAFETY: a channel that exists.
        self.valve
            .sqr3()
            .write(|w| unsafe { w.sq1().bits(VALVE_CHANNEL) });
        self.valve.cr2().write(|w| w.adon().set_bit());
    }

    fn set_up_sensors(&self) {
        let adc = &self.sensors;
        adc.cr1().write(|w| w.scan().set_bit());
        adc.smpr2().write(|w| {
            for channel in CHANNELS {
                w.smp(channel).variant(SMP10::Cycles28);
            }
            w
        });
        // Six ranks to a register of five bits each, the last four in the first.
        let ranks = |count: usize| (0..count).map(|place| CHANNELS[place % CHANNELS.len()]);
        let packed = |from: usize, until: usize| {
            ranks(until)
                .skip(from)
                .enumerate()
                .fold(0, |word, (place, channel)| {
                    word | u32::from(channel) << (5 * place)
                })
        };
        const LAST_RANK: u32 = RANKS as u32 - 1;
        // SAFETY: ranks of channels that exist.
        unsafe {
            adc.sqr3().write(|w| w.bits(packed(0, 6)));
            adc.sqr2().write(|w| w.bits(packed(6, 12)));
            adc.sqr1()
                .write(|w| w.bits(LAST_RANK << 20 | packed(12, RANKS)));
        }
    }

    /// Begins the ticks; the timer's clock is `timer_hz`.
    pub fn start(&mut self, timer_hz: u32, ticks_per_s: u32) {
        self.arm();
        let period = (timer_hz / ticks_per_s.max(1)).max(1);
        self.timer.arr().write(|w| w.arr().set(period - 1));
        self.timer.cr2().write(|w| w.mms().variant(MMS::Update));
        self.timer.cr1().write(|w| w.cen().set_bit());
    }

    /// Begins anew after a failed conversion: an overrun stops the ADC's requests
    /// until both sides are armed again.
    pub fn arm(&mut self) {
        let (adc, stream) = (&self.sensors, self.dma.st(0));
        // Off, which ends a scan that is under way: what is left of it would shift the channels.
        adc.cr2().write(|w| w);
        adc.sr().modify(|_, w| w.ovr().clear_bit());
        stream.cr().modify(|_, w| w.en().clear_bit());
        // The stream may finish one transfer first: two cycles of the AHB.
        let _is_off = (0..100).any(|_| stream.cr().read().en().bit_is_clear());
        self.acknowledge();
        stream.ndtr().write(|w| w.ndt().set(RANKS as u16));
        // SAFETY: the stream writes `RANKS` half words from the ADC's data
        // register into a static of as many atomics of that size.
        unsafe {
            stream.par().write(|w| w.bits(adc.dr().as_ptr() as u32));
            stream.m0ar().write(|w| w.bits(RANK_CODES.as_ptr() as u32));
        }
        // Channel 0, the one after reset, is ADC1.
        stream.cr().write(|w| {
            w.msize().bits16().psize().bits16().minc().set_bit();
            w.circ().set_bit().pl().very_high();
            w.tcie().set_bit().teie().set_bit().dmeie().set_bit();
            w.en().set_bit()
        });
        adc.cr2().write(|w| {
            w.extsel().variant(EXTSEL::Tim2trgo);
            w.exten().variant(EXTEN::RisingEdge);
            w.dma().set_bit().dds().set_bit().adon().set_bit()
        });
    }

    /// Clears the interrupt; the first thing that the control task does.
    pub fn acknowledge(&self) {
        self.dma.lifcr().write(|w| {
            w.ctcif0().set_bit().chtif0().set_bit();
            w.cteif0().set_bit().cdmeif0().set_bit().cfeif0().set_bit()
        });
    }

    /// The tick's conversions, acknowledged: means of four rounds. They have failed if ADC or
    /// DMA report an error, or if somebody calls without their being complete; then they are
    /// armed again.
    pub fn take(&mut self) -> Conversions {
        let flags = self.dma.lisr().read();
        let has_failed = flags.teif0().bit_is_set()
            || flags.dmeif0().bit_is_set()
            || flags.tcif0().bit_is_clear()
            || self.sensors.sr().read().ovr().bit_is_set();
        if has_failed {
            self.arm();
            return Conversions::FAILED;
        }
        self.acknowledge();
        let [pressure_a, pressure_b, supply_pressure, velocity] = [0, 1, 2, 3].map(code_of);
        Conversions {
            pressure_a,
            pressure_b,
            supply_pressure,
            velocity,
        }
    }

    /// Whether every rank of a scan that has ended is where it belongs: the stream then stands
    /// at its beginning. To be asked between scans.
    pub fn is_aligned(&self) -> bool {
        usize::from(self.dma.st(0).ndtr().read().ndt().bits()) == RANKS
    }

    /// Whether the next tick's conversions are complete.
    pub fn is_complete(&self) -> bool {
        self.dma.lisr().read().tcif0().bit_is_set()
    }

    /// Starts to measure the valve's voltage.
    pub fn measure_valve(&mut self) {
        self.valve.sr().modify(|_, w| w.eoc().clear_bit());
        self.valve.cr2().modify(|_, w| w.swstart().set_bit());
    }

    /// The valve's voltage, measured at [`measure_valve`](Self::measure_valve), 2 us of which
    /// must have passed; `None` if it is not there.
    pub fn valve_voltage(&mut self) -> Option<AdcCode> {
        let is_there = self.valve.sr().read().eoc().bit_is_set();
        let steps = self.valve.dr().read().data().bits() & 0x0FFF;
        is_there.then_some(AdcCode(steps << 4))
    }
}

/// The mean of a channel's four rounds of 12 bits as a code of 16: their sum has
/// 14 bits. The highest, 65520, is not the code of a failed conversion.
fn code_of(channel: usize) -> AdcCode {
    let rounds = RANK_CODES.iter().skip(channel).step_by(CHANNELS.len());
    let sum: u16 = rounds.map(|code| code.load(Relaxed) & 0x0FFF).sum();
    AdcCode(sum << 2)
}
