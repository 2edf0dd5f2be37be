"""The processor: instructions by the Unicorn engine, time, interrupts and exceptions.

Unicorn executes the instructions of a Cortex-M4; what it leaves out is here: the interrupt
controller with its priorities, entry and return with the plain or the floating-point frame
(ARMv7-M Architecture Reference Manual, B1.5), sleep, and a clock. Interrupts are taken between
basic blocks.

Time is an estimate: every instruction takes `CYCLES_PER_INSTRUCTION`, waits of the flash included.
"""

import collections
import heapq
import struct

import unicorn
from unicorn import arm_const as arm

FLASH, FLASH_BYTES = 0x0800_0000, 0x10_0000
RAM, RAM_BYTES = 0x2000_0000, 0x2_0000
CORE_RAM, CORE_RAM_BYTES = 0x1000_0000, 0x1_0000
# Returns from an exception go to addresses from here on.
RETURNS = 0xFFFF_F000

CYCLES_PER_INSTRUCTION = 2
# Entry and return of an exception take so many cycles each (Cortex-M4 TRM, 3.9).
CYCLES_OF_EXCEPTION = 12
FIRST_INTERRUPT = 16
IT_BITS = 0x0600_FC00
ALIGNED = 1 << 9
THUMB = 1 << 24
WFI = b"\x30\xbf"
DSB = b"\xbf\xf3\x4f\x8f"

LOW = [arm.UC_ARM_REG_R0, arm.UC_ARM_REG_R1, arm.UC_ARM_REG_R2, arm.UC_ARM_REG_R3, arm.UC_ARM_REG_R12]
FLOATS = [arm.UC_ARM_REG_S0 + number for number in range(16)]


class Stopped(Exception):
    """The run is over, and why."""


