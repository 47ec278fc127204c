"""The scenarios. Each states what must hold; docs/board.md says why."""

import struct
import zlib

from checks import LIMIT_MA, OFF_S, SPAN_W, Run, delay_ms, full, offered, power_w, serial_of, states, threshold_of, uid_of
from mains import Chip, Grid, Mains
from service import RESTART, Tool, limit, override, settings
from telemetry import Reader, fields

# The delay of a start is drawn from the serial number and the first reading: one that draws little, for these.
SOON_MS = 60_400
ENERGISED_S = 61.0


def soon(image, **wired):
    """A UID whose first start on a mains of 50 Hz takes little more than the fixed part of the delay."""
    probe = Run(image, **wired).to(0.6)
    believed = [frame for frame in probe.frames if not frame.faults]
    if not believed:
        return uid_of(1)
    first = believed[0]
    serial = next(n for n in range(1 << 20) if delay_ms(n, 0, first.f_uhz, first.now_ms) < SOON_MS)
    return uid_of(serial)


def start(images):
    """At rest until a frequency was believed and the delay is over; then first the offer, then the contactor."""
    run = Run(images.uni, uid=soon(images.uni)).to(65.0)
    seen = next((frame for frame in run.frames if not frame.faults), None)
    run.check("a frequency is believed at once", seen is not None and seen.at_s < 0.5, seen)
    ready = seen.now_ms + delay_ms(serial_of(run.board.uid), 0, seen.f_uhz, seen.now_ms) if seen else 0
    run.rests("before the delay is over", 0.0, ready / 1e3 - 0.01)
    run.check("then the full current is offered", full(run.offers(ready / 1e3 + 0.2, 65.0)), run.offers(61, 65))
    run.check("and the contactor closes", run.coil(ready / 1e3 + 0.2, 65.0), run.board.coil)
    run.check("the input filter is on", run.board.regs[0x40000C18] >> 4 & 15 == 7, hex(run.board.regs[0x40000C18]))
    order = run.board.order
    run.check("the watchdog starts before the clock", order[:1] == ["watchdog"] and "crystal" in order, order)
    return run.sound()


def no_car(images):
    """Each state of the car: open without one that asks, and at once when it no longer does."""
    run = Run(images.uni, uid=soon(images.uni, car="A"), car="A").to(62.0)
    run.rests("no car", 0.0, 62.0)
    t = 62.0

    def then(car, offer, closed):
        nonlocal t
        run.board.car = car
        run.to(t + 2.0)
        # A tick of 0.1 s and the measurement.
        offers, coil = run.offers(t + 0.15, t + 2.0), run.coil(t + 0.15, t + 2.0)
        right = full(offers) if offer else offers == [0]
        run.check(f"state {car} at {t} s", right and coil == closed, (offers, coil))
        t += 2.0

    then("B", LIMIT_MA, False)
    then("C", LIMIT_MA, True)
    for car in "ADEF":
        then(car, 0, False)
        then("C", LIMIT_MA, True)
    then("B", LIMIT_MA, False)
    return run.sound()


def no_mains(images):
    """Silent for 20 s, there for a second, gone for 10 s: every time as before the first reading."""
    run = Run(images.uni, Mains(dark=[(0.0, 20.0), (21.0, 31.0)])).to(90.0)
    run.rests("until the delay after the last return", 0.0, 31.0 + OFF_S - 2.0)
    silent = run.between(2.0, 20.0) + run.between(24.0, 31.0)
    run.check("the fault is told", silent and all("no-signal" in f.faults for f in silent), silent[:1])
    run.check("a gap leads to safe", all(f.mode == "safe" for f in run.between(2.0, 20.0)), silent[:1])
    return run.sound()


def mains_gone(images):
    """The mains goes while a car charges: after the hold the contactor opens, and stays open for its time."""
    mains = Mains(dark=[(63.0, 66.0)])
    run = Run(images.uni, mains, uid=soon(images.uni)).to(62.9)
    run.check("it charges", run.coil(62.0, 62.9), run.board.coil)
    run.to(120.0)
    run.rests("from the end of the hold on", 64.6, 66.0 + OFF_S - 6.5)
    return run.sound()


