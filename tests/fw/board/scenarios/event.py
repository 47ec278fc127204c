"""The event in closed loop."""

from checks import OFF_S, SPAN_W, Run, offered, power_w, states
from mains import Chip, Grid, Mains
from .common import soon


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
