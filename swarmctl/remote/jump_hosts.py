"""Jump hosts: one shared login for all hosts behind them, because sshd limits concurrent logins."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, field
from threading import Lock

import paramiko

from swarmctl.remote.transport import HostError, Target

Login = Callable[[Target], AbstractContextManager[paramiko.Transport]]


@dataclass
class _Hop:
    """A shared connection, or the error of opening it."""

    users: int = 0
    outcome: paramiko.Transport | HostError | None = None
    closing: ExitStack = field(default_factory=ExitStack)
    lock: Lock = field(default_factory=Lock)


class Hops:
    """Opens a connection for the first user of a hop and closes it after the last. Safe between threads."""

    def __init__(self, login: Login) -> None:
        self._login = login
        self._hops: dict[Target, _Hop] = {}
        self._lock = Lock()

    @contextmanager
    def through(self, target: Target) -> Iterator[paramiko.Transport]:
        """Yields a connection to a jump host; several targets share it. Raises ``HostError``."""
        with self._lock:
            hop = self._hops.setdefault(target, _Hop())
            hop.users += 1
        try:
            yield self._opened(hop, target)
        finally:
            with self._lock:
                hop.users -= 1
                if last := hop.users == 0:
                    del self._hops[target]
            if last:
                hop.closing.close()

    def _opened(self, hop: _Hop, target: Target) -> paramiko.Transport:
        with hop.lock:
            if hop.outcome is None:
                try:
                    hop.outcome = hop.closing.enter_context(self._login(target))
                except HostError as error:
                    hop.outcome = error
        if isinstance(hop.outcome, HostError):
            raise HostError(hop.outcome.kind, hop.outcome.message, hop.outcome.hint)
        return hop.outcome
