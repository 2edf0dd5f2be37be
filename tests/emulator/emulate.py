"""Runs the flash image of the STM32F405, the file of `cargo xtask image`, on modelled registers.

Exit status 1 where the program misused a unit, or the run ended early.
"""

import argparse
import collections
import json
import socket
import struct
import sys
import time

import link
from chip import HARD_FAULT, RESET, Chip
from core import RAM, RAM_BYTES

NEVER = 1 << 40
# Reset flags of a reset that the program asked for (RM0090 7.3.21).
SOFTWARE_RESET = 0x1400_0000
# Ticks between questions for the status.
ASKED_EVERY = 40
# A plant that says nothing for so long has gone.
PLANT_WITHIN_S = 60.0
# At rest in the middle, the chambers at 4 bar, the supply at 6: codes of the link.
RESTING = (32768, 26208, 26208, 39320, 32768)


class World:
    """What the converters see, and the other end of the serial line."""

    def __init__(self, codes=RESTING):
        self.chip = None
        self.codes = codes
        self.frames = link.Frames()
        self.commands, self.records, self.statuses = [], [], []
        self.crash = None
        self.first_command_us = None

    def position(self):
        """Raw code of the position converter: the sensor's 10 V are 125/128 of its 10.24 V."""
        raw = 0x8000 + round((self.codes[0] - 0x8000) * 125 / 128)
        return min(0xFFFF, max(0, raw))

    def analogue(self, channel, turn):
        """12 bits of a channel in one of its four turns, whose sum is the code's upper 14 bits."""
        return min(4095, ((self.codes[1 + channel] >> 2) + turn) >> 2)

    def begins(self):
        """The ticks begin."""

    def ticks(self):
        """A tick has begun."""
        if self.chip.ticks % ASKED_EVERY == 0:
            self.chip.usart.send(link.encode(bytes([link.ASK_STATUS])))
        elif self.chip.ticks % ASKED_EVERY == 20:
            self.chip.usart.send(link.encode(bytes([link.ASK_CRASH])))

    def commanded(self, code):
        """The converter's register was written."""
        if self.first_command_us is None:
            self.first_command_us = self.chip.core.now() / 1e3
        self.commands.append(code)

    def sent(self, byte):
        """The board has sent a byte."""
        for payload in self.frames.take(bytes([byte])):
            self.told(payload)

    def told(self, payload):
        """The board has sent a frame."""
        if payload[0] == link.STATUS:
            self.statuses.append(payload)
        elif payload[0] == link.TICK:
            self.records.append(payload)
        elif payload[0] == link.CRASH:
            self.crash = payload

    def fault(self):
        """Code and detail of the last status."""
        return tuple(self.statuses[-1][3:5]) if self.statuses else None


class Sender(World):
    """Sends payloads over the serial line, each when the one before was answered."""

    def __init__(self, path):
        super().__init__()
        with open(path, encoding="ascii") as file:
            self.waiting = [bytes.fromhex(line) for line in file.read().split()]
        self.answers = []

    def begins(self):
        # After the greeting's last byte, and when the observer has settled.
        self.chip.core.after(2e7, self._next)

    def _next(self):
        if self.waiting:
            self.chip.usart.send(link.encode(self.waiting.pop(0)))

    def told(self, payload):
        super().told(payload)
        if payload[0] not in (link.HELLO, link.STATUS, link.TICK, link.CRASH):
            self.answers.append(payload.hex())
            self._next()


