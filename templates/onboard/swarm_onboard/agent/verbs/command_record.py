"""``command_record``: who commanded a robot of this host, as its driver or gate recorded it."""

from __future__ import annotations

import os
import stat
from contextlib import suppress

from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.paths import COMMANDS
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.common.record_chain import BEGINNING, FILE, FULL, OLDER, Head, digest_of, parsed

_LONGEST = FULL + (1 << 18)  # bytes; one write goes past the limit
_MOST_ROBOTS = 1000


class Request(NamedTuple):
    """Who commanded ``robot``; empty for the names of the robots alone."""

    swarm: str
    robot: str = ""


class Answer(NamedTuple):
    """``robots``: those with a record on the host; ``text``: the lines of one (see ``record_chain``)."""

    robots: list[str]
    text: str


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns the robots with a record, and the lines of that of ``robot``."""
    home = home_of(request.swarm)
    folder = home.outside(f"{COMMANDS}/{home.swarm}")
    robots: list[str] = []
    with suppress(FileNotFoundError):
        robots = sorted(os.listdir(folder))[:_MOST_ROBOTS]
    text = _lines(os.path.join(folder, request.robot)) if request.robot in robots else b""
    return Answer(robots, text.decode("ascii", "backslashreplace"))


def problem(folder: str) -> str:
    """Returns what is wrong with the record of a robot whose unit runs; empty if nothing is."""
    lines = _lines(folder).splitlines()
    if not lines:
        return "is empty, and the start of its unit is not in it"
    first = parsed(lines[0])
    if first is None:
        return "is damaged at its beginning"
    head = BEGINNING
    if _content(os.path.join(folder, OLDER))[1]:  # what was before it may have been replaced
        head = Head(first["number"] - 1, first["previous"])
    for line in lines:
        number = head.number + 1
        # As line_after writes it: to compare bytes takes far less time than to parse all lines.
        if not line.startswith(b'{"number": %d, "previous": "%s"' % (number, head.digest.encode())):
            return f"is broken: entry {number} is missing, or one before it was changed"
        head = Head(number, digest_of(line))
    return ""


def _lines(folder: str) -> bytes:
    """The whole lines of a record; the last one may just be written."""
    current, content = _content(os.path.join(folder, FILE))
    older, before = _content(os.path.join(folder, OLDER))
    # The newer file may have become the older one meanwhile.
    whole = content if current == older else before + content
    return whole[: whole.rfind(b"\n") + 1]


def _content(path: str) -> tuple[int, bytes]:
    """The inode and the content of a file that the account of a unit writes; no link is followed."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return 0, b""
    with os.fdopen(descriptor, "rb") as file:
        found = os.fstat(descriptor)
        return found.st_ino, file.read(_LONGEST) if stat.S_ISREG(found.st_mode) else b""
