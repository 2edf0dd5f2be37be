"""Frames of the serial line and of the link: COBS, CRC-16/CCITT-FALSE (docs/link.md)."""

import binascii
import struct

HELLO, SAMPLE, COMMAND, END = 0x01, 0x02, 0x03, 0x04
REFERENCE, ASK_STATUS, ACKNOWLEDGE = 0x12, 0x13, 0x10
ASK_CRASH = 0x14
TICK, STREAM, STATUS, CRASH = 0x30, 0x31, 0x40, 0x41


def encode(payload):
    """A frame of a payload."""
    data = payload + struct.pack("<H", binascii.crc_hqx(payload, 0xFFFF))
    coded, block = bytearray(), bytearray()
    for byte in data:
        if byte:
            block.append(byte)
        if not byte or len(block) == 254:
            coded += bytes([len(block) + 1]) + block
            block.clear()
    return bytes(coded) + bytes([len(block) + 1]) + bytes(block) + b"\0"


def decode(coded):
    """The payload of a frame without its end mark; None where it is damaged."""
    data, place = bytearray(), 0
    while place < len(coded):
        length = coded[place]
        if length == 0 or place + length > len(coded):
            return None
        data += coded[place + 1 : place + length]
        place += length
        if length < 255 and place < len(coded):
            data.append(0)
    if len(data) < 3 or binascii.crc_hqx(bytes(data[:-2]), 0xFFFF) != data[-2] | data[-1] << 8:
        return None
    return bytes(data[:-2])


class Frames:
    """Takes bytes as they come, gives payloads."""

    def __init__(self):
        self._rest = bytearray()
        self.damaged = 0

    def take(self, data):
        """The payloads that are complete with these bytes."""
        self._rest += data
        whole = []
        while (end := self._rest.find(b"\0")) >= 0:
            coded, self._rest = bytes(self._rest[:end]), self._rest[end + 1 :]
            payload = decode(coded)
            if payload is not None:
                whole.append(payload)
            elif coded:
                self.damaged += 1
        return whole
