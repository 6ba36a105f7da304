"""Runs in a worker of a Dask cluster: SSH sessions for an operator who runs elsewhere."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from swarmctl.remote.agent_archive import Agent
from swarmctl.remote.session_thread import BecomeRoot, Request, SessionThread
from swarmctl.remote.transport import HostError, Kind, Target, Transport

_LOOK = 1.0  # s between two looks whether the operator is still there


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
        self._sessions: dict[int, tuple[SessionThread, asyncio.Queue[Any]]] = {}
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
                self._sessions[number] = self._opened(target)
            self._sessions[number][0].carry_out(order)
        return await self.more(number)

    async def more(self, number: int) -> Any:
        """See ``answer``."""
        if number in self._closed:
            return HostError(Kind.LOST, "the connection was closed")
        return await self._sessions[number][1].get()

    async def close(self, number: int) -> None:
        """Ends a session at once; a request under way fails."""
        self._closed.add(number)
        if found := self._sessions.pop(number, None):
            await asyncio.to_thread(found[0].close)

    def _opened(self, target: Target) -> tuple[SessionThread, asyncio.Queue[Any]]:
        reports: asyncio.Queue[Any] = asyncio.Queue()

        def report(one: Any) -> None:
            self._loop.call_soon_threadsafe(reports.put_nowait, one)

        return SessionThread(self._transport, target, self._agents, report), reports

    async def _close_with_operator(self) -> None:
        """Ends all sessions when the cluster releases this actor: its operator has ended, or was lost."""
        while self._key in self._worker.state.actors:
            await asyncio.sleep(_LOOK)
        for number in list(self._sessions):
            await self.close(number)