def dead_crystal(images):
    """The internal oscillator takes over: telemetry says so, and nothing is energised."""
    run = Run(images.uni, crystal=False).to(70.0)
    run.rests("without its crystal", 0.0, 70.0)
    run.check("the fault is told", all("clock" in f.faults for f in run.frames), run.frames[:1])
    run.check("telemetry comes from the start", run.frames and run.frames[0].at_s < 1.0, run.frames[:1])
    return run.sound()


def crystal_fails(images):
    """While a car charges: within the watchdog's time everything is off, and stays off."""
    run = Run(images.uni, uid=soon(images.uni)).to(63.0)
    run.check("it charges", run.coil(62.0, 63.0), run.board.coil)
    run.board.events.append((63.0, lambda board: board.fail_crystal()))
    run.to(75.0)
    run.rests("once the watchdog has bitten", 63.6, 75.0)
    after = run.between(63.6, 75.0)
    run.check("both faults are told", after and all({"clock", "stopped"} <= f.faults for f in after), after[:1])
    return run.sound(resets=2)


def stopped(images):
    """A hang, a hard fault: the watchdog restarts the board, and the next run says which it was."""
    run = Run(images.uni).to(2.0)
    run.board.hang()
    run.to(5.0)
    after = run.between(2.5, 5.0)
    run.check("a hang is a restart", after and "stopped" not in after[-1].faults, after[:1])
    run.board.events.append((5.0, lambda board: board.jump(0xF000_0000)))
    run.to(8.0)
    after = run.between(5.5, 8.0)
    run.check("a hard fault is noted", after and all("stopped" in f.faults for f in after), after[:1])
    times = [t for t, _ in run.board.resets]
    run.check("the watchdog bites in time", times[1] < 2.45 and times[2] < 5.45, times)
    return run.sound(resets=3)


def close_loop(run, grid, until_s):
    """The fleet follows what the charger states, to this moment."""
    while run.board.us < until_s * 1e6:
        run.to(run.board.us * 1e-6 + 0.05)
        if run.frames:
            grid.participation = run.frames[-1].participation_ppm * 1e-6


def event(images, image, fleet_gw, lowest_hz, band, settled_s, given, by_chip=False):
    """A loss of 2 GW in closed loop, to its end: the bounds of docs/guarantees.md, quiet, and back again."""
    grid = Grid(fleet_gw, 2.0, 63.0, 103.0)
    mains, still = Mains(grid.hz), Mains()
    chips = (Chip(mains), Chip(still)) if by_chip else (None, None)
    run = Run(image, mains, uid=soon(image, mains=still, chip=chips[1]), chip=chips[0])
    close_loop(run, grid, 140.0)
    lowest = min(f for _, f in grid.trace)
    run.check(f"f >= {lowest_hz} Hz", lowest >= lowest_hz, lowest)
    late = [f for t, f in grid.trace if 63.0 + settled_s <= t < 103.0]
    run.check("settled", all(band[0] <= f <= band[1] for f in late), (min(late), max(late)))
    run.check("it responds", max(f.participation_ppm for f in run.frames) > 300_000, "")
    faults = [f for f in run.frames if f.sequence > 1 and f.faults]
    run.check("no fault", not faults, faults[:1])
    run.check("the table decides", all(f.mode == "table" for f in run.frames[2:]), run.frames[-1])
    told = given(run, 62.0, 140.0)
    run.check("the line is what telemetry tells", told == "", told)
    changes = sum(a.set_point != b.set_point for a, b in zip(run.between(62, 103), run.between(62, 103)[1:]))
    run.check("changes of the set-point in 40 s", changes <= 24, changes)
    run.check("all is given back", run.frames[-1].participation_ppm == 0, run.frames[-1])
    return run, run.sound()


