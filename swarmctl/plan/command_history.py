"""Who commanded which robot from when to when, from the records on its hosts, each checked. Pure.

A record proves itself by its chain: a line that is changed, removed or moved breaks it. A record that was
written anew as a whole, or cut at its end, is found by the head that was read before.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from heapq import merge
from math import isfinite
from typing import Any

from swarm_onboard.common.record_chain import BEGINNING, FULL, Head, digest_of, parsed

CHANGED = "changed since you read it last"


@dataclass(frozen=True)
class Span:
    """Commands of one node. ``seconds`` is None where no end is recorded; ``ongoing``: none can be yet."""

    time: float
    commander: str
    node: str
    address: str
    seconds: float | None
    ongoing: bool


@dataclass(frozen=True)
class Start:
    """A start of the program that decides. ``commanders`` may command from then on; ``changed``: others
    than before, or it is the first one. ``cut``: bytes of a line that was not complete."""

    time: float
    release: str
    commanders: tuple[str, ...]
    changed: bool
    cut: int


@dataclass(frozen=True)
class Record:
    """A robot's record on one host. ``since``: when its first line was written, s since 1970.

    ``problem``: why it proves nothing; ``notes``: what it lacks.
    """

    events: tuple[Span | Start, ...] = ()
    head: Head = BEGINNING
    since: float | None = None
    problem: str = ""
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Returns the record as ``history --commands --json`` prints it, without its events."""
        return {
            "since": self.since, "entries": self.head.number, "problem": self.problem, "notes": self.notes
        }  # fmt: skip


@dataclass(frozen=True)
class Event:
    """A row of the merged list."""

    host: str
    robot: str
    what: Span | Start

    def to_json(self) -> dict[str, Any]:
        """Returns the row as ``history --commands --json`` prints it."""
        event = "commanded" if isinstance(self.what, Span) else "started"
        return {"host": self.host, "robot": self.robot, "event": event, **asdict(self.what)}


def events(records: Mapping[tuple[str, str], Record]) -> list[Event]:
    """Returns the events of all records by host and robot, by the hosts' clocks, each record in its order."""
    rows = ([Event(*key, what) for what in record.events] for key, record in records.items())
    return list(merge(*rows, key=lambda row: row.what.time))


def read(text: str, seen: Head | None) -> Record:
    """Returns the record with the lines in ``text``. ``seen``: its head when it was read last."""
    lines = [line.encode("utf-8") for line in text.split("\n") if line]
    checked = _Checked(seen or BEGINNING)
    for line in lines:
        checked.take(line)
    size = sum(len(line) + 1 for line in lines)
    return Record(
        events=tuple(_events(checked.entries)),
        head=checked.head,
        since=checked.entries[0]["time"] if checked.entries else None,
        problem=checked.problem or checked.missing(size),
        notes=tuple(checked.notes),
    )


@dataclass
class _Checked:
    """What is known of a record after some of its lines."""

    seen: Head
    head: Head = BEGINNING
    first: int = 0
    problem: str = ""
    entries: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def take(self, line: bytes) -> None:
        entry = parsed(line)
        if entry is None or not _fits(entry):
            self.problem = self.problem or f"the line after entry {self.head.number} is damaged"
            return
        number = entry["number"]
        if not self.entries:
            self.first = number
            begins = number > 1 or entry["previous"] == ""
        else:
            begins = number == self.head.number + 1 and entry["previous"] == self.head.digest
        if not begins:
            text = f"entry {number} does not follow entry {self.head.number}: lines were changed or removed"
            self.problem = self.problem or text
        self.head = Head(number, digest_of(line))
        if number == self.seen.number and self.head != self.seen:
            self.problem = f"{CHANGED}: entry {number} is another one"
        self.entries.append(entry)
        if entry.get("lost"):
            self.notes.append(f"{entry['lost']} entries before entry {number} could not be written")

    def missing(self, size: int) -> str:
        """What lacks at both ends. ``size``: bytes of all lines; only a full file is replaced by the next."""
        if self.head.number < self.seen.number:
            return f"{CHANGED}: it has {self.head.number} entries, and had {self.seen.number}"
        if self.first > 1 and size < FULL:
            return f"it begins with entry {self.first}: the lines before were removed"
        if self.seen.number and self.first > self.seen.number + 1:
            gone = f"entries {self.seen.number + 1} to {self.first - 1}"
            self.notes.append(f"{gone} were replaced by newer ones before you read them")
        return ""


_BY = ("commander", "node", "host")
_TEXTS = {"began": _BY, "ended": _BY, "started": ("release",)}  # by event


def _fits(entry: Mapping[str, Any]) -> bool:
    """Whether the values of an entry are of their types."""
    texts = _TEXTS.get(str(entry.get("event")))
    return (
        texts is not None
        and entry["number"] > 0
        and all(isinstance(entry.get(name), str) for name in texts)
        and _is_number(entry.get("time"))
        and (entry["event"] != "ended" or _is_number(entry.get("seconds")))
        and (entry["event"] != "started" or isinstance(entry.get("commanders"), list))
        and all(_is_number(entry.get(name, 0)) for name in ("cut", "lost"))
    )


def _is_number(value: object) -> bool:
    return type(value) in (int, float) and abs(value) < 1e11 and isfinite(value)  # type: ignore[arg-type]


def _events(entries: Sequence[Mapping[str, Any]]) -> Iterator[Span | Start]:
    """The spans, each where it began, and the starts."""
    ends = _ends(entries)
    ended = set(ends.values())
    last_start = max((place for place, one in enumerate(entries) if one["event"] == "started"), default=0)
    before: tuple[str, ...] | None = None
    for place, entry in enumerate(entries):
        if entry["event"] == "started":
            commanders = tuple(str(one) for one in entry["commanders"])
            cut = int(entry.get("cut", 0))
            yield Start(entry["time"], entry["release"], commanders, commanders != before, cut)
            before = commanders
        elif entry["event"] == "began":
            seconds = entries[ends[place]]["seconds"] if place in ends else None
            yield _span(entry, entry["time"], seconds, ongoing=seconds is None and place > last_start)
        elif place not in ended:  # its begin could not be written, or was replaced by newer lines
            yield _span(entry, entry["time"] - entry["seconds"], entry["seconds"], ongoing=False)


def _span(entry: Mapping[str, Any], began: float, seconds: float | None, *, ongoing: bool) -> Span:
    return Span(began, entry["commander"], entry["node"], entry["host"], seconds, ongoing)


def _ends(entries: Sequence[Mapping[str, Any]]) -> Mapping[int, int]:
    """The place of each end by that of its begin; a start of the program leaves spans without an end."""
    found: dict[int, int] = {}
    begun: dict[tuple[str, str, str], int] = {}
    for place, entry in enumerate(entries):
        if entry["event"] == "started":
            begun.clear()
            continue
        by = entry["commander"], entry["node"], entry["host"]
        if entry["event"] == "began":
            begun[by] = place
        elif by in begun:
            found[begun.pop(by)] = place
    return found
