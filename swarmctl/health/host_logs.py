"""Reads the logs of the swarm's units from hosts: what they have, or what comes, over links that get lost."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from queue import Queue

from swarm_onboard.agent.verbs import logs

from swarmctl.health.log_entries import Entry, entry_of
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.answer_check import of_note
from swarmctl.remote.ask import ask
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import AgentSession, HostError, Session, Target, Transport

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