def follows(run, start, end, meaning, told):
    """Whether the line, read by its receiver, is the set-point of the frame that comes a few ms later."""
    for frame in run.between(start, end):
        line = [line for _, line in states(run.board.pilot, frame.at_s, frame.at_s)][0]
        if abs((meaning(line) or 0) - told(frame)) > 2:
            return f"{frame} {line}"
    return ""


def event_uni(images):
    """The event for a charger that can only stop: its contactor is not operated."""
    def given(run, start, end):
        return follows(run, start, end, offered, lambda f: f.set_point[1] if f.set_point[0] == "mA" else 0)

    # gb-uni in docs/guarantees.md.
    run, _ = event(images, images.uni, 0.7, -0.7155, (-0.4, 0.1), 13.2, given)
    run.check("the contactor closes once and stays", [c for _, c in run.board.coil] == [False, True], run.board.coil)
    return run


def event_bi(images):
    """The event for a charger that can feed the grid."""
    def given(run, start, end):
        return follows(run, start, end, power_w, lambda f: f.set_point[1])

    # gb-bi in docs/guarantees.md.
    run, _ = event(images, images.bi, 1.4, -0.4865, (-0.3, 0.1), 11.8, given)
    stage = [power_w(line) for _, line in states(run.board.pilot, 0.0, 60.0)]
    run.check("no power before the delay is over", set(stage) == {0}, stage)
    return run


def event_bi_chip(images):
    """The same by the metering chip: its own bounds, and bits lost on its bus, for which what stood stays."""
    def given(run, start, end):
        return follows(run, start, end, power_w, lambda f: f.set_point[1])

    # gb-bi-ade7953 in docs/guarantees.md.
    run, _ = event(images, images.bi_chip, 1.4, -0.4998, (-0.32, 0.1), 11.2, given, by_chip=True)
    stage = [power_w(line) for _, line in states(run.board.pilot, 0.0, 60.0)]
    run.check("no power before the delay is over", set(stage) == {0}, stage)
    fed = [f.set_point for f in run.between(63.0, 103.0) if f.set_point[0] == "W" and f.set_point[1] < 0]
    run.check("it fed the grid", len(fed) > 10, len(fed))
    at = run.board.us * 1e-6
    run.board.chip.flip = 1 << 9
    run.to(at + 4.0)
    bad = run.between(at + 0.15, at + 4.0)
    run.check("a lost bit is the bus's fault", bad and all("bus" in f.faults for f in bad), bad[:1])
    run.check("held, then safe", bad and (bad[0].mode, bad[-1].mode) == ("hold", "safe"), bad[-1:])
    run.check("it charges on meanwhile", {f.set_point for f in bad} == {("W", SPAN_W)}, {f.set_point for f in bad})
    run.board.chip.flip = 0
    run.to(at + 8.0)
    good = run.between(at + 6.0, at + 8.0)
    run.check("and is over with it", good and all(not f.faults and f.mode == "table" for f in good), good[:1])
    return run.sound()


def watchdog_in_event(images):
    """The program hangs in the middle of an event: open within the watchdog's time, and for its off time."""
    grid = Grid(0.7, 2.0, 63.0)
    run = Run(images.uni, Mains(grid.hz), uid=soon(images.uni))
    close_loop(run, grid, 68.0)
    run.check("it responds", run.frames[-1].participation_ppm > 0, run.frames[-1])
    run.check("the contactor is closed", run.coil(67.9, 68.0), run.board.coil)
    run.board.hang()
    close_loop(run, grid, 68.45 + OFF_S)
    run.rests("from the watchdog on, for the off time", 68.45, 68.45 + OFF_S)
    again = run.between(68.2, 80.0)
    run.check("it starts again", again and again[0].sequence == 1, again[:1])
    run.check("the restart is told", again and "restarted" in again[0].faults, again[:1])
    return run.sound(resets=2)


def phase_step(images):
    """Steps of 2, 4 and 6 degrees at 49.75 Hz are no frequency: neither reading nor response changes."""
    steps = [(4.0, 2.0), (7.0, -2.0), (10.0, 4.0), (13.0, -4.0), (16.0, 6.0), (19.0, -6.0)]
    run = Run(images.uni, Mains(lambda t: 49.75, steps=steps)).to(22.0)
    # The stated error of the meter, and 2 mHz while a step is in the window: neither may start a thing.
    quiet(run, 3.0, 3_000)
    return run.sound()