class Plant(World):
    """The plant of `pneuma loop --connect`: the image is in the controller's place."""

    def __init__(self, port):
        super().__init__()
        listener = socket.create_server(("127.0.0.1", port))
        listener.settimeout(PLANT_WITHIN_S)
        print(f"waiting for a plant at 127.0.0.1:{listener.getsockname()[1]}", flush=True)
        self.line, _ = listener.accept()
        self.line.settimeout(PLANT_WITHIN_S)
        self.line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.incoming, self.waiting = link.Frames(), []
        self.sample, self.is_sampled = None, False
        # Samples that the board has answered and not yet told of, each with its command.
        self.unrecorded = collections.deque()
        self.last_told = bytes(18)
        self.transcript = []
        self.hello = None

    def begins(self):
        self.chip.usart.send(link.encode(struct.pack("<BH", link.STREAM, 1)))
        # After the greeting's last byte.
        self.chip.core.after(3e5, self._next)

    def ticks(self):
        self.chip.rule(not self.chip.usart.incoming, "model: a reference came later than its tick")
        self.codes = struct.unpack_from("<5H", self.sample, 5)
        self.is_sampled = True

    def commanded(self, code):
        super().commanded(code)
        if self.is_sampled:
            self.is_sampled = False
            self.unrecorded.append((self.sample, code))
            self._answer(code)

    def told(self, payload):
        super().told(payload)
        if payload[0] == link.HELLO:
            self.hello = payload
            self.line.sendall(link.encode(payload))
        elif payload[0] == link.TICK and self.unrecorded:
            self._record(payload)

    def _answer(self, code):
        """Tells the plant the command. The line tells the rest of a tick after it, and later still
        behind a status: of that the plant hears what was told last."""
        (tick,) = struct.unpack_from("<I", self.sample, 1)
        answer = struct.pack("<BIH", link.COMMAND, tick, code << 4) + self.last_told
        self.line.sendall(link.encode(answer))
        self._next()

    def _record(self, record):
        """What the board saw is what a twin is to answer."""
        sample, code = self.unrecorded.popleft()
        (tick,) = struct.unpack_from("<I", sample, 1)
        self.last_told = struct.pack("<BB", record[21], record[22]) + record[27:43]
        seen = struct.pack("<BI", link.SAMPLE, tick) + record[9:19] + sample[15:27]
        answer = struct.pack("<BIH", link.COMMAND, tick, code << 4) + self.last_told
        self.transcript += [seen, answer]

    def _next(self):
        while True:
            while self.waiting:
                payload = self.waiting.pop(0)
                if payload[0] == link.SAMPLE:
                    self.sample = payload
                    self.chip.usart.send(link.encode(bytes([link.REFERENCE]) + payload[15:27]))
                    return
                if payload[0] == link.END:
                    self.chip.core.ended = "the plant has ended the run"
                    self.chip.core.engine.emu_stop()
                    return
            data = self.line.recv(65536)
            if not data:
                self.chip.core.ended = "the plant went away"
                self.chip.core.engine.emu_stop()
                return
            self.waiting += self.incoming.take(data)

    def write_transcript(self, path):
        """For `pneuma loop --replay`."""
        with open(path, "wb") as file:
            for payload in [self.hello, *self.transcript, bytes([link.END])]:
                file.write(link.encode(payload))


def arguments():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("image")
    parser.add_argument("--ticks", type=int, default=200)
    parser.add_argument("--plant", type=int, metavar="PORT", help="wait for `pneuma loop --connect` here, 0 for any port")
    parser.add_argument("--transcript", help="write what the board saw and answered here")
    parser.add_argument("--send", metavar="FILE", help="payloads for the serial line, a line of hexadecimal digits each")
    parser.add_argument("--slots", metavar="FILE", help="what the two slots of settings hold at the start")
    parser.add_argument("--slots-out", metavar="FILE", help="write what they hold in the end here")
    parser.add_argument("--json", help="write the outcome here")
    fault = parser.add_argument_group("what goes wrong; at a tick where a number is asked for")
    fault.add_argument("--no-crystal", action="store_true")
    fault.add_argument("--no-pll", action="store_true")
    fault.add_argument("--crystal-stops-at", type=int, default=NEVER)
    fault.add_argument("--hard-fault-at", type=int, default=NEVER, help="the processor raises a hard fault; the board starts again")
    fault.add_argument("--position-open-at", type=int, default=NEVER)
    fault.add_argument("--position-ready-ns", type=float, default=0.0)
    fault.add_argument("--dac-stuck-at", type=int, default=NEVER)
    fault.add_argument("--valve-shorted-at", type=int, default=NEVER)
    fault.add_argument("--lost-trigger", type=int, default=NEVER, help="no conversions from this tick to the ten thousandth")
    fault.add_argument("--lost-transfer", type=int, default=NEVER, help="an overrun in the middle of this tick's scan")
    fault.add_argument("--dma-error-at", type=int, default=NEVER)
    fault.add_argument("--cut-at", type=int, default=NEVER, help="power fails half-way through this operation of the flash")
    fault.add_argument("--reset-flags", type=lambda text: int(text, 0), default=0x0E00_0000)
    fault.add_argument("--watchdog-hz", type=float, default=32e3)
    options = parser.parse_args()
    options.lost_triggers = range(options.lost_trigger, options.lost_trigger + 10_000)
    options.lost_transfers = [(options.lost_transfer, 5)]
    return options


