"""What stops every start."""

from checks import Run, power_w, serial_of, states, uid_of
from mains import Chip, Mains
from service import Tool, settings
from .common import CHALLENGE, IDENTITY, SECTOR_LEN, SETTINGS_AT, SLOTS_AT, provisioned, site_limit, soon

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
