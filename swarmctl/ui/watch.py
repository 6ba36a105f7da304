"""Watches each host over one connection, at its own pace: a silent host delays no other.

Meanwhile the host sends how its robots move; a change there brings the next look, one of ``status``.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from swarm_onboard.agent.verbs import telemetry
from swarm_onboard.agent.verbs.probe import Answer, Request
from swarm_onboard.agent.verbs.telemetry import RobotTelemetry, Telemetry
from swarm_onboard.ros2_probe import discovery

from swarmctl.health.collect import probed, request
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost
from swarmctl.health.host_logs import VERBS, Entry, HostReader, Question
from swarmctl.remote import agent_client
from swarmctl.remote.answer_check import of_note
from swarmctl.remote.ask import ask
from swarmctl.remote.parallel_hosts import Stop, bugs_as_errors, stream
from swarmctl.remote.transport import HostError, Kind, Session, Target, Transport

WINDOW = 0.5  # s of listening to a topic, unless it is slow
PERIOD = 0.2  # s between two messages on how robots move
_PAUSE = 15.0  # s between two looks at a host, if nothing is new
_AGAIN = 1.0  # s until a host that failed is connected to again
_OVERDUE = 5.0  # s that a host takes for a look beside listening, at most, before it counts as silent
_DISCOVERY = discovery.LONGEST + 5.0  # s more where nodes find each other without a master
_SILENT = 4.0  # s without a message on motion, of which five should have come a second
_PATIENCE = 50.0  # s for one look at most
_LINES = 200  # of a log
_TURN = 30.0  # s of messages on motion for one request


@dataclass(frozen=True)
class Seen:
    """The last outcome of each host; the oldest is ``age`` s old."""

    outcomes: Mapping[str, Answer | HostError]
    age: float


class Watch:
    """Watches the hosts from ``start`` to ``stop``. Threads of the hosts call ``on_telemetry``."""

    def __init__(
        self,
        graph: ExpectedGraph,
        targets: Mapping[str, Target],
        transport: Transport,
        on_telemetry: Callable[[Telemetry], None],
    ) -> None:
        self._swarm, self._transport, self._on_telemetry = graph.swarm, transport, on_telemetry
        self._hosts = [_Watched(graph, host, targets[host.name]) for host in graph.hosts]
        self._lock = threading.Lock()
        self._last: dict[str, tuple[float, Answer | HostError]] = {}  # with the time of monotonic()
        self._began = 0.0
        self._changed = threading.Event()
        self._stop = Stop()

    def start(self) -> None:
        """Begins to watch."""
        self._stop = Stop()
        self._last, self._began = {}, time.monotonic()
        targets, stop = [host.target for host in self._hosts], self._stop
        hosts = {host.name: host for host in self._hosts}

        def failed(host: str, error: HostError) -> float:
            self._take(hosts[host], error, stop)
            return _AGAIN

        stream(
            targets,
            lambda session, target: self._look(hosts[target.host], session, stop),
            failed,
            transport=self._transport,
            stop=stop,
        )

    def stop(self) -> None:
        """Closes the connections and ends the threads."""
        self._stop.request()
        self._stop.request()
        for host in self._hosts:
            host.news.set()

    def wait(self, timeout: float) -> Seen | None:
        """What is seen once an outcome is new, or the time is up; None in the first s without all.

        A host whose answer is overdue has an error instead.
        """
        self._changed.wait(timeout)
        self._changed.clear()
        now = time.monotonic()
        with self._lock:
            last = dict(self._last)
        if len(last) < len(self._hosts) and now - self._began < _OVERDUE:
            return None
        outcomes: dict[str, Answer | HostError] = {}
        for host in self._hosts:
            at, outcome = last.get(host.name, (self._began, None))
            reported = host.reported
            if outcome is None or now - at > host.longest:
                outcome = _silent(now - at)
            elif reported is not None and now - reported > _SILENT:
                outcome = _silent(now - reported)
            outcomes[host.name] = outcome
        return Seen(outcomes, now - min((at for at, _ in last.values()), default=self._began))

    def log(self, host: str, parts: Sequence[str]) -> list[Entry]:
        """The last log entries of these robots and programs of a host, of all without any.

        Raises ``HostError``.
        """
        session = next(one.session for one in self._hosts if one.name == host)
        if session is None:
            raise HostError(Kind.LOST, f"{host} is not connected")
        question = Question(self._swarm, {host: parts}, _LINES, 0.0)
        with agent_client.agent_session(session, verbs=VERBS) as agent:
            return HostReader(question, host).last(agent).entries

    def _look(self, host: _Watched, session: Session, stop: Stop) -> None:
        """Looks over one connection until it ends. Raises ``HostError``."""
        host.reported, host.bug, host.session = None, None, session
        try:
            with agent_client.agent_session(session, verbs=("probe",), module=host.probe) as agent:
                if host.robots:
                    threading.Thread(target=self._follow, args=(host, session, stop), daemon=True).start()
                while not stop.requested:
                    host.news.clear()
                    answer = probed(agent, host.request, _PATIENCE)
                    if host.bug is not None:
                        raise host.bug
                    self._take(host, answer, stop)
                    host.news.wait(_PAUSE)
        finally:
            if host.session is session:  # another page may have opened since
                host.session = None

    def _take(self, host: _Watched, outcome: Answer | HostError, stop: Stop) -> None:
        if not stop.requested:
            if isinstance(outcome, HostError):
                host.reported = None
            with self._lock:
                self._last[host.name] = time.monotonic(), outcome
            self._changed.set()

    def _follow(self, host: _Watched, session: Session, stop: Stop) -> None:
        """Passes on how the robots of a host move, as long as its connection lasts."""
        try:
            with (
                bugs_as_errors(host.name),
                agent_client.agent_session(session, verbs=("telemetry",)) as agent,
            ):
                while not stop.requested:
                    note = partial(self._note, host)
                    ask(agent, telemetry.handle, host.telemetry, on_note=note, timeout=_TURN + _OVERDUE)
        except HostError as error:
            if error.kind is Kind.BUG and host.session is session:
                host.bug = error
        host.reported = None
        host.news.set()  # a look shows at once whether the connection is lost

    def _note(self, host: _Watched, text: str) -> None:
        host.reported = time.monotonic()
        note = of_note(text, Telemetry, "what a host reports of its robots")
        if host.is_news(note):
            host.news.set()
        self._on_telemetry(note)


class _Watched:
    """A host, the requests to it, and whether something is new there since the last look at it began."""

    def __init__(self, graph: ExpectedGraph, host: ExpectedHost, target: Target) -> None:
        self.name, self.target, self.robots, self.probe = host.name, target, host.robots, host.probe
        self.request = request(graph, host, WINDOW)
        self.longest = _listening(self.request) + _PAUSE + _OVERDUE
        self.longest += _DISCOVERY if self.request.expected else 0.0
        devices = {robot.name: robot.device for robot in host.robots if robot.device}
        self.telemetry = telemetry.Request(graph.swarm, devices, PERIOD, _TURN)
        self.news = threading.Event()
        self.session: Session | None = None  # while it is connected
        self.bug: HostError | None = None  # in the thread that passes on motion
        self.reported: float | None = None  # when the connection last brought a message on motion
        self._state: object = None

    def is_news(self, note: Telemetry) -> bool:
        """Returns True if a driver, a device or a unit came or went, or a driver's trouble did."""
        troubles = {name: _trouble(one) for name, one in note.robots.items()}
        state = troubles, note.missing, note.units
        before, self._state = self._state, state
        return before is not None and state != before


def _trouble(one: RobotTelemetry) -> tuple[str, bool]:
    return one.trouble, one.held


def _listening(one: Request) -> float:
    """How long the host listens to topics, s."""
    topics = [*one.nodes.values(), *one.launched.values()]
    return max((seconds for of_node in topics for seconds in of_node.values()), default=0.0)


def _silent(age: float) -> HostError:
    return HostError(
        Kind.LOST, f"has not answered for {age:.0f} s", "is it switched on, and in reach of its network?"
    )