def injected(chip, options):
    """What happens at a tick, beside what the units look up themselves."""
    happened = set()

    def look():
        if chip.ticks >= options.crystal_stops_at and "crystal" not in happened:
            happened.add("crystal")
            chip.rcc.lose_crystal()
        if chip.ticks >= options.hard_fault_at and "hard fault" not in happened:
            happened.add("hard fault")
            chip.core.pend(HARD_FAULT)
        if chip.ticks >= options.dma_error_at and "dma" not in happened:
            happened.add("dma")
            chip.dma.raise_flag(0, 8)

    return look


def started_again(chip, world, options):
    """The chip after a reset by its program: memory stays, everything else begins anew."""
    options.reset_flags, options.hard_fault_at = SOFTWARE_RESET, NEVER
    again = Chip(options.image, world, options)
    again.core.engine.mem_write(RAM, bytes(chip.core.engine.mem_read(RAM, RAM_BYTES)))
    again.misuses.update(chip.misuses)
    return again


def main():
    """Runs, and says what came of it."""
    options = arguments()
    if options.plant is not None:
        world = Plant(options.plant)
    else:
        world = Sender(options.send) if options.send else World()
    chip = Chip(options.image, world, options)
    look = injected(chip, options)
    begin = time.process_time()

    def is_over():
        look()
        return chip.ticks > options.ticks

    ended = chip.core.run(is_over)
    if options.hard_fault_at != NEVER and ended == RESET:
        chip = started_again(chip, world, options)
        ended = chip.core.run(lambda: chip.ticks > options.ticks)
    cpu_s = time.process_time() - begin
    core = chip.core
    steady = sorted(chip.costs[20:]) or [0]
    outcome = {
        "ended": ended,
        "ticks": chip.ticks,
        "misuses": dict(chip.misuses),
        "first_command_us": world.first_command_us,
        "valve": [what for _, what in chip.marks if what.startswith("valve")],
        "fault": world.fault(),
        "commands": world.commands[-20:],
        "all_commands": world.commands,
        "control_cycles": {"mean": sum(steady) / len(steady), "worst": steady[-1]},
        "watchdog_longest": chip.watchdog.longest,
        "damaged_frames": world.frames.damaged,
        "marks": chip.marks,
        "instructions": core.instructions,
        "simulated_s": core.now() / 1e9,
        "cpu_s": cpu_s,
        "crash": world.crash.hex() if world.crash else None,
        "flash_operations": chip.flash.operations,
        "answers": getattr(world, "answers", []),
        "has_built_in_settings": bool(world.statuses[-1][10] & 1) if world.statuses else None,
    }
    if options.slots_out:
        with open(options.slots_out, "wb") as file:
            file.write(chip.slots())
    if options.transcript:
        world.write_transcript(options.transcript)
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(outcome, file, indent=1)
    for at_us, what in chip.marks:
        print(f"{at_us:12.1f} us  {what}")
    print(f"{chip.ticks} ticks, {core.now() / 1e9:.3f} s simulated in {cpu_s:.1f} s; ended: {ended or 'as asked'}")
    print(f"first command after {world.first_command_us or 0:.0f} us; control task {outcome['control_cycles']['mean']:.0f} "
          f"cycles, worst {outcome['control_cycles']['worst']} (estimated); fault {world.fault()}")
    for what, count in chip.misuses.items():
        print(f"MISUSE, {count} times: {what}")
    sys.exit(1 if chip.misuses else 0)


if __name__ == "__main__":
    main()