def phase_step_chip(images):
    """The same for the metering chip, which counts single periods."""
    steps = [(4.0, 2.0), (7.0, -2.0), (10.0, 4.0), (13.0, -4.0), (16.0, 6.0), (19.0, -6.0)]
    mains = Mains(lambda t: 49.75, steps=steps)
    run = Run(images.uni_chip, mains, chip=Chip(mains)).to(22.0)
    quiet(run, 3.0, 13_000)
    run.check("the table fits its image", all("misfit" not in f.faults for f in run.frames), run.frames[-1])
    return run.sound()


def quiet(run, start, error_uhz):
    frames = run.between(start, 1e9)
    worst = max((abs(f.f_uhz + 250_000) for f in frames), default=None)
    run.check("the reading stays", worst is not None and worst <= error_uhz, worst)
    shares = {f.participation_ppm for f in frames}
    run.check("the response stays", len(shares) == 1, shares)
    faults = [f for f in frames if f.faults]
    run.check("no fault", not faults, faults[:1])


def exact(images):
    """A mains at exactly 50 Hz is healthy."""
    run = Run(images.uni).to(30.0)
    bad = [f for f in run.frames if f.sequence > 1 and (f.faults or f.mode != "table")]
    run.check("no fault in 30 s", not bad, bad[:1])
    return run.sound()


def jitter(images):
    """Crossings that are early or late by what the comparator may have: few changes, by table and by droop."""
    uid = soon(images.uni, mains=Mains(jitter_us=0.5))
    # The share of the current at which this charger goes from 6 A to a pause, and where the droop wants it.
    share = threshold_of(serial_of(uid)) * 6_000 / LIMIT_MA
    at_edge = 49.85 - 0.5 * (1.0 - share)
    for name, table, hz in (("table", None, 49.85), ("table at 6 A", None, 49.852), ("droop at 6 A", b"", at_edge)):
        mains = Mains(lambda t, hz=hz: hz if t > 61.5 else 50.0 + 0 * t, jitter_us=0.5)
        run = Run(images.uni, mains, table=table, uid=uid).to(125.0)
        frames = run.between(66.0, 125.0)
        changes = sum(a.set_point != b.set_point for a, b in zip(frames, frames[1:]))
        run.check(f"{name}: changes in 59 s", changes <= 12, changes)
        worst = max(abs(f.f_uhz - (hz - 50) * 1e6) for f in frames)
        run.check(f"{name}: the reading errs as stated", worst <= 3_000, worst)
        yield run.sound()


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


def chip(images):
    """Bits lost on the way from the chip, and a chip that was reset: no reading, then as before."""
    mains = Mains(lambda t: 49.95)
    wired = Chip(mains)
    run = Run(images.uni_chip, mains, chip=wired).to(2.0)
    run.check("it reads", abs(run.frames[-1].f_uhz + 50_000) <= 13_000, run.frames[-1])
    wired.flip = 1 << 9
    run.to(3.0)
    bad = run.between(2.15, 3.0)
    run.check("a lost bit is the bus's fault", bad and all("bus" in f.faults for f in bad), bad[:1])
    wired.flip, wired.required = 0, 0
    run.to(5.0)
    good = run.between(3.3, 5.0)
    run.check("and is over with it", good and all(not f.faults for f in good), good[:1])
    run.check("the chip is set again", wired.required == 0x30, wired.required)
    return run.sound()


def tool_for(run):
    return Tool(run, serial_of(run.board.uid))


def provisioned(image, **wired):
    """A charger that has its key, from 2 s on, and the tool that has it too."""
    run = Run(image, **wired).to(2.0)
    tool = tool_for(run)
    answer = tool.provision()
    run.check("it takes its first key", answer and answer[0] == 5, answer)
    return run, tool


