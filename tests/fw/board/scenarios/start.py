"""Starts, cars, mains that are gone, crystals that fail, runs that are stopped."""

from checks import LIMIT_MA, OFF_S, Run, delay_ms, full, serial_of
from mains import Mains
from service import limit
from .common import provisioned, site_limit, soon


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
