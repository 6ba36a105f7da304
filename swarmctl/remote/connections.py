"""Sessions with the agents of hosts, kept from one round of requests to the next."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager

from swarmctl.remote import agent_client
from swarmctl.remote.dask_cluster import Workers
from swarmctl.remote.kept_connections import KeptConnections
from swarmctl.remote.parallel_hosts import Stop
from swarmctl.remote.transport import AgentSession, HostError, Kind, Session, Target, Transport

MOST = 256  # kept at a time by a process: each has a socket and a thread
_ALIVE = (Kind.REFUSED, Kind.FAILED)  # errors that the agent itself reports; it serves the next request


class Connections:
    """Kept sessions by host, each used by one thread at a time."""

    def __init__(self, transport: Transport, stop: Stop, verbs: tuple[str, ...]) -> None:
        self._transport = transport
        self._verbs = verbs
        self._stop = stop
        self._lock = threading.Lock()
        self._kept: dict[str, tuple[ExitStack, AgentSession]] = {}
        self._closed = False
        self._most = MOST * (transport.processes if isinstance(transport, Workers) else 1)

    def close(self) -> None:
        """Ends all sessions, now and later."""
        with self._lock:
            self._closed = True
            kept, self._kept = list(self._kept.values()), {}
        for stack, _agent in kept:
            stack.close()

    @contextmanager
    def agent_session(self, target: Target, *, anew: bool = False) -> Iterator[AgentSession]:
        """The kept session with the agent of a host, or a new one; with ``anew``, over a new connection."""
        kept = self._taken(target.host)
        if anew and kept is not None:
            kept[0].close()
            kept = None
        stack, agent = kept or self._opened(target, anew=anew)
        usable = False
        try:
            yield agent
            usable = True
        except HostError as error:
            usable = error.kind in _ALIVE
            raise
        finally:
            if not usable or not self._keep(target.host, stack, agent):
                stack.close()

    def log_in(self, target: Target) -> None:
        """Opens a connection to a host, whatever is kept, runs a command as root and closes it.

        Raises ``HostError``.
        """
        with self._connect(target, anew=True) as session, self._stop.guarding(session):
            agent_client.become_root(session)

    @contextmanager
    def idle(self, target: Target) -> Iterator[AgentSession | None]:
        """The kept session with the agent of a host if nobody uses it now, else None."""
        with self._lock:
            free = target.host in self._kept
        if not free:
            yield None
            return
        with self.agent_session(target) as agent:
            yield agent

    def _connect(self, target: Target, *, anew: bool) -> AbstractContextManager[Session]:
        if anew and isinstance(self._transport, KeptConnections):
            return self._transport.connect_anew(target)
        return self._transport.connect(target)

    def _opened(self, target: Target, *, anew: bool) -> tuple[ExitStack, AgentSession]:
        with ExitStack() as stack:
            session = stack.enter_context(self._connect(target, anew=anew))
            stack.enter_context(self._stop.guarding(session))
            agent = stack.enter_context(agent_client.agent_session(session, verbs=self._verbs))
            return stack.pop_all(), agent
        raise AssertionError  # the block above returns or raises

    def _taken(self, host: str) -> tuple[ExitStack, AgentSession] | None:
        with self._lock:
            return self._kept.pop(host, None)

    def _keep(self, host: str, stack: ExitStack, agent: AgentSession) -> bool:
        with self._lock:
            if self._closed or host in self._kept or len(self._kept) >= self._most:
                return False
            self._kept[host] = stack, agent
            return True
