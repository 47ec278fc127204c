"""What scenarios have in common."""

from checks import Run, delay_ms, serial_of, uid_of
from service import Tool
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


def tool_for(run):
    return Tool(run, serial_of(run.board.uid))


def provisioned(image, **wired):
    """A charger that has its key, from 2 s on, and the tool that has it too."""
    run = Run(image, **wired).to(2.0)
    tool = tool_for(run)
    answer = tool.provision()
    run.check("it takes its first key", answer and answer[0] == 5, answer)
    return run, tool


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