def limits(images):
    """Limits over the line reach the car within two ticks, and are over when their time is; no order without the key."""
    uid = soon(images.uni)
    run = Run(images.uni, uid=uid).to(2.0)
    tool = tool_for(run)
    run.check("without a key no order is taken", tool.order(limit(1, 10_000)) == "no-key", "")
    run.check("a key is taken once", tool.provision()[0] == 5 and tool.refusal(tool.provision()) == "has-key", "")
    run.to(62.0)
    run.check("it charges", full(run.offers(61.8, 62.0)) and run.coil(61.8, 62.0), run.board.coil)
    other = bytes(32)
    run.check("another's order changes nothing", tool.order(limit(1, 6_000), key=other) == "not-authentic", "")
    forged = tool.order(limit(1, 6_000), forge=lambda seal: seal[:-1] + bytes([seal[-1] ^ 1]))
    run.check("neither does a forged one", forged == "not-authentic", forged)
    run.check("the full current is offered", full(run.offers(62.0, run.board.us * 1e-6)), run.offers(62.0, 70.0))
    run.check("an order is carried out", tool.order(limit(1, 10_000, 5)) == "done", "")
    at = run.board.us * 1e-6
    run.to(at + 2.0)
    offers = run.offers(at + 0.2, at + 2.0)
    run.check("10 A are offered", len(offers) == 1 and 9_998 <= offers[0] <= 10_000, offers)
    run.check("the contactor stays", run.coil(at, at + 2.0), run.board.coil)
    run.to(at + 7.0)
    run.check("after 5 s the full current is", full(run.offers(at + 5.3, at + 7.0)), run.offers(at, at + 7.0))
    run.check("a pause is ordered", tool.order(override(2)) == "done", "")
    at = run.board.us * 1e-6
    run.to(at + 12.0)
    run.rests("after the pause", at + 11.0, at + 12.0)
    return run.sound()


def in_an_event(images):
    """While the charger responds nothing is written, and limits pass."""
    grid = Grid(0.7, 2.0, 63.0)
    run, tool = provisioned(images.uni, mains=Mains(grid.hz), uid=soon(images.uni))
    # A challenge at rest, so that a block of them is set aside.
    run.check("an order at rest", tool.order(limit(0, 80_000)) == "done", "")
    close_loop(run, grid, 66.0)
    run.check("it responds", run.frames[-1].participation_ppm > 0, run.frames[-1])
    steps = len(run.board.steps)
    run.check("settings wait", tool.order(settings((7, 16_000))) == "not-now", "")
    run.check("a limit passes", tool.order(limit(1, 6_500)) == "done", "")
    run.check("nothing is written", len(run.board.steps) == steps, run.board.steps[steps:])
    at = run.board.us * 1e-6
    close_loop(run, grid, at + 1.0)
    offers = run.offers(at + 0.2, at + 1.0)
    run.check("no offer is above the limit", all(offer <= 6_500 for offer in offers), offers)
    return run.sound()


def settings_stay(images):
    """Settings are kept over a reset and in force after it; what the charger bears is compared with its table."""
    run, tool = provisioned(images.uni)
    run.check("16 A on one phase", tool.order(settings((1, 16_000), (2, 1), (18, 0))) == "done", "")
    run.check("out of range", tool.order(settings((1, 80_001))) == "out-of-range", "")
    run.check("not yet a misfit", not run.frames[-1].misfits, run.frames[-1])
    at = run.board.us * 1e-6
    run.check("a start is ordered", tool.order(RESTART) == "done", "")
    again = run.board.us * 1e-6
    run.to(again + 70.0)
    run.check("it starts", len(run.board.resets) == 2 and run.board.resets[1][0] < again + 0.5, run.board.resets)
    who = run.identity()
    run.check("the settings are from flash", who.settings == 1 and who.provisioned, who)
    last = run.frames[-1]
    run.check("another power is a misfit", last.misfits == {"power"} and last.mode == "droop-misfit", last)
    offers = run.offers(again + 65.0, again + 70.0)
    run.check("without the random delay 16 A are offered", offers and 15_998 <= offers[-1] <= 16_000, offers)
    run.check("the watchdog has its usual time", run.board.dog_period_us < 0.41e6, run.board.dog_period_us)
    return run.sound(resets=2)


