"""Tables: those that do not fit, updates, power cuts in one."""

import struct
import zlib

from checks import Run
from mains import Chip, Mains
from service import RESTART
from .common import provisioned


def sealed(table, changes):
    """A table with bytes replaced, and its checksum."""
    image = bytearray(table[:-4])
    for at, value in changes:
        image[at:at + len(value)] = value
    return bytes(image) + struct.pack("<I", zlib.crc32(image))


def misfit(images):
    """Every way not to be what the table's proof assumed, as bytes in the flash: told, droop, no reset."""
    uni, bi, chip = (images.table(name) for name in ("gb-uni", "gb-bi", "gb-uni-ade7953"))
    cases = [
        (images.uni, uni, (), "table", False),
        (images.uni, bi, {"direction", "power"}, "droop-misfit", True),
        (images.bi, uni, {"direction", "power"}, "droop-misfit", True),
        (images.uni, chip, (), "table", False),
        (images.uni_chip, uni, {"meter-error"}, "droop-misfit", True),
        (images.uni, b"", (), "droop-no-table", False),
        (images.uni, uni[:-1] + bytes([uni[-1] ^ 1]), (), "droop-no-table", False),
    ]
    for image, table, misfits, mode, wrong in cases:
        mains = Mains(lambda t: 49.7)
        run = Run(image, mains, table=table, chip=Chip(mains)).to(10.0)
        last = run.frames[-1]
        run.check("misfits", last.misfits == frozenset(misfits), last)
        run.check("the fault bit", ("misfit" in last.faults) == wrong, last)
        run.check("mode", last.mode == mode, last)
        run.check("a rejected table is told", ("table-rejected" in last.faults) == (mode == "droop-no-table"), last)
        run.check("it responds to 49.7 Hz", last.participation_ppm > 0, last)
        yield run.sound()


def update(images):
    """A signed table over the line: verified, tried after the next start, kept after a minute; the next one in the other slot."""
    run, tool = provisioned(images.uni, car="A")
    first, second, foreign = (images.container(name) for name in ("first", "second", "foreign"))
    shipped, other = images.table("gb-uni"), images.table("gb-uni-ade7953")
    crc = lambda table: struct.unpack("<I", table[-4:])[0]
    run.check("the shipped table runs", run.identity().table[1] == crc(shipped), run.identity())
    steps = len(run.board.steps)
    forged = first[:-1] + bytes([first[-1] ^ 1])
    run.check("a forged one", tool.install(forged) == ("refused", 6), "")
    run.check("one whose table was changed", tool.install(first[:40] + b"\1" + first[41:]) == ("refused", 6), "")
    run.check("one for another charger", tool.install(foreign) == ("refused", 7), "")
    run.check("one that is cut", tool.install(first[:-1]) == ("refused", 1), "")
    run.check("none of them reaches the flash", len(run.board.steps) == steps, run.board.steps[steps:][:3])
    run.check("a signed one is taken", tool.install(first) == ("installed", 1), "")
    run.check("the old one runs on", tool.update(0) == ("state", None, 0, False, 1), tool.update(0))
    run.check("a start", tool.order(RESTART) == "done", "")
    run.to(run.board.us * 1e-6 + 2.0)
    run.check("the new one is on trial", tool.update(0) == ("state", 1, 0, False, None), tool.update(0))
    run.check("and in force", run.identity().table[1] == crc(other), run.identity())
    run.check("without a fault", not run.frames[-1].faults and run.frames[-1].mode == "table", run.frames[-1])
    run.check("no other while it is tried", tool.install(second) == ("refused", 17), "")
    run.to(run.board.us * 1e-6 + 62.0)
    run.check("it is kept", tool.update(0) == ("state", 1, 0, True, None), tool.update(0))
    run.check("what it has is a replay", tool.install(first) == ("refused", 9), "")
    run.check("the second goes into the other slot", tool.install(second) == ("installed", 2), "")
    run.check("a start", tool.order(RESTART) == "done", "")
    run.to(run.board.us * 1e-6 + 2.0)
    run.check("it is on trial", tool.update(0) == ("state", 2, 1, False, None), tool.update(0))
    # Three more starts, none of which it survives for a minute, and it is left.
    for _ in range(3):
        run.board.hang()
        run.to(run.board.us * 1e-6 + 3.0)
    run.check("the last trial", tool.update(0) == ("state", 2, 1, False, None), tool.update(0))
    run.board.hang()
    run.to(run.board.us * 1e-6 + 3.0)
    run.check("it is rolled back", tool.update(0) == ("state", 1, 0, True, None), tool.update(0))
    run.check("and not taken again", tool.install(second) == ("refused", 10), "")
    run.check("the watchdog has its usual time", run.board.dog_period_us < 0.41e6, run.board.dog_period_us)
    erased = [at_s for at_s, what, _ in run.board.steps if what == "erase"]
    return run.sound(resets=7, late_ok=[(at_s, at_s + 1.5) for at_s in erased])


def power_cuts(images):
    """The supply fails in a step of an update: afterwards the old table is in force or the new one, and both are whole."""
    first, second = images.container("first"), images.container("second")
    run, tool = provisioned(images.uni, car="A")
    run.check("the first", tool.install(first) == ("installed", 1), "")
    run.check("a start", tool.order(RESTART) == "done", "")
    run.to(run.board.us * 1e-6 + 64.0)
    run.check("is kept", tool.update(0) == ("state", 1, 0, True, None), tool.update(0))
    crcs = {1: struct.unpack("<I", images.table("gb-uni-ade7953")[-4:])[0]}
    crcs[2] = struct.unpack("<I", images.table("gb-uni")[-4:])[0]
    before, base, starts = bytes(run.board.flash), len(run.board.steps), len(run.board.resets)

    def again():
        """The charger as it was with the first table confirmed."""
        nonlocal starts
        run.board.flash[:] = before
        run.board.power_up(run.board.resets[0][1])
        run.to(run.board.us * 1e-6 + 1.5)
        starts += 1

    again()
    run.check("the second", tool.install(second) == ("installed", 2), "")
    whole = len(run.board.steps) - base
    # Void, erase, container and complete; behind them the start that notes a trial: 8 and 8 words.
    cuts = [0, 7, 8, 9, 30, whole - 9, whole - 8, whole - 4, whole - 1, whole, whole + 7, whole + 8, whole + 12]
    found = []
    for after in cuts:
        again()
        run.board.cut_after = after
        tool.install(second)
        if run.board.cut_after is not None:
            # Its challenge writes too; where the supply fails there, it starts by itself.
            starts += tool.order(RESTART) == "done"
            run.to(run.board.us * 1e-6 + 2.0)
        starts += 1
        run.check(f"the supply fails at step {after}", run.board.cut_after is None, run.board.cut_after)
        run.to(run.board.us * 1e-6 + 2.0)
        state = tool.update(0)
        running = state[1] if state else None
        found.append(running)
        who, last = run.identity(), run.frames[-1]
        run.check(f"step {after}: a whole table", who.table and who.table[1] == crcs.get(running), (state, who))
        run.check(f"step {after}: it decides", last.mode == "table" and not last.faults - {"restarted"}, last)
        more = tool.install(second)
        run.check(f"step {after}: again", more in (("installed", 2), ("refused", 9), ("refused", 17)), more)
    # What is cut while it writes a frame, or a start, misses that frame.
    run.check("the old one and the new one were found", set(found) == {1, 2}, found)
    erased = [at_s for at_s, what, _ in run.board.steps if what == "erase"]
    return run.sound(resets=starts, late_ok=[(at_s, at_s + 1.5) for at_s in erased])
