"""``logs``: what the swarm's units have logged, within limits; or what they log from now on."""

from __future__ import annotations

import os
import select
import subprocess
import time
from contextlib import contextmanager
from functools import partial

from swarm_onboard.agent import json_text
from swarm_onboard.agent.command import plain_environment
from swarm_onboard.agent.errors import FailedError
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.texts import clipped

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Iterator, Sequence

MOST_BYTES = 4 << 20  # of one answer, or of the notes of one request
_LONGEST = 4096  # characters of a message
_LONGEST_LINE = 1 << 20  # bytes of an entry as journalctl prints it
_CHUNK = 1 << 16
_LOOK = 0.25  # s between two looks at the units and at the operator
_PAUSE = 0.05  # s in which entries gather for one note
# The fields by which journalctl finds the entries of a unit (systemd.journal-fields(7)). The last one has the
# unit of the process that logged, and is missing if the process had ended before journald looked.
_UNIT_FIELDS = ("UNIT", "COREDUMP_UNIT", "OBJECT_SYSTEMD_UNIT", "_SYSTEMD_UNIT")
_FIELDS = ",".join(("MESSAGE", "PRIORITY", *_UNIT_FIELDS))
_JOURNALCTL = ("journalctl", "--quiet", "--no-pager", "--all", "--output=json", "--output-fields=" + _FIELDS)


class Request(NamedTuple):
    """What units have logged: the last ``lines`` since ``since``, of the host's clock in s since 1970.

    ``parts``: the first parts of their names, such as robots; empty for all units of the swarm.
    ``follow``: for how long, in s, entries after the cursor ``after`` (else since ``since``) are sent as
    notes, each the JSON of an answer.
    """

    swarm: str
    parts: list[str]
    lines: int = 0
    since: float = 0.0
    after: str = ""
    follow: float = 0.0


class Entry(NamedTuple):
    """``time``: of the host's clock, s since 1970; ``priority``: of syslog(3)."""

    time: float
    unit: str
    priority: int
    message: str


class Answer(NamedTuple):
    """``clock``: of the host as it began, s since 1970; ``entries``: the oldest first; ``cursor``: of the
    last one, empty without any; ``cut``: there are more."""

    clock: float
    entries: list[Entry]
    cursor: str
    cut: bool


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns the last entries, or sends new ones; without lines and without ``follow`` the clock alone."""
    began, units = time.time(), _units(request)
    if request.follow:
        _follow(request, units, report)
    elif request.lines and units:
        return _last(request, units, began)
    return Answer(began, [], "", False)


def _units(request: Request) -> list[str]:
    """The units that are deployed. A pattern would miss those that begin to log later."""
    folder, prefix = home_of(request.swarm).outside("/etc/systemd/system"), f"swarm-{request.swarm}."
    try:
        found = [name for name in os.listdir(folder) if name.startswith(prefix) and name.endswith(".service")]
    except OSError:
        return []
    parts = request.parts
    return sorted(one for one in found if not parts or one[len(prefix) :].partition(".")[0] in parts)


def _last(request: Request, units: Sequence[str], began: float) -> Answer:
    since = [f"--since=@{request.since:.6f}"] if request.since else []
    entries: list[Entry] = []
    cursor, size, cut = "", 0, False
    # The newest first: of a long journal no more is read than is sent.
    with _journal(["--reverse", *since], units) as process:
        assert process.stdout is not None
        for line in iter(partial(process.stdout.readline, _LONGEST_LINE), b""):
            fields = _fields(line)
            entry = _entry(fields)
            if entry is None or entry.time < request.since:
                continue
            size += len(entry.message)
            cut = len(entries) == request.lines or size > MOST_BYTES
            if cut:
                break
            entries.append(entry)
            cursor = cursor or _cursor(fields)
        else:
            if process.wait():
                raise _broken(process)
    return Answer(began, entries[::-1], cursor, cut)


def _follow(request: Request, units: list[str], report: Report) -> None:
    """Sends entries until the time is over, units come or go, enough was sent, or the operator is gone."""
    end = time.monotonic() + request.follow
    start = f"--after-cursor={request.after}" if request.after else f"--since=@{request.since:.6f}"
    rest, sent = b"", 0
    with _journal(["--follow", "--no-tail", start], units) as process:
        assert process.stdout is not None
        output = process.stdout.fileno()
        while time.monotonic() < end and sent < MOST_BYTES and _units(request) == units:
            ready = select.select([output, 0], [], [], _LOOK)[0]
            if output in ready:
                time.sleep(_PAUSE)
                piece = os.read(output, _CHUNK)
                if not piece:
                    raise _broken(process)
                *lines, rest = (rest + piece).split(b"\n")
                rest = rest if len(rest) <= _LONGEST_LINE else b""
                sent += _send(lines, report)
            elif ready:  # standard input has ended
                return


def _send(lines: Sequence[bytes], report: Report) -> int:
    """Sends a note with the entries; returns its length."""
    read = [fields for fields in map(_fields, lines) if fields]
    if not read:
        return 0
    entries = [one for one in map(_entry, read) if one is not None]
    text = json_text.dumps(Answer(time.time(), entries, _cursor(read[-1]), False))
    report.note(text)
    return len(text)


@contextmanager
def _journal(options: Sequence[str], units: Sequence[str]) -> Iterator[subprocess.Popen[bytes]]:
    """Runs journalctl for these units, which ends with the block."""
    # Without any it would print those of the whole host.
    names = [f"--unit={unit}" for unit in units or ("swarm-none.service",)]
    process = subprocess.Popen(
        [*_JOURNALCTL, *options, *names],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=plain_environment(),
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def _broken(process: subprocess.Popen[bytes]) -> FailedError:
    return FailedError(f"journalctl ended with status {process.wait()}", "is the journal of the host intact?")


def _fields(line: bytes) -> dict[str, Any]:
    """The fields in a line of JSON; none for anything else."""
    try:
        found = json_text.loads(line.decode("utf-8"))
    except ValueError:
        return {}
    return found if isinstance(found, dict) and "__CURSOR" in found else {}


def _cursor(fields: dict[str, Any]) -> str:
    return str(fields["__CURSOR"])


def _entry(fields: dict[str, Any]) -> Entry | None:
    """What is sent of the fields of an entry; None if one is missing or wrong."""
    try:
        message = fields["MESSAGE"]
        if isinstance(message, list):  # bytes that are no text, or have colours
            message = bytes(message).decode("utf-8", "backslashreplace")
        return Entry(
            int(fields["__REALTIME_TIMESTAMP"]) / 1e6,
            next(str(fields[name]) for name in _UNIT_FIELDS if fields.get(name)),
            int(fields.get("PRIORITY", 6)) & 7,
            clipped(message, _LONGEST),
        )
    except (ValueError, KeyError, TypeError, StopIteration):
        return None
