"""Jump hosts: one shared login for all hosts behind them, because sshd limits concurrent logins."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from copy import copy
from dataclasses import dataclass, field
from threading import Lock
from typing import Generic, TypeVar

from swarmctl.remote.transport import HostError, Target

C = TypeVar("C")
"""A connection, of either transport."""


@dataclass
class _Hop(Generic[C]):
    """A shared connection, or the error of opening it."""

    users: int = 0
    outcome: C | HostError | None = None
    closing: ExitStack = field(default_factory=ExitStack)
    lock: Lock = field(default_factory=Lock)


class Hops(Generic[C]):
    """Opens a connection for the first user of a hop and closes it after the last. Safe between threads.

    One that is no longer ``alive`` gets no new users: they share the next.
    """

    def __init__(
        self, login: Callable[[Target], AbstractContextManager[C]], alive: Callable[[C], bool]
    ) -> None:
        self._login = login
        self._alive = alive
        self._hops: dict[Target, _Hop[C]] = {}
        self._lock = Lock()

    @contextmanager
    def through(self, target: Target) -> Iterator[C]:
        """Yields a connection to a jump host; several targets share it. Raises ``HostError``."""
        with self._lock:
            hop = self._hops.get(target)
            if hop is None or self._dead(hop):
                hop = self._hops[target] = _Hop()
            hop.users += 1
        try:
            yield self._opened(hop, target)
        finally:
            with self._lock:
                hop.users -= 1
                if (last := hop.users == 0) and self._hops.get(target) is hop:
                    del self._hops[target]
            if last:
                hop.closing.close()

    def _dead(self, hop: _Hop[C]) -> bool:
        found = hop.outcome
        return found is not None and not isinstance(found, HostError) and not self._alive(found)

    def _opened(self, hop: _Hop[C], target: Target) -> C:
        with hop.lock:
            if hop.outcome is None:
                try:
                    hop.outcome = hop.closing.enter_context(self._login(target))
                except HostError as error:
                    hop.outcome = error
        if isinstance(hop.outcome, HostError):
            raise copy(hop.outcome)  # a traceback of its own for each user
        return hop.outcome
