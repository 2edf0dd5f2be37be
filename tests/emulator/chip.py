"""The STM32F405 around its core, as far as the image uses it, register by register.

The units do what the reference manual RM0090 says and the circuit of docs/hardware.md does, and
*note a misuse* where the program breaks a rule: the section is named beside it. What a misuse does
on silicon is not modelled; a run with one has failed.

Assumed, not measured: the crystal takes 2 ms, the PLL 0.2 ms, erasing a sector 250 ms, a word 16 us.
"""

import collections
import math
import struct

from core import FLASH, RAM, RAM_BYTES, Core, Stopped

ADC_INTERRUPT, USART1_INTERRUPT, DMA2_STREAM0_INTERRUPT = 18, 37, 56
SYSTICK = 15
NON_MASKABLE, HARD_FAULT = 2, 3
# How a run ends that the program ends.
RESET = "the program resets the chip"
INTERNAL_HZ, CRYSTAL_HZ = 16e6, 8e6
FULL_SCALE_V = 10.0
# What the amplifier's input still lacks when its voltage is sampled, at the most, V: a tenth of the
# tolerance of fault 15.
SETTLED_V = 0.02
SECTORS = {2: 0x0800_8000, 3: 0x0800_C000}
SLOT_BYTES = 0x4000


class Unit:
    """Registers that hold what is written, at `base`."""

    base, bytes, name, clock = 0, 0x400, "", None

    def __init__(self, chip):
        self.chip = chip
        self.held = collections.defaultdict(int)
        self.held.update(self.reset_values())

    def reset_values(self):
        """Registers that are not zero after reset."""
        return {}

    def read(self, offset):
        """What a load gives."""
        return self.held[offset]

    def write(self, offset, value):
        """What a store does."""
        self.held[offset] = value

    def set_bits(self, offset, value):
        """The bits that are set now and were not."""
        return value & ~self.held[offset]


class Rcc(Unit):
    """RM0090 section 7: clocks and resets."""

    base, name = 0x4002_3800, "RCC"
    CR, PLLCFGR, CFGR, CSR = 0x00, 0x04, 0x08, 0x74
    ENABLES = (0x30, 0x40, 0x44)

    def reset_values(self):
        flags = self.chip.options.reset_flags
        return {0x00: 0x83, 0x04: 0x2400_3010, 0x30: 0x0010_0000, self.CSR: flags}

    def write(self, offset, value):
        chip = self.chip
        if offset == self.CR:
            # The ready flags are the chip's.
            value = value & ~0x0202_0002 | self.held[offset] & 0x0202_0002
            if self.set_bits(offset, value) & 1 << 16 and not chip.options.no_crystal:
                chip.core.after(2e6, self._ready, 17)
            if self.set_bits(offset, value) & 1 << 24:
                chip.rule(chip.power.held[0] & 1 << 14, "PLL on below scale 1 (5.1.4)")
                if not chip.options.no_pll:
                    chip.core.after(2e5, self._ready, 25)
            for on, ready in ((16, 17), (24, 25)):
                if not value & 1 << on:
                    value &= ~(1 << ready)
        if offset == self.CSR and value & 1 << 24:
            value = 0
        if offset in self.ENABLES:
            chip.clock_enabled(offset, self.set_bits(offset, value))
        self.held[offset] = value
        if offset == self.CFGR:
            self.held[offset] = value & ~0xC | (value & 3) << 2
            self._change_over(value & 3)

    def _ready(self, bit):
        if self.held[self.CR] & 1 << bit - 1:
            self.held[self.CR] |= 1 << bit

    def _change_over(self, source):
        chip, hz = self.chip, INTERNAL_HZ
        if source == 2:
            pll = self.held[self.PLLCFGR]
            entry_hz = CRYSTAL_HZ if pll >> 22 & 1 else INTERNAL_HZ
            hz = entry_hz / (pll & 63) * (pll >> 6 & 511) / (2 * ((pll >> 16 & 3) + 1))
            chip.rule(self.held[self.CR] >> 25 & 1, "core changed over to a PLL that is not ready (7.2.6)")
        waits = chip.flash.held[0] & 7
        chip.rule(waits >= math.ceil(hz / 30e6) - 1, f"{waits} wait states at {hz / 1e6:.0f} MHz (3.5.1)")
        if hz != chip.core.hz:
            chip.core.change_clock(hz)
            chip.mark(f"core at {hz / 1e6:.0f} MHz")
        chip.rule(self.apb1_hz() <= 42e6 and self.apb2_hz() <= 84e6, "bus clock too high (7.2)")

    def apb1_hz(self):
        """Clock of the slower bus."""
        return self.chip.core.hz / {4: 2, 5: 4, 6: 8, 7: 16}.get(self.held[self.CFGR] >> 10 & 7, 1)

    def apb2_hz(self):
        """Clock of the faster bus."""
        return self.chip.core.hz / {4: 2, 5: 4, 6: 8, 7: 16}.get(self.held[self.CFGR] >> 13 & 7, 1)

    def timers_hz(self):
        """Clock of the timers of the slower bus: twice its own where that is divided."""
        return self.apb1_hz() * (2 if self.held[self.CFGR] >> 12 & 1 else 1)

    def lose_crystal(self):
        """The crystal stops: the clock security system raises the non-maskable interrupt (7.2.7)."""
        self.held[self.CR] &= ~(1 << 17)
        if self.held[self.CR] >> 19 & 1:
            self.chip.core.change_clock(INTERNAL_HZ)
            self.held[self.CFGR] &= ~0xF
            self.chip.core.pend(NON_MASKABLE)


