"""The first steps to a host, one at a time: its name, the route, a ping, its port, and one login."""

from __future__ import annotations

import shlex
import socket
import subprocess
import time
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise

from swarmctl.remote.agent_client import become_root
from swarmctl.remote.ssh_errors import no_way, quoted, unknown_name
from swarmctl.remote.ssh_limits import Timeouts
from swarmctl.remote.tcp import dial
from swarmctl.remote.transport import CHANNEL_TIMEOUT, HostError, Target, Transport, WorkerSession

_PATIENCE = 2  # s for a ping
_LONGEST = 255  # bytes of a banner (RFC 4253, 4.2)
#: Lines NAME=VALUE; the sizes of the file system of /opt in KiB.
FACTS = (
    "date +time=%s; "
    'python3 -I -S -c "import sys; print(\\"python=%d.%d\\" % sys.version_info[:2])"; '
    'df -Pk /opt | { read -r _; read -r _ size _ free _; echo "size=$size"; echo "free=$free"; }'
)


@dataclass(frozen=True)
class Route:
    """How packets leave for an address; ``gateway`` is empty if it is in a network of this machine."""

    interface: str
    own: str
    gateway: str = ""


@dataclass(frozen=True)
class Greeting:
    """A port is open, after so many ``seconds``; ``banner``: its first line, empty if nothing."""

    seconds: float
    banner: str


@dataclass(frozen=True)
class Visit:
    """One login: what ``FACTS`` printed, the operator's clock then, and why the account is not root."""

    facts: str
    now: float  # s since 1970
    no_root: HostError | None = None


class FirstContact:
    """Looks at the network and at hosts. Each method raises ``HostError``."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def resolve(self, target: Target) -> str:
        """Returns the IP address that a connection to the host tries first."""
        try:
            found = socket.getaddrinfo(target.address, target.port, type=socket.SOCK_STREAM)
        except (OSError, UnicodeError) as error:  # a label of a name that is too long
            raise unknown_name(target) from error
        return str(found[0][4][0])

    def route(self, target: Target, address: str) -> Route | None:
        """Returns how packets get there; None if this machine has no `ip`."""
        done = _program("ip", "route", "get", address.partition("%")[0])
        if done is None:
            return None
        if done.returncode != 0:
            raise no_way(target, "this machine has no route to it")
        words = done.stdout.split()
        found = dict(pairwise(words))
        return Route(found.get("dev", ""), found.get("src", ""), found.get("via", ""))

    def ping(self, address: str) -> bool | None:
        """Returns True if it answers; None if this machine has no `ping`, or may not run it."""
        done = _program("ping", "-n", "-c", "1", "-W", str(_PATIENCE), address)
        return None if done is None or done.returncode > 1 else done.returncode == 0  # 2: another error

    def greeting(self, target: Target) -> Greeting:
        """Connects to the port and waits for a line."""
        limits = Timeouts()
        began = time.monotonic()
        with dial(target, limits.connect, acknowledgement=limits.acknowledgement) as connection:
            took = time.monotonic() - began
            connection.settimeout(limits.banner)
            line = b""
            with suppress(OSError):  # it is silent, or hangs up
                while b"\n" not in line and len(line) < _LONGEST and (piece := connection.recv(_LONGEST)):
                    line += piece
        return Greeting(took, quoted(line.partition(b"\n")[0].rstrip(b"\r").decode("utf-8", "replace")))

    def visit(self, target: Target) -> Visit:
        """Logs in once, and becomes root if it may."""
        with self._transport.connect(target) as session:
            assert not isinstance(session, WorkerSession)
            with session.channel(f"exec /bin/sh -c {shlex.quote(FACTS)}") as channel:
                done = channel.exchange([], lambda _: False, timeout=CHANNEL_TIMEOUT)
            facts, now = done.stdout.decode("utf-8", "replace"), time.time()
            try:
                become_root(session)
            except HostError as error:
                return Visit(facts, now, error)
            return Visit(facts, now)


def _program(*argv: str) -> subprocess.CompletedProcess[str] | None:
    with suppress(OSError):
        return subprocess.run(argv, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    return None
