"""A connection to a host for another process: its orders are carried out in a thread of its own.

It decides nothing: which host, which request and when to stop is the operator's.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

from swarmctl.remote import agent_client
from swarmctl.remote.agent_archive import Agent
from swarmctl.remote.parallel_hosts import Stop
from swarmctl.remote.ssh_channel import SshSession
from swarmctl.remote.transport import AgentSession, HostError, Kind, Session, Target, Transport

_LOST = (Kind.LOST, Kind.PROTOCOL, Kind.BUG)  # errors after which the connection takes no further request


@dataclass(frozen=True)
class LogIn:
    """The connection is there and logged in."""


@dataclass(frozen=True)
class Check:
    """Whether the host still answers over the connection."""


@dataclass(frozen=True)
class Request:
    """A request to the agent with the digest ``agent``, which the process already has."""

    agent: str
    become: bool
    request: dict[str, Any]
    payload: bytes
    timeout: float


@dataclass(frozen=True)
class BecomeRoot:
    """The host runs the shortest command as root."""


@dataclass(frozen=True)
class Note:
    """A note of an agent on the progress of its request; more follows."""

    text: str


Order = LogIn | Check | Request | BecomeRoot


class SessionThread:
    """One session, from its login to its end."""

    def __init__(
        self, transport: Transport, target: Target, agents: Mapping[str, Agent], report: Callable[[Any], None]
    ) -> None:
        """``report`` takes the notes and the answer of each order; an answer may be a ``HostError``."""
        self.report = report
        self.usable = True  # False while it carries out an order, and for good after some errors
        self._orders: SimpleQueue[Order | None] = SimpleQueue()
        self._transport = transport
        self._target = target
        self._agents = agents
        self._stop = Stop()
        threading.Thread(target=self._run, daemon=True).start()

    def carry_out(self, order: Order) -> None:
        """Puts an order behind those that came before."""
        self.usable = False
        self._orders.put(order)

    def close(self) -> None:
        """Ends it; safe between threads."""
        self._orders.put(None)
        for _ in range(2):  # the second closes a connection in use
            self._stop.request()

    def _run(self) -> None:
        try:
            with (
                self._transport.connect(self._target) as session,
                self._stop.guarding(session),
                ExitStack() as agents,
            ):
                self._serve(session, agents)
                return
        except HostError as error:
            ended = portable(error)
        except Exception as error:  # noqa: BLE001  (a bug costs only this session)
            ended = HostError(Kind.BUG, f"{type(error).__name__}: {error}")
        while self._orders.get() is not None:
            self.report(ended)

    def _serve(self, session: Session, agents: ExitStack) -> None:
        host: AgentSession | None = None
        started = None
        while (order := self._orders.get()) is not None:
            answer: Any = None
            try:
                if isinstance(order, Check):
                    answer = isinstance(session, SshSession) and session.alive()
                elif isinstance(order, BecomeRoot):
                    agent_client.become_root(session)
                elif isinstance(order, Request):
                    if host is None or started != (order.agent, order.become):
                        agents.close()  # sshd may allow one session a connection (MaxSessions)
                        started = order.agent, order.become
                        host = agents.enter_context(
                            agent_client.session_with(self._agents[order.agent], session, become=order.become)
                        )
                    answer = host.request(
                        order.request, order.payload, timeout=order.timeout,
                        on_note=lambda text: self.report(Note(text)),
                    )  # fmt: skip
            except HostError as error:
                answer = portable(error)
            # Whose code `remove` has removed is no agent for a later verb.
            over = isinstance(order, Request) and order.request["verb"] == "remove"
            self.usable = not over and not (isinstance(answer, HostError) and answer.kind in _LOST)
            self.report(answer)


def portable(error: HostError) -> HostError:
    """Returns the error as a value that every process can read."""
    return type(error)(error.kind, error.message, error.hint)