class Power(Unit):
    """RM0090 section 5."""

    base, name, clock = 0x4000_7000, "PWR", (0x40, 28)

    def read(self, offset):
        return 0x4000 if offset == 4 else self.held[offset]


class FlashUnit(Unit):
    """RM0090 section 3: the flash and its interface."""

    base, name = 0x4002_3C00, "FLASH"
    ACR, KEYR, SR, CR = 0x00, 0x04, 0x0C, 0x10
    LOCK, STRT = 1 << 31, 1 << 16

    def __init__(self, chip):
        super().__init__(chip)
        self.keys, self.is_locked = 0, True
        self.undone = []
        self.operations = 0

    def reset_values(self):
        return {0x14: 0x0FFF_AAED}

    def read(self, offset):
        if offset == self.SR:
            self.settle()
        if offset == self.CR:
            return self.held[offset] | (self.LOCK if self.is_locked else 0)
        return self.held[offset]

    def write(self, offset, value):
        if offset == self.KEYR:
            right = (0x4567_0123, 0xCDEF_89AB)[min(self.keys, 1)] == value
            self.keys = self.keys + 1 if right else 0
            self.is_locked &= self.keys != 2
        elif offset == self.SR:
            self.held[offset] &= ~value
        elif offset == self.CR:
            self._control(value)
        else:
            if offset == self.ACR:
                resets_data, data_is_on = value >> 12 & 1, value >> 10 & 1
                self.chip.rule(not (resets_data and data_is_on), "data cache reset while it is on (3.9.1)")
            self.held[offset] = value

    def _control(self, value):
        chip = self.chip
        if value & self.LOCK:
            chip.rule(not value & ~self.LOCK, f"FLASH_CR: LOCK beside an operation, {value:08x} (3.9.5)")
            self.is_locked, self.keys = True, 0
            self.held[self.CR] = 0
            return
        if not chip.rule(not self.is_locked, "FLASH_CR written while it is locked (3.6.1)"):
            return
        is_start = self.set_bits(self.CR, value) & self.STRT
        self.held[self.CR] = value & ~self.STRT
        if is_start and chip.rule(value & 2, "FLASH_CR: STRT without SER (3.6.3)"):
            self._erase(value >> 3 & 15)

    def _erase(self, sector):
        chip = self.chip
        if not chip.rule(sector in SECTORS, f"sector {sector} holds program"):
            return
        part = self._part_done()
        chip.core.engine.mem_write(SECTORS[sector], b"\xff" * int(SLOT_BYTES * part))
        chip.core.wait(250e6)
        chip.mark(f"sector {sector} erased")
        self._count()

    def program(self, address, size, value, held):
        """A store to the flash."""
        chip = self.chip
        if not self.held[self.CR] & 1:
            chip.rule(False, "store to the flash without PG (3.6.4)")
            self.undone.append((address & ~3, held))
            return
        chip.rule(size == 4 and address % 4 == 0, "programmed by another size than PSIZE says (3.6.2)")
        (old,) = struct.unpack("<I", held)
        chip.rule(old & value == value, "programmed where it was not erased (3.6.4)")
        inside = any(begin <= address < begin + SLOT_BYTES for begin in SECTORS.values())
        chip.rule(inside, "programmed outside the slots of settings")
        if self._part_done() < 1:
            # Power fails while the word is written: some of its bits are.
            self.undone.append((address, struct.pack("<I", old & (value | 0x00FF_FF00))))
        chip.core.wait(16e3)
        self._count()

    def _part_done(self):
        return 0.5 if self.operations + 1 == self.chip.options.cut_at else 1

    def _count(self):
        self.operations += 1
        if self.operations == self.chip.options.cut_at:
            raise_later(self.chip, "power is cut")

    def settle(self):
        """What was stored and did not take, or not as a whole, is put right."""
        for address, data in self.undone:
            self.chip.core.engine.mem_write(address, data)
        self.undone.clear()


