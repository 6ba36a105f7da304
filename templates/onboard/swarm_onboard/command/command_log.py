"""The record of who commanded the robot: entries from any thread, written by a thread of its own.

No command and no loop waits for the disk. What cannot be written is kept for a while, then counted as lost.
"""

from __future__ import annotations

import contextlib
import math
import os
import sys
import threading
import time
from collections import OrderedDict, deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, NamedTuple, Sequence

from swarm_onboard.command.authority import Commander, Sender
from swarm_onboard.common.record_chain import BEGINNING, FILE, FULL, OLDER, line_after, whole_part

GAP = 10.0  # s; a shorter interruption is part of the span
MOST = 8  # spans at a time; one more ends the one whose last command is the oldest

Entry = Dict[str, Any]


class By(NamedTuple):
    """Whose commands a span has."""

    commander: str
    node: str
    host: str


@dataclass
class _Span:
    """``first`` and ``last`` command on the monotonic clock; ``ended``: the last one on the host's clock."""

    first: float
    last: float
    ended: float


class CommandSpans:
    """The spans that go on now. ``now`` is monotonic, ``time`` is s since 1970 by the host's clock."""

    def __init__(self) -> None:
        self._open: OrderedDict[By, _Span] = OrderedDict()  # the latest command at the end

    def admitted(self, by: By, now: float, time: float) -> list[Entry]:
        """Takes an obeyed command. Returns the entries that are due."""
        due = self.silent(now)
        span = self._open.pop(by, None)
        if span is None:
            if len(self._open) == MOST:
                due.append(_end(*self._open.popitem(last=False)))
            due.append({"time": round(time, 3), "event": "began", **by._asdict()})
            span = _Span(now, now, time)
        self._open[by] = span
        span.last, span.ended = now, time
        return due

    def silent(self, now: float) -> list[Entry]:
        """Returns the ends of the spans that have had no command for ``GAP``."""
        due = []
        while self._open and now >= next(iter(self._open.values())).last + GAP:
            due.append(_end(*self._open.popitem(last=False)))
        return due

    def next_silence(self) -> float:
        """Returns when ``silent`` has the next end if no command comes; infinity without a span."""
        return next(iter(self._open.values())).last + GAP if self._open else math.inf

    def close(self) -> list[Entry]:
        """Ends all spans. Returns their ends."""
        return self.silent(math.inf)


def _end(by: By, span: _Span) -> Entry:
    seconds = round(span.last - span.first, 1)
    return {"time": round(span.ended, 3), "event": "ended", **by._asdict(), "seconds": seconds}


_MOST_WAITING = 64  # entries
_RETRY = 5.0  # s until a failed write is repeated
_HANGS = 10.0  # s after which a write that has not returned is reported
_LAST_WRITE = 2.0  # s that the end of the process waits for it


class RecordFile:
    """The files of a record in ``folder``. A method that raises ``OSError`` may be called again."""

    def __init__(self, folder: Path, full: int = FULL) -> None:
        self._file, self._older, self._full = folder / FILE, folder / OLDER, full
        self._head = BEGINNING
        self._cut = 0
        self._size: int | None = None  # None until the head is read, and after a failed write

    def append(self, entries: Iterable[Entry]) -> None:
        """Writes all of ``entries`` through to the disk, or raises ``OSError``."""
        if self._size is None:
            self._size = self._read_head()
        if self._size >= self._full:
            self._file.replace(self._older)
            self._size = 0
        lines, head, cut = [], self._head, {"cut": self._cut} if self._cut else {}
        for entry in entries:
            line, head = line_after(head, {**entry, **cut})
            lines.append(line + b"\n")
            cut = {}
        size, self._size = self._size, None
        try:
            _write_through(self._file, b"".join(lines))
            if size == 0:
                _sync(self._file.parent)
        except OSError:
            with contextlib.suppress(OSError):
                os.truncate(self._file, size)
            raise
        self._size, self._head, self._cut = size + sum(map(len, lines)), head, 0

    def _read_head(self) -> int:
        """Reads the head; cuts off what a power cut left of a line. Returns the size of the file."""
        content = _content(self._file)
        size, self._head = whole_part(content)
        if size < len(content):
            os.truncate(self._file, size)
            self._cut += len(content) - size
        if size == 0:
            _, self._head = whole_part(_content(self._older))
        return size


