"""Log entries of journald: rated by level, merged over hosts in the order of time. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

from swarm_onboard.agent.verbs import logs

LEVELS = ("debug", "info", "warn", "error", "fatal")
WINDOW = 1.0  # s by which entries of one host may arrive after later ones of another
MOST_PENDING = 20_000  # entries
_OF_PRIORITY = ("fatal", "fatal", "fatal", "error", "warn", "info", "info", "debug")  # syslog(3)
_OF_ROS = re.compile(r"\[ *(DEBUG|INFO|WARN|ERROR|FATAL)(?:ING)? *\]")
_OF_DRIVER = re.compile(r"(OK|WARN|ERROR): ")  # as drivers and gates of swarmctl begin a line
# What rospy says of each look of our probe, and Fast DDS of a priority that its threads have anyway.
_OF_NO_CONCERN = re.compile(
    r"topic\[[^]]*\] (adding|removing) connection to \[?/swarmctl_probe_"
    r"|Problem to set scheduler of thread with id \[[^]]*\] to value 0\. Error 'Operation not permitted'"
)
_ROS_WITHIN = 40  # characters in which rospy and rclpy print the level
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")  # as roscpp writes around a warning
_TRACEBACK = "Traceback (most recent call last):"
_TOGETHER = 0.05  # s between two lines of one output
_MOST_LINES = 200  # of one message
_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
_FORMATS = ("%Y-%m-%d %H:%M:%S", "%Y-%m-%d %H:%M", "%Y-%m-%d")


@dataclass(frozen=True)
class Entry:
    """One message, of several lines if they came together; ``time``: s since 1970 by the operator's clock."""

    time: float
    host: str
    source: str
    level: str
    message: str


@dataclass(frozen=True)
class Choice:
    """Which entries are shown: those of ``level`` or worse that match."""

    level: str = LEVELS[0]
    pattern: re.Pattern[str] | None = None

    def __contains__(self, entry: Entry) -> bool:
        """True if the entry is shown."""
        worse = LEVELS.index(entry.level) >= LEVELS.index(self.level)
        return worse and (self.pattern is None or self.pattern.search(entry.message) is not None)


def entry_of(read: logs.Entry, host: str, swarm: str, offset: float) -> Entry:
    """The entry that a host has sent; ``offset``: how far its clock is ahead of the operator's, in s."""
    message = _COLOUR.sub("", read.message)
    named = _OF_ROS.search(message[:_ROS_WITHIN]) or _OF_DRIVER.match(message)
    level = named[1].lower().replace("ok", "info") if named else _OF_PRIORITY[read.priority & 7]
    if message.startswith(_TRACEBACK):
        level = "error"
    elif _OF_NO_CONCERN.search(message):
        level = "debug"
    return Entry(read.time - offset, host, source_of(read.unit, swarm), level, message)


def source_of(unit: str, swarm: str) -> str:
    """What people call a unit of the swarm: ``k3``, ``k3/gate``, ``master``."""
    return unit.removeprefix(f"swarm-{swarm}.").removesuffix(".service").replace(".", "/")


@dataclass
class _Pending:
    entry: Entry
    arrived: float
    last: float
    lines: int = 1

    def goes_on(self, later: Entry) -> bool:
        """True if ``later``, of the same source, is the next line of the same output, as of a traceback."""
        if not 0.0 <= later.time - self.last <= _TOGETHER or self.lines == _MOST_LINES:
            return False
        if later.message[:1] in ("", " ", "\t") or later.message.startswith(_TRACEBACK):
            return True
        before = self.entry.message
        unrated = _OF_ROS.search(later.message[:_ROS_WITHIN]) is None
        return unrated and _TRACEBACK in before and before.rpartition("\n")[2][:1] in ("", " ")

    def take(self, later: Entry) -> None:
        worst = max(self.entry.level, later.level, key=LEVELS.index)
        self.entry = replace(self.entry, level=worst, message=f"{self.entry.message}\n{later.message}")
        self.last = later.time
        self.lines += 1


class Merge:
    """Puts the entries of hosts into the order of time as they arrive. No host waits for another one."""

    def __init__(self) -> None:
        self._pending: list[_Pending] = []
        self._latest: dict[tuple[str, str], _Pending] = {}

    def add(self, entry: Entry, now: float) -> None:
        """Takes an entry that has arrived ``now``, in s of any clock; those of a source in their order."""
        source = entry.host, entry.source
        latest = self._latest.get(source)
        if latest is not None and latest.goes_on(entry):
            latest.take(entry)
            return
        self._latest[source] = _Pending(entry, now, entry.time)
        self._pending.append(self._latest[source])

    def due(self, now: float) -> Iterator[Entry]:
        """Yields the entries that have waited for ``WINDOW``, and earlier ones, in the order of time."""
        ordered = sorted(self._pending, key=lambda one: one.entry.time)
        ready = [number for number, one in enumerate(ordered, 1) if now - one.arrived >= WINDOW]
        number = max(len(ordered) - MOST_PENDING, *ready[-1:], 0)
        self._pending = ordered[number:]
        kept = set(map(id, self._pending))
        self._latest = {source: one for source, one in self._latest.items() if id(one) in kept}
        yield from (one.entry for one in ordered[:number])

    def rest(self) -> Iterator[Entry]:
        """Yields all that are left, in the order of time."""
        return self.due(float("inf"))


def since(text: str, now: datetime) -> float:
    """The time that ``10m``, ``21:00`` or ``2026-11-26 21:00`` means, in s since 1970; or ``ValueError``."""
    if ago := re.fullmatch(r"(\d{1,6})([smhd])", text):
        return (now - timedelta(seconds=int(ago[1]) * _UNITS[ago[2]])).timestamp()
    readings = (_time(full, form) for form in _FORMATS for full in (text, f"{now:%Y-%m-%d} {text}"))
    found = next((reading for reading in readings if reading is not None), None)
    if found is None:
        raise ValueError(text)
    return found


def _time(text: str, form: str) -> float | None:
    try:
        return datetime.strptime(text, form).astimezone().timestamp()
    except ValueError:
        return None
