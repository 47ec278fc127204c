"""The service link of docs/service.md and the updates of docs/signed-tables.md, by a program of its own."""

import hashlib
import hmac
import struct
import zlib
from dataclasses import dataclass

from telemetry import Reader

ASK, ANSWER, UNASKED = 0xA1, 0xB1, 0
IDENTITY, STATUS, SETTINGS, CHALLENGE, DONE, PROVISIONED, REFUSED, UPDATE = range(8)
REFUSALS = (
    "malformed no-challenge too-soon not-authentic no-key has-key unknown-setting out-of-range not-this-image "
    "start-too-soon flash not-here not-now"
).split()
PART = 192


def varint(value):
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes(out) + bytes([value])


def sized(data):
    return varint(len(data)) + data


def option(value):
    return b"\0" if value is None else b"\1" + varint(value)


def frame(record):
    """COBS of a record with its CRC-32, and a zero byte."""
    data, out = record + struct.pack("<I", zlib.crc32(record)), bytearray()
    for block in data.split(b"\0"):
        assert len(block) < 254
        out += bytes([len(block) + 1]) + block
    return bytes(out) + b"\0"


def ask(number, kind, content=b""):
    return frame(bytes([ASK, number, kind]) + content)


@dataclass
class Identity:
    """Who a charger is."""

    build: str
    serial: int
    table: tuple
    provisioned: bool
    settings: int


def identity(record):
    r = Reader(record)
    r.at = 2
    assert r.varint() == IDENTITY
    length = r.varint()
    build = record[r.at:r.at + length].decode()
    r.at += length
    serial, _direction, _meter = r.varint(), r.byte(), r.byte()
    table = None
    if r.byte():
        spec_hash = record[r.at:r.at + 16]
        r.at += 16
        table = (spec_hash, r.varint())
    return Identity(build, serial, table, bool(r.byte()), r.byte())


class Tool:
    """Asks a charger in a scenario and waits for its answers."""

    def __init__(self, run, serial, key=bytes(range(32))):
        self.run, self.serial, self.key, self.number = run, serial, key, 0

    def ask(self, kind, content=b"", wait_s=0.5):
        """The answer's kind and the rest of its record; `None` without one."""
        self.number = self.number % 255 + 1
        run, since = self.run, len(self.run.answers)
        run.board.hear(ask(self.number, kind, content))
        until = run.board.us * 1e-6 + wait_s
        while run.board.us < until * 1e6:
            run.to(run.board.us * 1e-6 + 0.02)
            for _, record in run.answers[since:]:
                if record[1] == self.number:
                    return record[2], record[3:]
        return None

    def refusal(self, answer):
        """The name of a refusal; "" for anything else."""
        return REFUSALS[answer[1][0]] if answer and answer[0] == REFUSED else ""

    def provision(self):
        return self.ask(PROVISIONED, self.key)

    def mac(self, word, number, rest, key=None):
        return hmac.new(key or self.key, word + struct.pack("<II", self.serial, number) + rest, hashlib.sha256).digest()

    def order(self, record, key=None, forge=lambda seal: seal, wait_s=0.5):
        """An order, sealed for a new challenge; whether the charger's own seal says that it is done, or the refusal."""
        self.run.to(self.run.board.us * 1e-6 + 0.6)
        answer = self.ask(CHALLENGE)
        if not answer or answer[0] != CHALLENGE:
            return self.refusal(answer) or "no challenge"
        r = Reader(answer[1])
        number = r.varint()
        nonce = answer[1][r.at:r.at + 16]
        if nonce != self.mac(b"HfNonce1", number, b"")[:16]:
            return "foreign challenge"
        seal = forge(self.mac(b"HfOrder1", number, nonce + record, key))
        answer = self.ask(DONE, varint(number) + sized(record) + seal, wait_s)
        if answer and answer[0] == DONE:
            return "done" if answer[1] == self.mac(b"HfDone 1", number, nonce + record) else "foreign seal"
        return self.refusal(answer) or "no answer"

    # -- updates

    def update(self, kind, content=b"", wait_s=0.5):
        """A step of an update; the answer's kind and values."""
        answer = self.ask(6, sized(varint(kind) + content), wait_s)
        if not answer or answer[0] != UPDATE:
            return None
        r = Reader(answer[1])
        r.varint()
        said = r.varint()
        if said == 0:
            running = r.varint() if r.byte() else None
            slot, confirmed = r.byte(), bool(r.byte())
            waiting = r.varint() if r.byte() else None
            return "state", running, slot, confirmed, waiting
        if said == 3:
            return "refused", r.byte()
        return ("taken", "installed")[said - 1], r.varint()

    def send(self, container):
        """All of a container, in parts; the last answer."""
        said = self.update(1, varint(len(container)))
        for at in range(0, len(container), PART):
            said = self.update(2, varint(at) + sized(container[at:at + PART]))
        return said

    def install(self, container):
        """Sends a container and has it installed."""
        said = self.send(container)
        return self.update(3, b"\0", 4.0) if said == ("taken", len(container)) else said


def limit(source, ma, for_s=0):
    """An order of a limit; `source`: 0 user, 1 site, 2 cable."""
    return varint(1) + bytes([source]) + option(ma) + varint(for_s)


def override(what, for_s=0):
    return varint(2) + bytes([what]) + varint(for_s)


def settings(*pairs):
    """An order of settings by number."""
    return varint(0) + varint(len(pairs)) + b"".join(bytes([n]) + varint(value) for n, value in pairs)


RESTART = varint(5)
