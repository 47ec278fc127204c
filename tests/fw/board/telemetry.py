"""Frames of docs/telemetry.md, read by a program of its own."""

import struct
import zlib
from dataclasses import dataclass

FAULTS = (
    "bus no-signal stale stuck out-of-range implausible table-rejected outside-domain overrun clock-jump restarted "
    "dispatch misfit clock stopped guarded"
).split()
MISFITS = "meter-error meter-lag tick direction power pace".split()
MODES = "warm-up table droop-outside droop-no-table hold safe release droop-misfit".split()


@dataclass
class Frame:
    """A record, decoded."""

    at_s: float
    sequence: int
    now_ms: int
    mode: str
    f_uhz: int
    participation_ppm: int
    set_point: tuple
    faults: frozenset
    misfits: frozenset
    table: bool


class Bad(Exception):
    """Bytes that are no frame."""


def uncobs(line):
    out, at = bytearray(), 0
    while at < len(line):
        length = line[at]
        if length == 0 or at + length > len(line):
            raise Bad("COBS")
        out += line[at + 1:at + length]
        at += length
        if length != 255 and at < len(line):
            out.append(0)
    return bytes(out)


class Reader:
    def __init__(self, data):
        self.data, self.at = data, 0

    def byte(self):
        self.at += 1
        return self.data[self.at - 1]

    def varint(self):
        value = shift = 0
        while True:
            byte = self.byte()
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    def signed(self):
        value = self.varint()
        return (value >> 1) ^ -(value & 1)


def named(bits, names):
    return frozenset(name for n, name in enumerate(names) if bits >> n & 1)


def record_of(line):
    """The record of a line up to and with its zero byte."""
    body = uncobs(line[:-1])
    record, crc = body[:-4], body[-4:]
    if len(crc) != 4 or struct.unpack("<I", crc)[0] != zlib.crc32(record):
        raise Bad("CRC")
    return record


def decode(at_s, record):
    """The frame of a record."""
    r = Reader(record)
    frame = fields(at_s, r)
    if r.at != len(record):
        raise Bad("length")
    return frame


def fields(at_s, r):
    """The fields of a frame, read one after the other."""
    version = r.byte()
    if version not in (1, 2):
        raise Bad(f"version {version}")
    sequence, now_ms, mode, _phase = r.varint(), r.varint(), r.byte(), r.byte()
    f_uhz, _g, _l, _p = (r.signed() for _ in range(4))
    if r.byte():
        r.signed()
    ppm = r.varint()
    kind = r.varint()
    set_point = (("refused",), ("paused",), ("mA",), ("W",))[kind]
    if kind == 2:
        set_point += (r.varint(),)
    elif kind == 3:
        set_point += (r.signed(),)
    faults = named(r.varint(), FAULTS)
    misfits = named(r.byte(), MISFITS) if version == 2 else frozenset()
    table = bool(r.byte())
    if table:
        r.at += 16
        r.varint()
    return Frame(at_s, sequence, now_ms, MODES[mode], f_uhz, ppm, set_point, faults, misfits, table)