def settings_full(images):
    """Sectors are erased as settings are written: the watchdog bears it, the charger too, and nothing is lost."""
    run, tool = provisioned(images.uni, car="A")
    # Settings that are not at their defaults make long records: a page holds some ten such.
    wide = settings(*((n, 10_000) for n in (5, 7, 8, 9, 10, 11, 13)), (12, 30), (14, 2))
    run.check("nine settings", tool.order(wide) == "done", "")
    written = 0
    while not any(what == "erase" for _, what, _ in run.board.steps) and written < 40:
        run.check("written", tool.order(settings((1, 10_000 + written)), wait_s=2.0) == "done", written)
        written += 1
    erased = [at_s for at_s, what, _ in run.board.steps if what == "erase"]
    run.check("a sector was erased", len(erased) == 1, (written, erased))
    run.check("with more time for the watchdog", 0.49e6 < run.board.long_gap_us < 0.6e6, run.board.long_gap_us)
    run.check("and the usual time after", run.board.dog_period_us < 0.41e6, run.board.dog_period_us)
    # What stops the loop for more than 10 ms beside the erasure would be instructions, in millions.
    late = [frame.now_ms for frame in run.frames if frame.now_ms % 100 > 2]
    run.check("it stands still for the erasure alone", len(late) <= 1, late)
    faults = {fault for frame in run.frames[2:] for fault in frame.faults}
    run.check("late ticks are told", faults <= {"overrun", "no-signal", "stale", "clock-jump"}, faults)
    run.check("then all is well", run.to(run.board.us * 1e-6 + 3.0).frames[-1].faults == frozenset(), run.frames[-1])
    return run.sound(late_ok=[(at_s, at_s + 1.0) for at_s in erased])


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


def busy(images):
    """A car that charges, or a response, and a table waits; a table is taken while the pilot is paused."""
    run, tool = provisioned(images.uni, uid=soon(images.uni))
    first = images.container("first")
    run.to(62.0)
    run.check("it charges", run.coil(61.9, 62.0), run.board.coil)
    steps = len(run.board.steps)
    run.check("not while a car charges", tool.install(first) == ("refused", 21), "")
    run.check("nothing is written", len(run.board.steps) == steps, "")
    run.check("a pause", tool.order(override(2)) == "done", "")
    run.to(run.board.us * 1e-6 + 0.3)
    before = run.board.us * 1e-6
    run.check("then it is taken", tool.install(first) == ("installed", 1), "")
    run.check("the pilot stays at rest meanwhile", run.offers(before, run.board.us * 1e-6) == [0], "")
    erased = [at_s for at_s, what, _ in run.board.steps if what == "erase"]
    return run.sound(late_ok=[(at_s, at_s + 1.5) for at_s in erased])


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


def clock_wrap(images):
    """The loop's counter goes round, and so do the milliseconds, after 49.7 days: no tick is lost, a limit ends in time."""
    run, tool = provisioned(images.uni, car="A")
    board, turn_us, ms_round = run.board, 1 << 32, 1 << 32
    # The counter is moved to 5 s before its end: a jump is told, the wrap is not one.
    run.to(6.05)
    board.move_clock(turn_us - 5_000_000 - int(board.count(board.CLOCK, board.us)))
    run.to(16.0)
    jumped = [frame.now_ms for frame in run.between(6.0, 16.0) if frame.faults]
    run.check("the jump is told, the wrap is none", len(jumped) == 1, jumped)
    # On to 20 s before the milliseconds go round, by jumps of less than a round of the counter.
    while True:
        left_ms = ms_round - run.frames[-1].now_ms - 20_000
        if left_ms < 200:
            break
        board.move_clock(min(left_ms * 1_000, turn_us - 1_000_000))
        run.to(board.us * 1e-6 + 0.11)
    start = board.us * 1e-6 + 0.5
    run.check("it is about to go round", 4_294_940_000 < run.frames[-1].now_ms < ms_round, run.frames[-1].now_ms)
    run.check("a limit for 25 s", tool.order(limit(1, 0, 25)) == "done", "")
    at = board.us * 1e-6
    limits = lambda: site_limit(tool)
    run.check("is in force", limits() == 0, limits())
    run.to(at + 24.0)
    run.check("after the wrap too", limits() == 0 and run.frames[-1].now_ms < 100_000, run.frames[-1].now_ms)
    run.to(at + 26.0)
    run.check("and ends in time", limits() == 80_000, limits())
    around = run.between(start, 1e9)
    run.check("no fault around it", around and all(not f.faults for f in around), [f for f in around if f.faults][:1])
    return run.sound(late_ok=[(6.0, 6.3), (15.9, start)])


