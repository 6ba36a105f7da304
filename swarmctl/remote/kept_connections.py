"""Connections that a process beside this one keeps for the next verb (``connection_keeper``)."""

from __future__ import annotations

import hashlib
import json
import os
import socket
import stat
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from multiprocessing.connection import Client, Connection
from pathlib import Path
from typing import Any

from swarmctl.remote.agent_archive import Agent
from swarmctl.remote.either_ssh import EitherSsh
from swarmctl.remote.session_thread import BecomeRoot, Note, Request
from swarmctl.remote.ssh_errors import LockedKeyError
from swarmctl.remote.transport import CHANNEL_TIMEOUT, HostError, Kind, Session, Target
from swarmctl.version import __version__

_START = (
    "import sys; sys.path[:] = sys.argv[2:]; "
    "from swarmctl.remote.connection_keeper import main; main(sys.argv[1])"
)
_NETWORK = Path("/proc/self/ns/net")
_STARTS = 10.0  # s in which the process is there
_LOOK = 0.005  # s
_LOGIN = 300.0  # s, more than the sum of the limits of a login through jump hosts
_LATE = 30.0  # s, which the process has more than the host


class _NoKeeperError(Exception):
    """There is no process that keeps connections, and none can be started."""


class KeptConnections:
    """A transport whose connections a process keeps; those that it cannot have are opened by ``ssh``."""

    def __init__(self, ssh: EitherSsh, place: Path | None = None) -> None:
        """``place``: the socket of the process, where it is not the usual one."""
        self._ssh = ssh
        self._place = place
        self._lock = threading.Lock()
        self._missing = False

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        """A kept connection, or a new one. Raises ``HostError``."""
        with ExitStack() as stack:
            session: KeptSession | None = None
            if self._ssh.uses_paramiko(target):
                with suppress(_NoKeeperError):
                    session = self._kept(stack, target)
            yield session or stack.enter_context(self._ssh.connect(target))
            if session is not None:
                session.leave()

    def connect_anew(self, target: Target) -> AbstractContextManager[Session]:
        """A connection that nobody keeps. Raises ``HostError``."""
        return self._ssh.connect(target)

    def _kept(self, stack: ExitStack, target: Target) -> KeptSession | None:
        keeper = stack.enter_context(self._keeper())
        try:
            keeper.send(target)
            error = _received(keeper, _LOGIN)
        except (EOFError, OSError) as gone:
            raise _NoKeeperError from gone
        if isinstance(error, LockedKeyError):  # this process may have its passphrase
            return None
        if isinstance(error, HostError):
            if self._ssh.beyond_paramiko(error, target):
                return None
            raise error
        return KeptSession(keeper, target.host)

    def _keeper(self) -> Connection:
        with self._lock:
            if self._missing:
                raise _NoKeeperError
            self._missing = True
            place = str(self._place or socket_of_keeper())
            try:
                found = Client(place, "AF_UNIX")
            except OSError:
                found = _started(place)
            self._missing = False
            return found


class KeptSession:
    """A session over such a connection; it is the session with the agent, too."""

    def __init__(self, keeper: Connection, host: str) -> None:
        self._keeper = keeper
        self._host = host
        self._agent: Agent | None = None
        self._become = False

    def agent_session(self, chosen: Agent, *, become: bool) -> KeptSession:
        """See ``WorkerSession``."""
        self._agent, self._become = chosen, become
        with suppress(OSError):  # the request that follows raises it
            self._keeper.send(chosen)
        return self

    def request(
        self,
        request: Mapping[str, Any],
        payload: bytes = b"",
        *,
        on_note: Callable[[str], None] | None = None,
        timeout: float = 60.0,
    ) -> Any:
        """See ``AgentSession``."""
        assert self._agent is not None, "a request before the session"
        order = Request(self._agent.digest, self._become, dict(request), payload, timeout)
        return self._answer(order, timeout, on_note)

    def become_root(self) -> None:
        """See ``WorkerSession``."""
        self._answer(BecomeRoot(), CHANNEL_TIMEOUT)

    def close(self) -> None:
        """See ``WorkerSession``."""
        with suppress(OSError), socket.socket(fileno=os.dup(self._keeper.fileno())) as keeper:
            keeper.shutdown(socket.SHUT_RDWR)  # which ends a wait of another thread, as `close` does not

    def leave(self) -> None:
        """Returns once the process has the connection for the next verb."""
        with suppress(OSError):
            self._keeper.send(None)
            self._keeper.poll(_LATE)  # it closes its end

    def _answer(
        self, order: Request | BecomeRoot, timeout: float, on_note: Callable[[str], None] | None = None
    ) -> Any:
        try:
            self._keeper.send(order)
            while isinstance(report := _received(self._keeper, timeout + _LATE), Note):
                if on_note is not None:
                    on_note(report.text)
        except (EOFError, OSError) as error:
            message = f"the connection to {self._host} was closed"
            raise HostError(Kind.LOST, message, "run the same command again") from error
        if isinstance(report, HostError):
            raise report
        return report


def socket_of_keeper() -> Path:
    """The socket of the process for this account, its keys and its network, in a folder for it alone.

    Raises ``_NoKeeperError`` if there is no such folder.
    """
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(runtime, "swarmctl") if runtime else Path(tempfile.gettempdir(), f"swarmctl-{os.geteuid()}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError as error:
        raise _NoKeeperError from error
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid() or found.st_mode & 0o077:
        raise _NoKeeperError
    network = _NETWORK.stat().st_ino if _NETWORK.exists() else 0
    agent = os.environ.get("SSH_AUTH_SOCK")
    shared = [__version__, __file__, sys.executable, str(Path.home()), agent, network]
    return folder / hashlib.sha256(json.dumps(shared).encode()).hexdigest()[:16]


def _started(place: str) -> Connection:
    process = subprocess.Popen(
        [sys.executable, "-I", "-c", _START, place, *sys.path],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        start_new_session=True,
    )  # fmt: skip
    end = time.monotonic() + _STARTS
    while not process.poll() and time.monotonic() < end:  # ended with 0: another one was quicker
        with suppress(OSError):
            return Client(place, "AF_UNIX")
        time.sleep(_LOOK)
    raise _NoKeeperError


def _received(keeper: Connection, timeout: float) -> Any:
    """The next message. Raises ``EOFError`` or ``OSError``."""
    if not keeper.poll(timeout):
        raise TimeoutError
    return keeper.recv()