class Port(Unit):
    """RM0090 section 8: a port of pins."""

    MODE, IN, OUT, SET, ALTERNATE_HIGH = 0x00, 0x10, 0x14, 0x18, 0x24

    def __init__(self, chip, letter, number, modes):
        self.base = 0x4002_0000 + 0x400 * number
        self.name, self.clock = f"GPIO{letter}", (0x30, number)
        self.modes = modes
        super().__init__(chip)

    def reset_values(self):
        return {0: self.modes}

    def read(self, offset):
        return self.held[self.OUT] if offset == self.IN else self.held[offset]

    def write(self, offset, value):
        if offset == self.SET:
            offset, value = self.OUT, self.held[self.OUT] & ~(value >> 16) | value & 0xFFFF
        before, self.held[offset] = self.held[offset], value
        if offset == self.OUT:
            self.chip.pins_changed(self, before ^ value, value)

    def is_analogue(self, pin):
        """Mode 3."""
        return self.held[0] >> 2 * pin & 3 == 3

    def has_function(self, pin, number):
        """Whether an upper pin is given to this alternate function."""
        is_alternate = self.held[0] >> 2 * pin & 3 == 2
        return is_alternate and self.held[self.ALTERNATE_HIGH] >> 4 * (pin - 8) & 15 == number

    def level(self, pin):
        """What an output pin shows; an input is held low by its resistor."""
        return self.held[self.OUT] >> pin & 1 if self.held[0] >> 2 * pin & 3 == 1 else 0


class Timer(Unit):
    """RM0090 section 18: TIM2, whose update is the tick."""

    base, name, clock = 0x4000_0000, "TIM2", (0x40, 0)

    def write(self, offset, value):
        starts = offset == 0 and self.set_bits(0, value) & 1
        self.held[offset] = value
        if starts:
            self.period_ns = (self.held[0x2C] + 1) * (self.held[0x28] + 1) * 1e9 / self.chip.rcc.timers_hz()
            self.chip.mark(f"TIM2 on, a tick of {self.period_ns / 1e3:.3f} us")
            self.chip.world.begins()
            self.chip.core.after(self.period_ns, self._update)

    def _update(self):
        chip = self.chip
        chip.ticks += 1
        chip.tick_ns = chip.core.now()
        chip.core.after(self.period_ns, self._update)
        if self.held[4] >> 4 & 7 == 2:
            chip.dac.triggered()
            if chip.ticks not in chip.options.lost_triggers:
                chip.sensors.triggered()
        chip.world.ticks()