def site_limit(tool):
    """The site's limit in force, by the charger's status; none without an answer."""
    answer = tool.ask(STATUS)
    if not answer or answer[0] != STATUS:
        return None
    record = answer[1]
    reader = Reader(record)
    if reader.byte():
        fields(0.0, reader)
    _user, site, _cable = (reader.varint() for _ in range(3))
    return site


# Where settings and slots lie in the flash, and the names of what is asked for.
SETTINGS_AT, SLOTS_AT, SECTOR_LEN = 0x4000, 0xC000, 0x4000
IDENTITY, STATUS, CHALLENGE, PROVISION = 0, 1, 3, 5
DEAD_S = 0.6


def dead(run, count):
    """Whether the last resets but one came one after the other at the watchdog's time."""
    times = [at_s for at_s, _ in run.board.resets][-count - 1:]
    return len(times) == count + 1 and all(b - a < DEAD_S for a, b in zip(times, times[1:]))


def guarded(run, since_s, until_s):
    """What must hold in a guarded run: it is told, nothing is energised, it says who and how it is, and takes nothing."""
    frames = run.between(since_s, until_s)
    run.check("ticks of a guarded run", len(frames) > (until_s - since_s) * 9, len(frames))
    run.check("it is told", frames and all("guarded" in f.faults for f in frames), frames[:1])
    run.check("nobody's share is told", all(f.set_point in (("paused",), ("W", 0)) for f in frames), frames[:1])


def restart_loop(images):
    """Whatever stops each start at its settings or slots: three dead starts, then telemetry, at rest; a try in ten minutes."""
    cases = [
        (images.uni, "panic", SETTINGS_AT, 2 * SECTOR_LEN), (images.uni, "hang", SETTINGS_AT, 2 * SECTOR_LEN),
        (images.uni_chip, "fault", SLOTS_AT, 2 * SECTOR_LEN), (images.bi, "panic", SLOTS_AT, 2 * SECTOR_LEN),
    ]
    for image, how, at, length in cases:
        mains = Mains()
        run, tool = provisioned(image, mains=mains, chip=Chip(mains), uid=soon(image, mains=Mains(), chip=Chip(Mains())))
        board = run.board
        run.check("settings", tool.order(settings((12, 120), (18, 0))) == "done", "")
        steps = len(board.steps)
        board.stops_reading(at, length, how)
        start = board.us * 1e-6
        board.hang()
        run.to(start + 4.0)
        first = board.resets[-1][0]
        run.check("three dead starts, no more", len(board.resets) == 5 and dead(run, 3), board.resets)
        guarded(run, first + 0.15, start + 4.0)
        stopped = all(("stopped" in f.faults) == (how != "hang") for f in run.between(first, start + 4.0))
        run.check("how the last one ended", stopped, run.frames[-1])
        run.check("it says who it is", run.identity().settings == 2 and run.identity().provisioned, run.identity())
        answer = tool.ask(IDENTITY)
        run.check("and when asked", answer and answer[0] == IDENTITY, answer)
        run.check("it says how it is", site_limit(tool) == 80_000, "")
        refused = [tool.refusal(tool.ask(CHALLENGE)), tool.refusal(tool.provision()), tool.update(0)]
        run.check("no order, no key, no table", refused == ["flash", "flash", None], refused)
        # Past the delay of any start nothing is energised: a guarded run is not one that waits.
        board.move_clock(595_000_000 - run.frames[-1].now_ms * 1_000)
        run.to(board.us * 1e-6 + 3.0)
        late = run.between(board.us * 1e-6 - 2.0, 1e9)
        run.check("it lasts for ten minutes", 597_000 < late[-1].now_ms < 599_000, late[-1].now_ms)
        tried = board.us * 1e-6
        run.to(tried + 6.0)
        run.check("then one start tries all", len(board.resets) == 7 and dead(run, 1), board.resets)
        again = board.resets[-1][0]
        guarded(run, again + 0.15, tried + 6.0)
        rested = board.us * 1e-6
        run.check("nothing was written", len(board.steps) == steps, board.steps[steps:][:3])
        # The cause goes; nobody does anything.
        board.trap = None
        board.move_clock(598_000_000 - run.frames[-1].now_ms * 1_000)
        run.to(rested + 3.5)
        well = run.frames[-1]
        run.check("without its cause it is over", "guarded" not in well.faults and well.sequence > 5, well)
        who = run.identity()
        run.check("its settings are in force again", who.settings == 1 and who.provisioned, who)
        at_rest(run, image is images.bi, 0.0, rested + 100.0)
        run.to(rested + 140.0)
        energised = [power_w(line) for _, line in states(board.pilot, rested + 130.0, rested + 140.0)]
        charges = any(energised) if image is images.bi else run.coil(rested + 130.0, rested + 140.0)
        run.check("and it charges, after its delay", charges, energised)
        moved = [(first, first + 4.0), (tried - 5.0, tried), (rested - 1.0, rested + 3.5)]
        yield run.sound(resets=8, late_ok=moved, dead=4)


