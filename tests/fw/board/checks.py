"""What a scenario checks: one line each, kept if it fails."""

import struct

from mains import Mains
from stm32f405 import Board
from telemetry import Bad, decode, record_of

import service

LIMIT_MA = 32_000
SPAN_W = 28_000
TICK_S = 0.1
# The watchdog bites after 400 ms; half of that is the reserve that two late ticks would need.
GAP_MS_MAX = 200.0
# The least time for which a contactor stays open.
OFF_S = 60.0


def serial_of(uid):
    """The serial number that the board makes of the chip's UID."""
    x, y, wafer = struct.unpack("<HHB", uid[:5])
    number = 0
    for byte in uid[5:]:
        number = (number * 31 + byte) & 0xFFFFFFFF
    return (number * 0x01000193 & 0xFFFFFFFF) ^ (x << 16 ^ y) ^ wafer << 8


def uid_of(serial):
    """A UID with this serial number."""
    rest = bytes([7]) + b"Q123456"
    base = serial_of(bytes(4) + rest)
    die = serial ^ base
    return struct.pack("<HH", die >> 16, die & 0xFFFF) + rest


def threshold_of(serial):
    """A charger's place in the fleet, in [0, 1): below 6 A it draws 6 A if that place is below the share wanted."""
    return (serial * 0x9E3779B9 & 0xFFFFFFFF) / 2**32


def delay_ms(serial, starts, f_uhz, now_ms):
    """The delay of a start, as docs/board.md has it: 60 s and a draw of up to 600 s."""
    noise = (f_uhz & 0xFFFFFFFF) ^ now_ms
    seed = (serial + starts * 0xC2B2AE35) & 0xFFFFFFFF
    mixed = (seed ^ (noise << 16 | noise >> 16) & 0xFFFFFFFF) * 0x9E3779B9 & 0xFFFFFFFF
    mixed = (mixed ^ mixed >> 16) * 0x85EBCA6B & 0xFFFFFFFF
    mixed ^= mixed >> 13
    return 60_000 + (mixed * 600_001 >> 32)


class Run:
    """A board in a scenario, with what its checks found."""

    def __init__(self, elf, mains=None, table=None, uid=None, **wired):
        self.mains = mains or Mains()
        self.board = Board(elf, table, self.mains, uid or uid_of(1), **wired)
        self.failed, self.passed = [], 0
        self.frames, self.read = [], 0
        # Answers of the service link: (moment, record).
        self.answers = []

    def to(self, seconds):
        """Runs to this moment."""
        self.board.run(seconds)
        self.take()
        return self

    def take(self):
        """Decodes the frames that have come."""
        lines = self.board.line
        while self.read < len(lines):
            try:
                at_s, line = lines[self.read]
                record = record_of(line)
                if record[:1] == bytes([service.ANSWER]):
                    self.answers.append((at_s, record))
                else:
                    self.frames.append(decode(at_s, record))
            except (Bad, IndexError) as error:
                self.check(f"frame {self.read} is valid", False, error)
            self.read += 1

    def identity(self):
        """Who the charger said last that it is, unasked."""
        said = [record for _, record in self.answers if record[1] == service.UNASKED]
        return service.identity(said[-1]) if said else None

    def check(self, what, holds, found=""):
        if holds:
            self.passed += 1
        else:
            self.failed.append(f"{what}: {found}")

    def between(self, start, end):
        return [frame for frame in self.frames if start <= frame.at_s < end]

    def coil(self, start, end):
        """Whether the contactor was closed at any moment of an interval."""
        return any(closed for _, closed in states(self.board.coil, start, end))

    def offers(self, start, end):
        """Currents in mA that the pilot offered in an interval, in order; None for a pilot that no car can read."""
        return [offered(line) for _, line in states(self.board.pilot, start, end)]

    def rests(self, what, start, end):
        """Nothing is energised in an interval."""
        self.check(f"{what}: the contactor is open", not self.coil(start, end), self.board.coil[:8])
        offers = self.offers(start, end)
        self.check(f"{what}: nothing is offered", set(offers) <= {0}, offers[:8])

    def sound(self, resets=1, late_ok=(), dead=0):
        """What holds in every scenario. `late_ok`: when a tick may be late, or its frame missing. `dead`: starts that
        are stopped before their first tick."""
        self.check("resets", len(self.board.resets) == resets, (resets, len(self.board.resets), self.board.resets))
        who = self.identity()
        self.check("it says who it is", who and who.serial == serial_of(self.board.uid) and who.build, who)
        self.check("watchdog gap in ms", 0 < self.board.gap_us / 1e3 <= GAP_MS_MAX, self.board.gap_us / 1e3)
        self.check("frames came", len(self.frames) >= 5, len(self.frames))
        bears = lambda at_s: any(start <= at_s < end for start, end in late_ok)
        runs = 1 + sum(
            b.sequence != a.sequence + 1 and not (bears(b.at_s) and b.sequence > a.sequence)
            for a, b in zip(self.frames, self.frames[1:])
        )
        # A start that the next one follows at once sends nothing.
        starts = [at_s for at_s, _ in self.board.resets]
        silent = sum(b - a < 0.25 for a, b in zip(starts, starts[1:])) + dead
        self.check("no frame is missing in a run", runs == resets - silent, (runs, resets, silent))
        gaps = [
            (b.now_ms, b.now_ms - a.now_ms & 0xFFFFFFFF) for a, b in zip(self.frames, self.frames[1:])
            if b.sequence > 1 and not bears(b.at_s)
        ]
        # To a turn of the loop, 1 ms at most, at either end.
        late = [gap for gap in gaps if abs(gap[1] - 100) > 2]
        self.check("a tick every 100 ms", not late, late[:5])
        for (t, closed) in self.board.coil:
            if closed:
                line = [line for at, line in self.board.pilot if at <= t][-1]
                self.check("the contactor closes onto an offer", (offered(line) or 0) >= 6_000, (t, line))
        return self


def full(offers):
    """Whether these are offers of the full current alone, rounded down to a step of the timer."""
    return len(offers) == 1 and offers[0] is not None and LIMIT_MA - 2 <= offers[0] <= LIMIT_MA


def states(changes, start, end):
    """The states of an interval: that at its start, and the changes in it."""
    before = [change for change in changes if change[0] <= start][-1:]
    return before + [change for change in changes if start < change[0] < end]


def offered(line):
    """What a car reads from the pilot: docs of IEC 61851-1's duties, up to 51 A. No signal is no charging."""
    if line is None or line[1] >= 0.97 or line[1] <= 0.0:
        return 0
    hz, duty = line
    if not 995.0 <= hz <= 1005.0 or not 0.08 <= duty <= 0.85:
        return None
    return 6_000 if duty < 0.1 else round(duty * 60_000)


def power_w(line):
    """What a power stage reads from its line: 10 % is discharging with the span, 90 % charging."""
    if line is None or not 0.05 <= line[1] <= 0.95:
        return 0
    return round((line[1] - 0.5) / 0.4 * SPAN_W)
