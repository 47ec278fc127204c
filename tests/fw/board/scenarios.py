"""The scenarios. Each states what must hold; docs/board.md says why."""

import struct
import zlib

from checks import LIMIT_MA, OFF_S, Run, delay_ms, full, offered, power_w, serial_of, states, threshold_of, uid_of
from mains import Chip, Grid, Mains

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


def event(images, image, fleet_gw, lowest_hz, band, settled_s, given):
    """A loss of 2 GW in closed loop, to its end: the bounds of docs/guarantees.md, quiet, and back again."""
    grid = Grid(fleet_gw, 2.0, 63.0, 103.0)
    run = Run(image, Mains(grid.hz), uid=soon(image))
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


def clock_wrap(images):
    """The microsecond counter goes round after 71.6 minutes; no tick is lost. Only if asked for: it takes minutes."""
    run = Run(images.uni, car="A").to(4330.0)
    around = run.between(4280.0, 4330.0)
    run.check("no fault around it", around and all(not f.faults for f in around), around[:1])
    return run.sound()


SCENARIOS = {
    "start": start, "no-car": no_car, "no-mains": no_mains, "mains-gone": mains_gone, "dead-crystal": dead_crystal,
    "crystal-fails": crystal_fails, "stopped": stopped, "event": event_uni, "event-bidirectional": event_bi,
    "watchdog-in-event": watchdog_in_event, "phase-step": phase_step, "phase-step-ade7953": phase_step_chip,
    "exact-50": exact, "jitter": jitter, "misfit": misfit, "ade7953": chip, "clock-wrap": clock_wrap,
}
ON_REQUEST = {"clock-wrap"}
