"""Reads the logs of the swarm's units from hosts: what they have, or what comes, over links that get lost."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from queue import Queue

from swarm_onboard.agent.verbs import logs

from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.answer_check import of_note
from swarmctl.remote.ask import ask
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import AgentSession, HostError, Session, Target, Transport

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


VERBS = ("logs",)
ROUND = 30.0  # s that one request follows the journal
PAUSES = (1.0, 2.0, 4.0, 8.0, 10.0)  # s before a host is connected again
_MOST_WAITING = 64  # pieces of logs that are not yet shown; then the hosts wait
_LATE = 30.0  # s beyond a round


@dataclass(frozen=True)
class HostLog:
    """What a host has logged; ``offset`` is how far its clock is ahead, in s; ``cut`` if there was more."""

    entries: list[Entry]
    offset: float
    cut: bool


@dataclass(frozen=True)
class Question:
    """The last ``lines`` since ``since``, in s by the operator's clock, 0 for ever; of each host these parts.

    A host without ``parts`` shows all units of the swarm.
    """

    swarm: str
    parts: Mapping[str, Sequence[str]]
    lines: int
    since: float

    def request(self, host: str) -> logs.Request:
        """The request for the clock of a host alone."""
        return logs.Request(self.swarm, list(self.parts[host]))


@dataclass
class HostReader:
    """Reads one host, over one connection after the other; it knows what has been read."""

    question: Question
    host: str
    _cursor: str = ""
    _begun: float = 0.0  # by the clock of the host, once the last entries were read
    _offset: float = field(default=0.0, init=False)
    _failures: int = field(default=0, init=False)  # in a row

    def last(self, agent: AgentSession) -> HostLog:
        """The last entries. Raises ``HostError``."""
        self._measure(agent)
        question, request = self.question, self.question.request(self.host)
        since = max(0.0, question.since + self._offset) if question.since else 0.0
        answer = ask(agent, logs.handle, request._replace(lines=question.lines, since=since))
        self._cursor, self._begun = answer.cursor, answer.clock
        return self._log(answer)

    def follow(self, agent: AgentSession, show: Callable[[HostLog], None]) -> None:
        """Shows the last entries and all that come, until ``HostError``.

        What is shown first over another connection after a lost one may have no entries.
        """

        def take(note: str) -> None:
            answer = of_note(note, logs.Answer, "a note of `logs`")
            show(self._log(answer))
            self._cursor = answer.cursor

        show(HostLog([], self._offset, cut=False) if self._begun else self.last(agent))
        while True:
            self._measure(agent)
            request = self.question.request(self.host)
            request = request._replace(after=self._cursor, since=self._begun, follow=ROUND)
            ask(agent, logs.handle, request, on_note=take, timeout=ROUND + _LATE)
            self._failures = 0

    def failed(self, error: HostError) -> float | None:
        """Returns the s until the next connection after an error; None after one that stays."""
        pause = PAUSES[min(self._failures, len(PAUSES) - 1)]
        self._failures += 1
        return pause if error.retryable else None

    def _measure(self, agent: AgentSession) -> None:
        request = self.question.request(self.host)
        ask(agent, logs.handle, request)  # the first one starts the agent
        sent = time.time()
        clock = ask(agent, logs.handle, request).clock
        self._offset = clock - (sent + time.time()) / 2

    def _log(self, answer: logs.Answer) -> HostLog:
        entries = [entry_of(one, self.host, self.question.swarm, self._offset) for one in answer.entries]
        return HostLog(entries, self._offset, answer.cut)


def host_logs(
    question: Question, targets: Sequence[Target], transport: Transport, *, parallel: int
) -> Iterator[Event[HostLog]]:
    """Reads the last entries of every host. Yields events."""

    def work(session: Session, target: Target, note: object) -> HostLog:
        with agent_client.agent_session(session, verbs=VERBS) as agent:
            return HostReader(question, target.host).last(agent)

    return parallel_hosts.run(targets, work, transport=transport, parallel=parallel)


def followed(
    question: Question, targets: Sequence[Target], transport: Transport
) -> Queue[tuple[str, HostLog | HostError]]:
    """A queue of what hosts log, and of their errors; one connection a host, until the process ends."""
    waiting: Queue[tuple[str, HostLog | HostError]] = Queue(_MOST_WAITING)

    readers = {target.host: HostReader(question, target.host) for target in targets}

    def talk(session: Session, target: Target) -> None:
        with agent_client.agent_session(session, verbs=VERBS) as agent:
            readers[target.host].follow(agent, lambda found: waiting.put((target.host, found)))

    def failed(host: str, error: HostError) -> float | None:
        waiting.put((host, error))
        return readers[host].failed(error)

    parallel_hosts.stream(targets, talk, failed, transport=transport)
    return waiting
