"""A process that keeps the SSH connections of verbs for the next ones, as ssh does with ControlPersist.

It logs in as a verb does, with the same checks of host keys. A connection is kept for ``KEPT`` s after its
last use, and only if nothing has failed over it. The process ends once it has had none for as long.
"""

from __future__ import annotations

import fcntl
import os
import resource
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection, Listener
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from swarmctl.remote.agent_archive import Agent
from swarmctl.remote.session_thread import Check, LogIn, SessionThread
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.transport import Target, Transport

KEPT = 60.0  # s
MOST = 256  # kept connections
_LOOK = 0.5  # s between two looks at what has expired


class Keeper:
    """The connections, each used by one verb at a time or by none."""

    def __init__(self, transport: Transport, clock: Callable[[], float] = time.monotonic) -> None:
        self._transport = transport
        self._clock = clock
        self._agents: dict[str, Agent] = {}
        self._kept: dict[Target, tuple[SessionThread, float]] = {}
        self._lock = threading.Lock()
        self._verbs = 0
        self._idle_since = clock()

    def serve(self, verb: Connection) -> None:
        """Carries out the orders of one verb for one host, until None, or until it closes its end."""
        with self._lock:
            self._verbs += 1
        with verb, suppress(EOFError, OSError):
            target = verb.recv()
            session = self._session(target, _sender(verb))
            try:
                while (order := verb.recv()) is not None:
                    if isinstance(order, Agent):
                        self._agents[order.digest] = order
                    else:
                        session.carry_out(order)
            finally:
                self._keep(target, session)
        with self._lock:
            self._verbs -= 1

    def expire(self) -> bool:
        """Closes what was not used for ``KEPT`` s. Returns False if there has been nothing since then."""
        now = self._clock()
        with self._lock:
            old = [target for target, (_, since) in self._kept.items() if now - since >= KEPT]
            closed = [self._kept.pop(target)[0] for target in old]
            if self._verbs or self._kept:
                self._idle_since = now
            lasts = now - self._idle_since < KEPT
        for session in closed:
            session.close()
        return lasts

    def _session(self, target: Target, send: Callable[[Any], None]) -> SessionThread:
        """The kept connection to a host, or a new one. Reports its login, or the error of it."""
        with self._lock:
            kept, _ = self._kept.pop(target, (None, 0.0))
        if kept is not None:
            answers: SimpleQueue[Any] = SimpleQueue()
            kept.report = answers.put
            kept.carry_out(Check())
            if answers.get() is True:
                kept.report = send
                send(None)
                return kept
            kept.close()
        session = SessionThread(self._transport, target, self._agents, send)
        session.carry_out(LogIn())
        return session

    def _keep(self, target: Target, session: SessionThread) -> None:
        with self._lock:
            if session.usable and target not in self._kept and len(self._kept) < MOST:
                self._kept[target] = session, self._clock()
                return
        session.close()


def _sender(verb: Connection) -> Callable[[Any], None]:
    def send(report: Any) -> None:
        with suppress(OSError):  # the verb has ended
            verb.send(report)

    return send


def main(place: str) -> None:
    """Keeps connections for who connects to the socket ``place``; ends at once if another process does.

    The file ``place`` with ``.pid`` has its number.
    """
    os.chdir("/")
    file = os.open(f"{place}.pid", os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return
    os.truncate(file, 0)
    os.write(file, b"%d\n" % os.getpid())
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))  # each connection takes several
    Path(place).unlink(missing_ok=True)
    keeper = Keeper(SshTransport())
    with Listener(place, family="AF_UNIX", backlog=MOST) as listener:
        threading.Thread(target=_accept, args=(listener, keeper), daemon=True).start()
        while keeper.expire():
            time.sleep(_LOOK)
    Path(f"{place}.pid").unlink()


def _accept(listener: Listener, keeper: Keeper) -> None:
    while True:
        with suppress(OSError):
            verb = listener.accept()
            threading.Thread(target=keeper.serve, args=(verb,), daemon=True).start()
