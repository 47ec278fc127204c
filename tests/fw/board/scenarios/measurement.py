"""Phase steps, jitter, an exact mains, bits lost on the bus."""

from checks import LIMIT_MA, Run, serial_of, threshold_of
from mains import Chip, Mains
from .common import soon


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