class Core:
    """Processor, memory and time. `bus` has `read(address)` and `write(address, value)`."""

    def __init__(self, image, bus):
        self.bus = bus
        self.cycles = 0
        self.instructions = 0
        # Barriers (DSB) that were executed.
        self.barriers = 0
        self.hz = 16e6
        self._ns_at, self._cycles_at = 0.0, 0
        self._events, self._number = [], 0
        self.enabled, self.pending = set(), set()
        self.priority = collections.defaultdict(int)
        self.active = []
        self.taken = collections.Counter()
        self.ended = None
        self._resumed_at = None
        self._returning = False
        self._counts = {}
        self.engine = self._engine(image)

    def _engine(self, image):
        engine = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
        engine.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        for begin, size in ((FLASH, FLASH_BYTES), (RAM, RAM_BYTES), (CORE_RAM, CORE_RAM_BYTES), (RETURNS, 0x1000)):
            engine.mem_map(begin, size)
        engine.mem_write(FLASH, b"\xff" * FLASH_BYTES)
        # Memory holds anything after power-up.
        engine.mem_write(RAM, b"\xa5" * RAM_BYTES)
        for address, data in segments(image):
            engine.mem_write(address, data)
            for place in range(0, len(data) - 3, 2):
                if data[place : place + 4] == DSB:
                    at = address + place
                    engine.hook_add(unicorn.UC_HOOK_CODE, self._barrier, begin=at, end=at)
        engine.hook_add(unicorn.UC_HOOK_BLOCK, self._block)
        engine.hook_add(unicorn.UC_HOOK_INTR, self._interrupted)
        engine.hook_add(unicorn.UC_HOOK_MEM_WRITE, self._flash_written, begin=FLASH, end=FLASH + FLASH_BYTES - 1)
        for begin, size in ((0x4000_0000, 0x8_0000), (0x4200_0000, 0x100_0000), (0xE000_0000, 0x10_0000)):
            engine.mmio_map(begin, size, self._reader(begin), None, self._writer(begin), None)
        return engine

    # time

    def now(self):
        """ns since power-up."""
        return self._ns_at + (self.cycles - self._cycles_at) * 1e9 / self.hz

    def change_clock(self, hz):
        """From now on the core runs at this clock."""
        self._ns_at, self._cycles_at, self.hz = self.now(), self.cycles, hz

    def after(self, ns, what, *arguments):
        """Calls `what` so much later."""
        self.at(self.now() + ns, what, *arguments)

    def at(self, ns, what, *arguments):
        """Calls `what` then."""
        self._number += 1
        heapq.heappush(self._events, (ns, self._number, what, arguments))

    def wait(self, ns):
        """The core stands still."""
        self.cycles += int(ns * 1e-9 * self.hz)

    def skip(self):
        """The program waits for a flag: time goes on to the next event."""
        if self._events:
            self.cycles += max(0, int((self._events[0][0] - self.now()) * self.hz / 1e9))

    def _is_due(self):
        return bool(self._events) and self._events[0][0] <= self.now()

    def _happen(self):
        while self._is_due():
            _, _, what, arguments = heapq.heappop(self._events)
            what(*arguments)

    def _sleep(self):
        while not self._next_exception():
            if not self._events:
                raise Stopped("asleep for ever")
            self.cycles += max(0, int((self._events[0][0] - self.now()) * self.hz / 1e9) + 1)
            self._happen()

    # run

    def run(self, until):
        """Runs from reset until `until()` or the end, which is told."""
        stack, start = struct.unpack("<2I", bytes(self.engine.mem_read(FLASH, 8)))
        self.engine.reg_write(arm.UC_ARM_REG_SP, stack)
        self.engine.reg_write(arm.UC_ARM_REG_PC, start)
        try:
            while not until():
                self._step()
        except Stopped as reason:
            self.ended = str(reason)
        return self.ended

    def _step(self):
        engine = self.engine
        at = engine.reg_read(arm.UC_ARM_REG_PC)
        self._resumed_at = at
        try:
            engine.emu_start(at | 1, 0)
        except unicorn.UcError as error:
            at = engine.reg_read(arm.UC_ARM_REG_PC)
            if at < RETURNS and not self._returning:
                raise Stopped(f"{error} at {at:08x}") from error
        if self.ended:
            raise Stopped(self.ended)
        at = engine.reg_read(arm.UC_ARM_REG_PC)
        if self._returning or at >= RETURNS:
            self._returning = False
            self._leave(at)
        elif bytes(engine.mem_read(at - 2, 2)) == WFI and self._slept:
            self._sleep()
        self._happen()
        self._serve()

    _slept = False

    def _block(self, engine, address, size, _):
        if address >= RETURNS:
            self._returning = True
            engine.emu_stop()
            return
        is_resumed = address == self._resumed_at
        self._resumed_at = None
        if not is_resumed and (self._is_due() or self._next_exception()):
            if not engine.reg_read(arm.UC_ARM_REG_XPSR) & IT_BITS:
                engine.emu_stop()
                return
        count, self._slept = self._count(engine, address, size)
        self.instructions += count
        self.cycles += count * CYCLES_PER_INSTRUCTION

    def _count(self, engine, address, size):
        """Instructions of a block, and whether it ends with a sleep."""
        known = self._counts.get((address, size))
        if known is None:
            code = bytes(engine.mem_read(address, size))
            place = count = 0
            while place < size:
                place += 4 if code[place + 1] >> 3 in (0b11101, 0b11110, 0b11111) else 2
                count += 1
            known = self._counts[(address, size)] = (count, code[-2:] == WFI)
        return known

    def _barrier(self, *_):
        self.barriers += 1

    def _interrupted(self, engine, number, _):
        """8 is the engine's number of a return from an exception."""
        if number == 8:
            self._returning = True
        else:
            at = engine.reg_read(arm.UC_ARM_REG_PC)
            self.ended = f"exception {number} of the processor at {at:08x}"
        engine.emu_stop()

    # exceptions

    def pend(self, exception):
        """Raises an exception or, from 16 on, an interrupt."""
        self.pending.add(exception)

    def _priority(self, exception):
        return -2 if exception == 2 else -1 if exception == 3 else self.priority[exception]

    def _next_exception(self):
        """The exception that is to be taken now, with its priority."""
        if not self.pending:
            return None
        ready = [
            (self._priority(one), one)
            for one in self.pending
            if one < FIRST_INTERRUPT or one - FIRST_INTERRUPT in self.enabled
        ]
        if not ready:
            return None
        first = min(ready)
        engine = self.engine
        current = min((priority for _, priority in self.active), default=256)
        base = engine.reg_read(arm.UC_ARM_REG_BASEPRI) & 0xF0
        current = min(current, base or 256)
        if engine.reg_read(arm.UC_ARM_REG_PRIMASK) & 1:
            # A masked interrupt still ends a sleep.
            current = min(current, 0)
        return first if first[0] < current else None

    def _serve(self):
        while exception := self._next_exception():
            self._enter(*exception)

    def _enter(self, priority, exception):
        read, write = self.engine.reg_read, self.engine.reg_write
        control = read(arm.UC_ARM_REG_CONTROL)
        has_floats = bool(control & 4)
        level = self.active[-1][0] if self.active else 0
        status = (read(arm.UC_ARM_REG_XPSR) & ~(0x3FF | ALIGNED)) | level | THUMB
        stack = read(arm.UC_ARM_REG_SP)
        if stack & 4:
            stack -= 4
            status |= ALIGNED
        frame = [read(one) for one in LOW]
        frame += [read(arm.UC_ARM_REG_LR), read(arm.UC_ARM_REG_PC) & ~1, status]
        if has_floats:
            frame += [read(one) for one in FLOATS] + [read(arm.UC_ARM_REG_FPSCR), 0]
        data = struct.pack(f"<{len(frame)}I", *frame)
        stack -= len(data)
        self.engine.mem_write(stack, data)
        back = (0xFFFF_FFE1 if has_floats else 0xFFFF_FFF1) | (0 if self.active else 8)
        self.active.append((exception, priority))
        self.pending.discard(exception)
        table = self.bus.vector_table() or FLASH
        (vector,) = struct.unpack("<I", bytes(self.engine.mem_read(table + 4 * exception, 4)))
        write(arm.UC_ARM_REG_SP, stack)
        write(arm.UC_ARM_REG_LR, back)
        write(arm.UC_ARM_REG_CONTROL, control & ~4)
        write(arm.UC_ARM_REG_XPSR, THUMB | exception)
        write(arm.UC_ARM_REG_PC, vector | 1)
        self.taken[exception] += 1
        self.cycles += CYCLES_OF_EXCEPTION
        self.bus.entered(exception)

    def _leave(self, at):
        read, write = self.engine.reg_read, self.engine.reg_write
        back = at | 1 if at >= RETURNS else read(arm.UC_ARM_REG_LR)
        if not self.active:
            raise Stopped("a return from an exception that was not entered")
        exception, _ = self.active.pop()
        stack = read(arm.UC_ARM_REG_SP)
        frame = struct.unpack("<8I", bytes(self.engine.mem_read(stack, 32)))
        stack += 32
        control = read(arm.UC_ARM_REG_CONTROL) & ~4
        if not back & 0x10:
            floats = struct.unpack("<17I", bytes(self.engine.mem_read(stack, 68)))
            stack += 72
            for register, value in zip(FLOATS + [arm.UC_ARM_REG_FPSCR], floats):
                write(register, value)
            control |= 4
        status = frame[7]
        level = self.active[-1][0] if self.active else 0
        if status & 0x1FF != level:
            raise Stopped("a return to another level than the exception came from")
        write(arm.UC_ARM_REG_SP, stack + (4 if status & ALIGNED else 0))
        for register, value in zip(LOW + [arm.UC_ARM_REG_LR], frame):
            write(register, value)
        write(arm.UC_ARM_REG_XPSR, status & ~ALIGNED)
        write(arm.UC_ARM_REG_CONTROL, control)
        write(arm.UC_ARM_REG_PC, frame[6] | 1)
        self.cycles += CYCLES_OF_EXCEPTION
        self.bus.left(exception)

    # the bus

    def _reader(self, begin):
        def read(_, offset, size, __):
            address = begin + offset
            if begin == 0x4200_0000:
                address, bit = bit_of(offset)
                return self.bus.read(address) >> bit & 1
            word = self.bus.read(address & ~3)
            return word >> 8 * (address & 3) & (1 << 8 * size) - 1

        return read

    def _writer(self, begin):
        def write(_, offset, size, value, __):
            address = begin + offset
            if begin == 0x4200_0000:
                address, bit = bit_of(offset)
                old = self.bus.stored(address)
                value = old & ~(1 << bit) | (value & 1) << bit
            elif size < 4 and not self.bus.is_whole(address):
                shift = 8 * (address & 3)
                mask = (1 << 8 * size) - 1 << shift
                address &= ~3
                value = self.bus.stored(address) & ~mask | value << shift & mask
            self.bus.write(address, value & 0xFFFF_FFFF, size)

        return write

    def _flash_written(self, engine, _, address, size, value, __):
        held = bytes(engine.mem_read(address & ~3, 4))
        self.bus.program(address, size, value & 0xFFFF_FFFF, held)


def bit_of(offset):
    """Word and bit of the peripherals that a word of the bit band stands for."""
    byte = 0x4000_0000 + (offset >> 5)
    return byte & ~3, (byte & 3) * 8 + (offset >> 2 & 7)


def segments(path):
    """What an ELF file of 32 bits loads: physical address and data."""
    with open(path, "rb") as file:
        data = file.read()
    if data[:5] != b"\x7fELF\x01":
        raise SystemExit(f"{path}: no ELF file of 32 bits; make one with `cargo xtask image`")
    (begin,) = struct.unpack_from("<I", data, 28)
    size, count = struct.unpack_from("<2H", data, 42)
    for number in range(count):
        kind, offset, _, address, length = struct.unpack_from("<5I", data, begin + number * size)
        if kind == 1 and length:
            yield address, data[offset : offset + length]