class Sensors(Unit):
    """RM0090 section 13: ADC1, a scan that the timer starts and DMA2 brings."""

    base, bytes, name, clock = 0x4001_2000, 0x100, "ADC1", (0x44, 8)
    OVERRUN = 1 << 5

    def __init__(self, chip):
        super().__init__(chip)
        self.scan = 0
        self.converting = False

    def write(self, offset, value):
        if offset == 0:
            value &= self.held[0]
        if offset == 8 and not value & 1:
            # Off: a scan under way ends.
            self.scan += 1
            self.converting = False
        self.held[offset] = value

    def triggered(self):
        """The timer's edge."""
        control, chip = self.held[8], self.chip
        if not control & 1 or control >> 28 & 3 != 1 or control >> 24 & 15 != 6:
            return
        chip.rule(not self.converting, "ADC1 triggered while it converts (13.3.10)")
        divider = 2 * ((chip.adc_common.held[4] >> 16 & 3) + 1)
        hz = chip.rcc.apb2_hz() / divider
        chip.rule(hz <= 36e6, f"ADC clock of {hz / 1e6:.0f} MHz (DS8626, 36 MHz)")
        sampling = (3, 15, 28, 56, 84, 112, 144, 480)[self.held[0x10] & 7]
        ranks = (self.held[0x2C] >> 20 & 15) + 1
        self.converting = True
        chip.core.after(ranks * (sampling + 12) * 1e9 / hz, self._ended, self.scan)

    def _ended(self, scan):
        if scan != self.scan:
            return
        self.converting = False
        ranks = (self.held[0x2C] >> 20 & 15) + 1
        order = [self.held[register] >> 5 * place & 31
                 for register, places in ((0x34, 6), (0x30, 6), (0x2C, 4)) for place in range(places)]
        for place, channel in enumerate(order[:ranks]):
            self.chip.rule(self.chip.a.is_analogue(channel), f"PA{channel} is not analogue (8.3.12)")
            code = self.chip.world.analogue(channel, place // 4)
            is_lost = (self.chip.ticks, place) in self.chip.options.lost_transfers
            if self.held[0] & self.OVERRUN or is_lost or not self.chip.dma.bring(0, 0, struct.pack("<H", code)):
                # No further requests until it is cleared (13.8.2).
                self.held[0] |= self.OVERRUN


class ValveSense(Unit):
    """ADC2: what the valve's amplifier puts out."""

    base, bytes, name, clock = 0x4001_2100, 0x100, "ADC2", (0x44, 9)

    def __init__(self, chip):
        super().__init__(chip)
        self.on_ns, self.converting = 0.0, False

    def read(self, offset):
        if offset == 0x4C:
            self.held[0] &= ~2
        return self.held[offset]

    def write(self, offset, value):
        chip = self.chip
        if offset == 0:
            value &= self.held[0]
        if offset == 8:
            if self.set_bits(8, value) & 1:
                self.on_ns = chip.core.now()
            if value & 1 << 30:
                chip.rule(not self.converting, "ADC2 started while it converts (13.3.4)")
                chip.rule(chip.core.now() - self.on_ns >= 3e3, "ADC2 started before it was stable, 3 us (13.3.1)")
                self.converting = True
                clock_ns = 8e9 / chip.rcc.apb2_hz() / 2
                chip.core.after(28 * clock_ns, self._sampled)
                chip.core.after(40 * clock_ns, self._converted)
                value &= ~(1 << 30)
        self.held[offset] = value

    def _sampled(self):
        volts, wanted = self.chip.amplifier_v(), self.chip.amplifier_wants_v()
        self.chip.rule(abs(volts - wanted) < SETTLED_V,
                       "the valve's voltage is sampled before it has settled (docs/hardware.md, Output)")
        self.chip.middle_was_read |= self.chip.dac.is_on() and abs(volts - 5.0) < SETTLED_V
        self.sampled = volts if self.chip.options.valve_shorted_at > self.chip.ticks else 0.0

    def _converted(self):
        self.converting = False
        self.held[0] |= 2
        self.held[0x4C] = min(4095, max(0, round(self.sampled / FULL_SCALE_V * 4095)))


class Dma(Unit):
    """RM0090 section 10: DMA2, streams 0 and 5."""

    base, name, clock = 0x4002_6400, "DMA2", (0x30, 22)
    SHIFTS = (0, 6, 16, 22)

    def __init__(self, chip):
        super().__init__(chip)
        self.lengths = {}

    @staticmethod
    def stream(offset):
        """Stream and register of an offset."""
        return (offset - 0x10) // 0x18, (offset - 0x10) % 0x18

    def flags(self, stream):
        """Flags of a stream, its bits 0 to 5."""
        return self.held[4 * (stream // 4)] >> self.SHIFTS[stream % 4] & 0x3D

    def raise_flag(self, stream, flag):
        """Raises a flag, and the interrupt that asks for it."""
        self.held[4 * (stream // 4)] |= flag << self.SHIFTS[stream % 4]
        # Enable bits of direct mode, transfer error, half and complete stand where the flags do.
        control = self.held[0x10 + 0x18 * stream]
        wanted = (control & 0x1E) << 1 if flag > 1 else 0
        if wanted & flag and stream == 0:
            self.chip.core.pend(16 + DMA2_STREAM0_INTERRUPT)

    def write(self, offset, value):
        if offset in (8, 12):
            self.held[offset - 8] &= ~value
            return
        stream, register = self.stream(offset)
        first = 0x10 + 0x18 * stream
        is_on = self.held[first] & 1
        if register == 0 and not is_on and value & 1:
            self._starts(stream, value)
        self.chip.rule(register not in (4, 8, 12) or not is_on, "DMA stream changed while it is on (10.3.17)")
        self.held[offset] = value

    def _starts(self, stream, control):
        first, chip = 0x10 + 0x18 * stream, self.chip
        width = 1 << (control >> 13 & 3)
        chip.rule(self.held[first + 12] % width == 0, "DMA to an address that is not aligned (10.3.10)")
        chip.rule(self.held[first + 4], "DMA of no transfers (10.3.17)")
        chip.rule(not self.flags(stream), "DMA stream on with flags set (10.3.17)")
        self.lengths[stream] = self.held[first + 4]

    def bring(self, stream, channel, data):
        """A unit's request: whether somebody takes it."""
        first = 0x10 + 0x18 * stream
        control, left = self.held[first], self.held[first + 4]
        if not control & 1 or control >> 25 & 7 != channel:
            return False
        target = self.held[first + 12] + len(data) * (self.lengths[stream] - left)
        if self.chip.rule(RAM <= target < RAM + RAM_BYTES, f"DMA to {target:08x}, which it does not reach (2.1)"):
            self.chip.core.engine.mem_write(target, data)
        self.held[first + 4] = left - 1 or self.lengths[stream]
        if left == 1:
            self.raise_flag(stream, 0x20)
        return True


class Dac(Unit):
    """RM0090 section 14: channel 1 on PA4."""

    base, name, clock = 0x4000_7400, "DAC", (0x40, 29)
    DHR, DOR = 0x08, 0x2C

    def __init__(self, chip):
        super().__init__(chip)
        self.changed_ns, self.from_v = 0.0, 0.0

    def is_on(self):
        """EN1."""
        return self.held[0] & 1

    def write(self, offset, value):
        chip = self.chip
        if offset == 0 and self.set_bits(0, value) & 1:
            chip.rule(chip.a.is_analogue(4), "DAC on while PA4 is not analogue (14.2)")
            chip.mark(f"DAC on at {self.held[self.DHR]:03x}")
        self.held[offset] = value & 0xFFF if offset == self.DHR else value
        if offset == self.DHR:
            if not self.held[0] & 4:
                chip.core.after(1e9 / chip.rcc.apb1_hz(), self.put_out)
            if chip.ticks:
                chip.world.commanded(self.held[self.DHR])

    def triggered(self):
        """The timer's edge."""
        if self.held[0] & 4 and self.held[0] >> 3 & 7 == 4:
            self.chip.core.after(3e9 / self.chip.rcc.apb1_hz(), self.put_out)

    def put_out(self):
        """The held code goes to the output."""
        if self.chip.options.dac_stuck_at > self.chip.ticks:
            self.held[self.DOR] = self.held[self.DHR]
            self.chip.amplifier_follows()


class Spi(Unit):
    """RM0090 section 28: SPI2, the position converter's bus."""

    base, name, clock = 0x4000_3800, "SPI2", (0x40, 14)
    FUNCTION = 5

    def __init__(self, chip):
        super().__init__(chip)
        self.waiting = self.shifting = None
        self.received, self.has_received = 0, False

    def read(self, offset):
        if offset == 8:
            if not self.has_received and self.shifting is not None:
                self.chip.core.skip()
            return self.has_received | (self.waiting is None) << 1 | (self.shifting is not None) << 7
        if offset == 12:
            self.chip.rule(self.has_received, "SPI2 data read where there are none (28.3.7)")
            self.has_received = False
            return self.received
        return self.held[offset]

    def write(self, offset, value):
        if offset != 12:
            self.held[offset] = value
            return
        chip = self.chip
        chip.rule(self.held[0] & 0x40, "SPI2 used while it is off (28.3.3)")
        chip.rule(self.waiting is None, "SPI2 data written while full (28.3.7)")
        self.waiting = value & 0xFF
        if self.shifting is None:
            self._shift()

    def _shift(self):
        self.shifting, self.waiting = self.waiting, None
        divider = 2 << (self.held[0] >> 3 & 7)
        self.chip.core.after(8e9 * divider / self.chip.rcc.apb1_hz(), self._shifted)

    def _shifted(self):
        chip = self.chip
        wired = all(chip.b.has_function(pin, self.FUNCTION) for pin in (13, 14, 15))
        chip.rule(wired, "SPI2 shifts while its pins are not its own (8.3.2)")
        chip.rule(not self.has_received, "SPI2 overrun (28.3.10)")
        self.received = chip.position.exchange(self.shifting) if wired else 0
        self.has_received, self.shifting = True, None
        if self.waiting is not None:
            self._shift()


class PositionConverter:
    """The ADS8681 behind SPI2, by its data sheet SBAS633."""

    CONVERSION_NS = 665

    def __init__(self, chip):
        self.chip = chip
        self.is_selected = False
        self.range, self.control = 0, 0
        self.converted, self.converted_ns = 0, -1e9
        self.out, self.command, self.count = 0, 0, 0

    def select(self, is_selected):
        """PB12, low selects."""
        chip, now = self.chip, self.chip.core.now()
        chip.rule(chip.spi.shifting is None, "position converter selected while the bus shifts")
        if is_selected:
            chip.rule(now - self.converted_ns >= self.CONVERSION_NS, "position converter asked before it has converted")
            flags = self.range << 10 if self.control & 0x100 else 0
            self.out, self.command, self.count = self.converted << 16 | flags, 0, 0
        elif self.is_selected:
            chip.rule(self.count == 4, f"position converter: a frame of {self.count} bytes")
            self._execute()
            self.converted, self.converted_ns = chip.world.position(), now
        self.is_selected = is_selected

    def _execute(self):
        code, register, value = self.command >> 24, self.command >> 16 & 0xFF, self.command & 0xFFFF
        if code & 0xFE == 0xD0 and self.chip.core.now() >= self.chip.options.position_ready_ns:
            if register == 0x14:
                self.range = value & 15
            if register == 0x10:
                self.control = value

    def exchange(self, byte):
        """A byte in, a byte out."""
        if not self.is_selected:
            return 0
        # An open wire is held low.
        is_open = self.chip.options.position_open_at <= self.chip.ticks
        answer = 0 if is_open else self.out >> 24 & 0xFF
        self.out = self.out << 8 & 0xFFFF_FFFF
        self.command = (self.command << 8 | byte) & 0xFFFF_FFFF
        self.count += 1
        return answer


class Usart(Unit):
    """RM0090 section 30: USART1, the serial line."""

    base, name, clock = 0x4001_1000, "USART1", (0x44, 4)

    def __init__(self, chip):
        super().__init__(chip)
        self.waiting = self.shifting = None
        self.incoming, self.is_receiving = collections.deque(), False
        self.received, self.is_idle = 0, False
        self.was_status_read = False

    def read(self, offset):
        if offset == 0:
            self.was_status_read = True
            is_empty = self.waiting is None
            if not is_empty:
                self.chip.core.skip()
            is_complete = is_empty and self.shifting is None
            return is_empty << 7 | is_complete << 6 | self.is_idle << 4
        if offset == 4:
            self.is_idle &= not self.was_status_read
            self.was_status_read = False
            return self.received
        return self.held[offset]

    def write(self, offset, value):
        if offset != 4:
            self.held[offset] = value
            return
        self.chip.rule(self.waiting is None, "USART1 data written while full: a byte is lost (30.3.2)")
        self.waiting = value & 0xFF
        if self.shifting is None:
            self._shift()

    def byte_ns(self):
        """Start, eight bits, stop."""
        return 10e9 * self.held[8] / self.chip.rcc.apb2_hz()

    def _shift(self):
        self.shifting, self.waiting = self.waiting, None
        self.chip.core.after(self.byte_ns(), self._shifted)

    def _shifted(self):
        byte, self.shifting = self.shifting, None
        if self.waiting is not None:
            self._shift()
        self.chip.world.sent(byte)

    def send(self, data):
        """Bytes from outside."""
        self.incoming.extend(data)
        if not self.is_receiving and self.incoming:
            self.is_receiving = True
            self.chip.core.after(self.byte_ns(), self._arrived)

    def _arrived(self):
        self.received = self.incoming.popleft()
        is_taken = self.held[0x14] & 0x40 and self.chip.dma.bring(5, 4, bytes([self.received]))
        self.chip.rule(is_taken, "USART1: a byte came that nobody takes (30.3.13)")
        if self.incoming:
            self.chip.core.after(self.byte_ns(), self._arrived)
        else:
            self.is_receiving = False
            self.chip.core.after(self.byte_ns(), self._idle)

    def _idle(self):
        if not self.is_receiving:
            self.is_idle = True
            if self.held[0x0C] & 0x10:
                self.chip.core.pend(16 + USART1_INTERRUPT)


class Watchdog(Unit):
    """RM0090 section 21: IWDG."""

    base, name = 0x4000_3000, "IWDG"

    def __init__(self, chip):
        super().__init__(chip)
        self.is_open, self.updated_ns = False, 0.0
        self.fed, self.fed_ns = 0, None
        self.longest = 0.0

    def reset_values(self):
        return {8: 0xFFF}

    def read(self, offset):
        return 3 if offset == 12 and self.chip.core.now() < self.updated_ns else self.held[offset]

    def time_ns(self):
        """Until it bites."""
        return (self.held[8] + 1) * (4 << min(self.held[4], 6)) * 1e9 / self.chip.options.watchdog_hz

    def write(self, offset, value):
        core = self.chip.core
        if offset == 0:
            self.is_open = value & 0xFFFF == 0x5555
            if value & 0xFFFF in (0xCCCC, 0xAAAA):
                self._feed()
            return
        self.chip.rule(self.is_open, "IWDG written while it is locked (21.3.2)")
        self.chip.rule(core.now() >= self.updated_ns or self.held[offset] == value or offset == 8,
                       "IWDG written while its update is under way (21.4.4)")
        self.held[offset] = value
        self.updated_ns = core.now() + 5e9 / self.chip.options.watchdog_hz

    def _feed(self):
        core = self.chip.core
        if self.fed_ns is not None:
            self.longest = max(self.longest, (core.now() - self.fed_ns) / self.limit_ns)
        self.fed += 1
        self.fed_ns, self.limit_ns = core.now(), self.time_ns()
        core.after(self.limit_ns, self._bite, self.fed)

    def _bite(self, fed):
        if fed == self.fed:
            raise Stopped("the watchdog resets the chip")


class System(Unit):
    """ARMv7-M B3: interrupt controller, system control, SysTick; and the cycle counter."""

    base, bytes, name = 0xE000_0000, 0x10_0000, "system"
    CYCLES, CONTROL, RELOAD, AIRCR, VTOR = 0x1004, 0xE010, 0xE014, 0xED0C, 0xED08

    def __init__(self, chip):
        super().__init__(chip)
        self.timer = 0

    def reset_values(self):
        return {0xED00: 0x410F_C241}

    def read(self, offset):
        return self.chip.core.cycles & 0xFFFF_FFFF if offset == self.CYCLES else self.held[offset]

    def write(self, offset, value):
        core = self.chip.core
        for first, apply in ((0xE100, core.enabled.add), (0xE180, core.enabled.discard),
                             (0xE200, lambda one: core.pend(16 + one)), (0xE280, lambda one: core.pending.discard(16 + one))):
            if first <= offset < first + 0x20:
                for bit in range(32):
                    if value >> bit & 1:
                        apply((offset - first) * 8 + bit)
                return
        if offset == self.AIRCR and value == 0x05FA_0004:
            raise Stopped(RESET)
        self.held[offset] = value
        if offset == self.CONTROL:
            self.timer += 1
            if value & 1:
                self._wait(self.timer)

    def set_priority(self, offset, value, size):
        """Priorities are bytes."""
        for place in range(size):
            byte, at = value >> 8 * place & 0xF0, offset + place
            exception = 16 + at - 0xE400 if at >= 0xE400 and at < 0xE500 else 4 + at - 0xED18
            self.chip.core.priority[exception] = byte

    def _wait(self, timer):
        self.chip.core.after((self.held[self.RELOAD] + 1) * 1e9 / self.chip.core.hz, self._elapsed, timer)

    def _elapsed(self, timer):
        if timer != self.timer:
            return
        self._wait(timer)
        if self.held[self.CONTROL] & 2:
            self.chip.core.pend(SYSTICK)


def raise_later(chip, reason):
    """Ends the run at the next chance."""
    chip.core.ended = reason
    chip.core.engine.emu_stop()


class Chip:
    """All units, the circuit behind them, and what was noted."""

    # 15 kOhm and 1 nF before the valve's amplifier (docs/hardware.md, Output).
    AMPLIFIER_NS = 15e3

    def __init__(self, image, world, options):
        self.options, self.world = options, world
        self.misuses, self.marks = collections.Counter(), []
        self.ticks, self.tick_ns = 0, 0.0
        self.middle_was_read = False
        self.costs, self._entered = [], 0
        self.amplifier = (0.0, 5.0, 5.0)
        self.rcc, self.power, self.flash = Rcc(self), Power(self), FlashUnit(self)
        self.a, self.b, self.c = Port(self, "A", 0, 0xA800_0000), Port(self, "B", 1, 0x280), Port(self, "C", 2, 0)
        self.timer, self.sensors, self.valve_sense = Timer(self), Sensors(self), ValveSense(self)
        self.adc_common = Unit(self)
        self.adc_common.base, self.adc_common.bytes = 0x4001_2300, 0x100
        self.dma, self.dac, self.spi, self.usart = Dma(self), Dac(self), Spi(self), Usart(self)
        self.watchdog, self.system = Watchdog(self), System(self)
        self.position = PositionConverter(self)
        self.units = [one for one in vars(self).values() if isinstance(one, Unit)]
        self.fresh = {}
        self.core = Core(image, self)
        if options.slots:
            with open(options.slots, "rb") as file:
                self.core.engine.mem_write(SECTORS[2], file.read(2 * SLOT_BYTES))
        world.chip = self

    def slots(self):
        """The bytes of both slots of settings."""
        self.flash.settle()
        return bytes(self.core.engine.mem_read(SECTORS[2], 2 * SLOT_BYTES))

    # notes

    def rule(self, is_kept, what):
        """Notes a misuse where a rule is not kept; whether it is."""
        if not is_kept:
            self.misuses[what] += 1
        return bool(is_kept)

    def mark(self, what):
        """Notes what happened when, us."""
        self.marks.append((self.core.now() / 1e3, what))

    # the core's bus

    def unit(self, address):
        """The unit at an address."""
        for unit in self.units:
            if unit.base <= address < unit.base + unit.bytes:
                return unit
        self.rule(False, f"nothing is modelled at {address:08x}")
        return Unit(self)

    def read(self, address):
        """A load."""
        unit = self.unit(address)
        self._used(unit)
        return unit.read(address - unit.base)

    def stored(self, address):
        """What a register holds."""
        unit = self.unit(address)
        return unit.held[address - unit.base]

    def write(self, address, value, size=4):
        """A store."""
        unit = self.unit(address)
        self._used(unit)
        offset = address - unit.base
        if unit is self.system and (0xE400 <= offset < 0xE500 or 0xED18 <= offset < 0xED24):
            self.system.set_priority(offset, value, size)
        else:
            unit.write(offset, value)

    def is_whole(self, address):
        """Whether a store of bytes or half words there is taken as it is."""
        return self.unit(address) in (self.system, self.watchdog)

    def program(self, *store):
        """A store to the flash."""
        self.flash.program(*store)

    def vector_table(self):
        """Where the vectors are."""
        return self.system.held[System.VTOR]

    def entered(self, exception):
        """An exception was taken."""
        if exception == 16 + DMA2_STREAM0_INTERRUPT:
            self._entered = self.core.cycles

    def left(self, exception):
        """An exception has ended."""
        if exception == 16 + DMA2_STREAM0_INTERRUPT:
            self.costs.append(self.core.cycles - self._entered)

    # clocks

    def clock_enabled(self, register, bits):
        """The clocks of these units are on from now on."""
        for unit in self.units:
            if unit.clock and unit.clock[0] == register and bits >> unit.clock[1] & 1:
                self.fresh[unit.name] = self.core.barriers

    def _used(self, unit):
        if unit.clock is None:
            return
        register, bit = unit.clock
        self.rule(self.rcc.held[register] >> bit & 1, f"{unit.name} used without its clock (7.3)")
        since = self.fresh.pop(unit.name, None)
        if since is not None:
            self.rule(self.core.barriers > since,
                      f"{unit.name} used right after its clock came, without a barrier (ES0182, delay after an RCC peripheral clock enabling)")

    # pins and the circuit

    def pins_changed(self, port, changed, levels):
        """Output pins of a port."""
        if port is not self.b:
            return
        if changed >> 12 & 1:
            self.position.select(not levels >> 12 & 1)
        if changed >> 9 & 1:
            self._switched(levels >> 9 & 1)

    def _switched(self, is_joined):
        self.mark(f"valve {'given to the converter' if is_joined else 'at the middle of the hardware'}")
        if is_joined:
            self.rule(self.middle_was_read, "PB9 up before the middle was read back (docs/hardware.md, Output)")
            self.rule(self.ticks or self.dac.held[Dac.DOR] == 0x800, "PB9 up while the converter is not at the middle")
        self.amplifier_follows()

    def amplifier_wants_v(self):
        """What the amplifier's input goes to."""
        if self.b.level(9):
            return self.dac.held[Dac.DOR] / 4095 * FULL_SCALE_V
        return 0.5 * FULL_SCALE_V

    def amplifier_v(self):
        """What it puts out now."""
        since, begun_v, wanted_v = self.amplifier
        return wanted_v + (begun_v - wanted_v) * math.exp(-(self.core.now() - since) / self.AMPLIFIER_NS)

    def amplifier_follows(self):
        """Its input has changed now."""
        self.amplifier = (self.core.now(), self.amplifier_v(), self.amplifier_wants_v())