class CommandLog:
    """``folder``: where the record is; without one nothing is recorded."""

    def __init__(
        self,
        folder: Path | None,
        started: Entry,
        clock: Callable[[], float] = time.monotonic,
        wall: Callable[[], float] = time.time,
    ) -> None:
        self._clock, self._wall = clock, wall
        self._spans = CommandSpans()
        self._waiting: deque[Entry] = deque([{"time": round(wall(), 3), "event": "started", **started}])
        self._lost = 0
        self._failure = ""
        self._writing_since = math.inf
        self._closing = False
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        if folder is not None:
            record = RecordFile(folder)
            self._thread = threading.Thread(target=self._write, args=(record,), name="record", daemon=True)
            self._thread.start()

    def admitted(self, commander: str, sender: Sender) -> None:
        """Takes an obeyed command of a node of ``commander``."""
        by = By(commander, sender.node, sender.host or "")
        with self._changed:
            self._add(self._spans.admitted(by, self._clock(), self._wall()))

    def trouble(self) -> str:
        """Returns why nothing is recorded now; empty if it is."""
        with self._changed:
            hangs = self._clock() > self._writing_since + _HANGS
            why = self._failure or ("the disk does not respond" if hangs else "")
        return f"commands are not recorded: {why}" if why else ""

    def close(self) -> None:
        """Ends the record of this process, as far as the disk takes it in time."""
        with self._changed:
            self._closing = True
            self._add(self._spans.close())
            self._changed.notify()
        if self._thread is not None:
            self._thread.join(_LAST_WRITE)

    def _add(self, entries: Sequence[Entry]) -> None:
        self._waiting.extend(entries)
        while len(self._waiting) > _MOST_WAITING:
            self._lost += 1 + self._waiting.popleft().get("lost", 0)
        if entries:
            self._changed.notify()

    def _write(self, record: RecordFile) -> None:
        while True:
            with self._changed:
                taken, lost = self._taken()
                if not taken:
                    return
                self._writing_since = self._clock()
            if lost:
                taken[0]["lost"] = lost
            failure = ""
            try:
                record.append(taken)
            except OSError as error:
                failure = error.strerror or str(error)
            with self._changed:
                self._writing_since = math.inf
                if failure and failure != self._failure:
                    print(f"commands are not recorded: {failure}", file=sys.stderr, flush=True)
                self._failure = failure
                if not failure:
                    continue
                self._waiting.extendleft(reversed(taken))
                self._add(())
                if self._closing:
                    return
                self._changed.wait_for(lambda: self._closing, _RETRY)

    def _taken(self) -> tuple[list[Entry], int]:
        """Waits for entries and takes them, with the number of those lost before; none at the end."""
        while not self._waiting and not self._closing:
            silence = self._spans.next_silence()
            self._changed.wait(None if silence == math.inf else max(0.0, silence - self._clock()))
            self._waiting.extend(self._spans.silent(self._clock()))
        taken, lost = list(self._waiting), self._lost
        self._waiting.clear()
        self._lost = 0
        return taken, lost


def command_log(commanders: Sequence[Commander]) -> CommandLog:
    """Returns the record in the StateDirectory of this unit, which begins with who may command."""
    folder = os.environ.get("STATE_DIRECTORY")
    ordered = sorted(commanders, key=lambda one: -one.priority)
    may = [f"{one.name} (priority {one.priority})" for one in ordered]
    release = Path(sys.argv[0]).resolve().parent.parent.name
    return CommandLog(Path(folder) if folder else None, {"release": release, "commanders": may})


def _content(path: Path) -> bytes:
    with contextlib.suppress(FileNotFoundError):
        return path.read_bytes()
    return b""


def _write_through(path: Path, content: bytes) -> None:
    descriptor = os.open(str(path), os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o600)
    with os.fdopen(descriptor, "wb", buffering=0) as file:
        while content:
            content = content[file.write(content) :]
        os.fsync(descriptor)


def _sync(folder: Path) -> None:
    descriptor = os.open(str(folder), os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