def at_rest(run, bidirectional, start, end):
    """Nothing is energised by the pilot or by the power line."""
    if bidirectional:
        powers = {power_w(line) for _, line in states(run.board.pilot, start, end)}
        run.check("no power", powers == {0}, powers)
    else:
        run.rests("dead, guarded or waiting", start, end)


def restart_loop_deaf(images):
    """What stops each start that answers: after six, telemetry alone; a reset by a person begins anew."""
    run = Run(images.uni, uid=uid_of(5)).to(2.0)
    board = run.board
    board.stops_calling("write_answer", "panic")
    board.hang()
    run.to(9.0)
    run.check("six starts are stopped", len(board.resets) == 8 and dead(run, 6), board.resets)
    last = board.resets[-1][0]
    guarded(run, last + 0.15, 9.0)
    run.check("it answers nothing", Tool(run, serial_of(board.uid)).ask(IDENTITY) is None, "")
    run.rests("throughout", 0.0, board.us * 1e-6)
    board.trap = None
    at = board.us * 1e-6
    board.power_up(board.resets[0][1])
    run.to(at + 3.0)
    run.check("a reset by a person tries all", not run.frames[-1].faults and run.frames[-1].mode == "table", run.frames[-1])
    run.check("and it says who it is", run.identity().settings == 0, run.identity())
    return run.sound(resets=9, dead=6)


SCENARIOS = {
    "start": start, "no-car": no_car, "no-mains": no_mains, "mains-gone": mains_gone, "dead-crystal": dead_crystal,
    "crystal-fails": crystal_fails, "stopped": stopped, "event": event_uni, "event-bidirectional": event_bi, "event-bidirectional-ade7953": event_bi_chip,
    "watchdog-in-event": watchdog_in_event, "phase-step": phase_step, "phase-step-ade7953": phase_step_chip,
    "exact-50": exact, "jitter": jitter, "misfit": misfit, "ade7953": chip, "limits": limits,
    "in-an-event": in_an_event, "settings-stay": settings_stay, "settings-full": settings_full, "update": update,
    "busy": busy, "power-cuts": power_cuts, "clock-wrap": clock_wrap, "restart-loop": restart_loop,
    "restart-loop-deaf": restart_loop_deaf,
}
ON_REQUEST = set()
