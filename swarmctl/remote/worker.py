"""Runs in a worker of a Dask cluster: SSH sessions for an operator who runs elsewhere.

It decides nothing: which host, which request and when to stop is the operator's.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

from swarmctl.remote import agent_client
from swarmctl.remote.agent_archive import Agent
from swarmctl.remote.parallel_hosts import Stop
from swarmctl.remote.transport import AgentSession, HostError, Kind, Session, Target, Transport

_LOOK = 1.0  # s between two looks whether the operator is still there


@dataclass(frozen=True)
class Request:
    """A request to the agent with the digest ``agent``, which the worker already has."""

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


class Sessions:
    """A Dask actor with the sessions of one operator, by number.

    Its methods are asynchronous: Dask runs the others one at a time.
    """

    def __init__(self, login: Callable[[], Transport]) -> None:
        from distributed import get_worker  # noqa: PLC0415

        worker: Any = get_worker()
        self._worker, self._key = worker, worker.get_current_task()
        self._loop = worker.loop.asyncio_loop
        self._transport = login()
        self._agents: dict[str, Agent] = {}
        self._sessions: dict[int, _Session] = {}
        self._closed: set[int] = set()
        # Threads that begin or end can lock up a process with Dask's statistical profiler:
        # `sys._current_frames` holds a lock of the interpreter while the garbage collector runs
        # Dask's callbacks (python/cpython#106883).
        if profiler := worker.periodic_callbacks.pop("profile", None):
            worker.loop.add_callback(profiler.stop)
        worker.loop.add_callback(self._close_with_operator)

    async def keep(self, agent: Agent) -> None:
        """Keeps an agent for the requests that name its digest."""
        self._agents[agent.digest] = agent

    async def answer(self, number: int, target: Target, order: Request | BecomeRoot) -> Any:
        """Has session ``number``, which it opens if need be, carry out an order.

        Returns the answer, which may be a ``HostError``, or a ``Note``; then ``more`` returns what follows.
        """
        if number not in self._closed:  # else the order was slower than the end
            if number not in self._sessions:
                self._sessions[number] = _Session(self._transport, target, self._agents, self._loop)
            self._sessions[number].orders.put(order)
        return await self.more(number)

    async def more(self, number: int) -> Any:
        """See ``answer``."""
        if number in self._closed:
            return HostError(Kind.LOST, "the connection was closed")
        return await self._sessions[number].reports.get()

    async def close(self, number: int) -> None:
        """Ends a session at once; a request under way fails."""
        self._closed.add(number)
        if found := self._sessions.pop(number, None):
            await asyncio.to_thread(found.close)

    async def _close_with_operator(self) -> None:
        """Ends all sessions when the cluster releases this actor: its operator has ended, or was lost."""
        while self._key in self._worker.state.actors:
            await asyncio.sleep(_LOOK)
        for number in list(self._sessions):
            await self.close(number)


class _Session:
    """One session, from its login to its end, in a thread of its own."""

    def __init__(
        self, transport: Transport, target: Target, agents: dict[str, Agent], loop: asyncio.AbstractEventLoop
    ) -> None:
        self.orders: SimpleQueue[Request | BecomeRoot | None] = SimpleQueue()
        self.reports: asyncio.Queue[Any] = asyncio.Queue()
        self._transport = transport
        self._target = target
        self._agents = agents
        self._loop = loop
        self._stop = Stop()
        threading.Thread(target=self._run, daemon=True).start()

    def close(self) -> None:
        """Ends it; safe between threads."""
        self.orders.put(None)
        for _ in range(2):  # the second closes a connection in use
            self._stop.request()

    def _report(self, report: Any) -> None:
        self._loop.call_soon_threadsafe(self.reports.put_nowait, report)

    def _run(self) -> None:
        try:
            with (
                self._transport.connect(self._target) as session,
                self._stop.guarding(session),
                ExitStack() as stack,
            ):
                self._serve(session, stack)
                return
        except HostError as error:
            ended = portable(error)
        except Exception as error:  # noqa: BLE001  (a bug costs only this session)
            ended = HostError(Kind.BUG, f"{type(error).__name__}: {error}")
        while self.orders.get() is not None:
            self._report(ended)

    def _serve(self, session: Session, stack: ExitStack) -> None:
        host: AgentSession | None = None
        while (order := self.orders.get()) is not None:
            answer: Any = None
            try:
                if isinstance(order, BecomeRoot):
                    agent_client.become_root(session)
                else:
                    host = host or stack.enter_context(
                        agent_client.session_with(self._agents[order.agent], session, become=order.become)
                    )
                    answer = host.request(
                        order.request, order.payload, timeout=order.timeout,
                        on_note=lambda text: self._report(Note(text)),
                    )  # fmt: skip
            except HostError as error:
                answer = portable(error)
            self._report(answer)


def portable(error: HostError) -> HostError:
    """Returns the error as a value that every process can read."""
    return HostError(error.kind, error.message, error.hint)
