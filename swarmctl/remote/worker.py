"""A worker: a process that has the SSH sessions of an operator who runs elsewhere, and asks agents for it.

It decides nothing: which host, which question and when to stop is the operator's.
"""

from __future__ import annotations

import pickle
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from swarmctl.remote import agent_client
from swarmctl.remote.agent_archive import Agent
from swarmctl.remote.lines import Line
from swarmctl.remote.parallel_hosts import Stop
from swarmctl.remote.transport import Conversation, HostError, Kind, Session, Target, Transport

BEAT = 5.0  # s between two signs of life of the operator
SILENCE = 6 * BEAT  # s without one, after which a worker closes its sessions
BATCH = 64  # messages that go together at most
GATHER = 0.01  # s that a message waits for others: each item of a line costs some ms of CPU time


@dataclass(frozen=True)
class KeepAgent:
    """Keep this agent, which is sent once to each worker; requests name it by its digest."""

    agent: Agent


@dataclass(frozen=True)
class Connect:
    """Open session ``number``."""

    number: int
    target: Target


@dataclass(frozen=True)
class Ask:
    """A request to the agent ``agent`` of the host of session ``number``."""

    number: int
    agent: str
    become: bool
    request: dict[str, Any]
    payload: bytes
    timeout: float


@dataclass(frozen=True)
class BecomeRoot:
    """Have the host of session ``number`` run the shortest command."""

    number: int


@dataclass(frozen=True)
class Close:
    """End session ``number`` at once."""

    number: int


@dataclass(frozen=True)
class End:
    """End all sessions, and the worker's task."""


@dataclass(frozen=True)
class Noted:
    """A note of the agent of session ``number``."""

    number: int
    note: str


@dataclass(frozen=True)
class Answered:
    """The end of a request: an answer, or an error. None: the session is open."""

    number: int
    answer: Any


Order = KeepAgent | Connect | Ask | BecomeRoot | Close | End
Report = Noted | Answered


def serve(login: Callable[[], Transport], orders: Line, reports: Line) -> None:
    """Carries out ``orders`` until their end, or until the operator has been silent for long."""
    outgoing: SimpleQueue[Report | None] = SimpleQueue()
    sender = threading.Thread(target=send, args=(outgoing, reports), daemon=True)
    sender.start()
    desk = _Desk(login(), outgoing.put)
    try:
        while (found := orders.get(SILENCE)) is not None:
            for order in pickle.loads(found):
                if isinstance(order, End):
                    return
                desk.take(order)
    finally:
        desk.close()
        outgoing.put(None)
        sender.join()


def send(messages: SimpleQueue[Any], line: Line, *, beat: float | None = None) -> None:
    """Puts messages on a line, as many at a time as wait, until one is None.

    With ``beat``, an empty batch goes there after so many s without a message.
    """
    batch: list[Any] = []
    while batch[-1:] != [None]:
        batch = _waiting(messages, beat)
        line.put(packed([one for one in batch if one is not None]))


def packed(messages: Sequence[Order | Report]) -> bytes:
    """Returns messages as one item of a line."""
    return pickle.dumps(messages, pickle.HIGHEST_PROTOCOL)


def _waiting(messages: SimpleQueue[Any], beat: float | None) -> list[Any]:
    """Waits for a message. Returns it with those behind it, up to the first None."""
    found: list[Any] = []
    with suppress(Empty):
        found.append(messages.get(timeout=beat))
        time.sleep(GATHER)
        while len(found) < BATCH and found[-1] is not None:
            found.append(messages.get_nowait())
    return found


class _Desk:
    """The sessions of one operator, each in a thread of its own."""

    def __init__(self, transport: Transport, report: Callable[[Report], None]) -> None:
        self._transport = transport
        self._report = report
        self._agents: dict[str, Agent] = {}
        self._sessions: dict[int, _Served] = {}

    def take(self, order: Order) -> None:
        """Carries out an order, or has the thread of its session do so."""
        if isinstance(order, KeepAgent):
            self._agents[order.agent.digest] = order.agent
        elif isinstance(order, Connect):
            self._sessions[order.number] = _Served(order, self._transport, self._agents, self._report)
        elif isinstance(order, Ask | BecomeRoot):
            self._sessions[order.number].requests.put(order)
        elif isinstance(order, Close) and (found := self._sessions.pop(order.number, None)):
            found.close()

    def close(self) -> None:
        """Ends all sessions."""
        for one in self._sessions.values():
            one.close()


class _Served:
    """One session, from its login to its end."""

    def __init__(
        self,
        order: Connect,
        transport: Transport,
        agents: Mapping[str, Agent],
        report: Callable[[Report], None],
    ) -> None:
        self.requests: SimpleQueue[Ask | BecomeRoot | None] = SimpleQueue()
        self._order = order
        self._transport = transport
        self._agents = agents
        self._report = report
        self._stop = Stop()
        threading.Thread(target=self._run, daemon=True).start()

    def close(self) -> None:
        """Ends it at once; a request under way fails."""
        self._stop.request()
        self._stop.request()
        self.requests.put(None)

    def _run(self) -> None:
        number = self._order.number
        try:
            with self._transport.connect(self._order.target) as session, self._stop.guarding(session):
                self._report(Answered(number, None))
                self._answer(session)
        except HostError as error:
            self._report(Answered(number, portable(error)))
        except Exception as error:  # noqa: BLE001  (a bug costs only this session)
            self._report(Answered(number, HostError(Kind.BUG, f"{type(error).__name__}: {error}")))

    def _answer(self, session: Session) -> None:
        number = self._order.number
        with ExitStack() as talks:
            host: Conversation | None = None
            while (ask := self.requests.get()) is not None:
                answer: Any = None
                try:
                    if isinstance(ask, BecomeRoot):
                        agent_client.become_root(session)
                    else:
                        if host is None:
                            chosen = self._agents[ask.agent]
                            talk = agent_client.conversation(session, chosen, become=ask.become)
                            host = talks.enter_context(talk)
                        answer = host.ask(
                            ask.request, ask.payload, timeout=ask.timeout,
                            on_note=lambda text: self._report(Noted(number, text)),
                        )  # fmt: skip
                except HostError as error:
                    answer = portable(error)
                self._report(Answered(number, answer))


def portable(error: HostError) -> HostError:
    """Returns the error as a value that every process can read."""
    return HostError(error.kind, error.message, error.hint)
