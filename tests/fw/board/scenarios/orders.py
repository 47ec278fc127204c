"""Limits and settings over the line."""

from checks import Run, full
from mains import Grid, Mains
from service import RESTART, limit, override, settings
from .common import provisioned, soon, tool_for
from .event import close_loop


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
