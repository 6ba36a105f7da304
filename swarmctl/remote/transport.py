"""Targets, sessions and errors of connections to hosts, independent of SSH."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

if TYPE_CHECKING:
    from swarmctl.remote.agent_archive import Agent


CHANNEL_TIMEOUT = 10.0  # s in which a host opens a channel


class Kind(str, Enum):
    """The kind of a host's error; exit code and advice on retrying depend on it."""

    UNREACHABLE = "unreachable"  # no route, refused, timed out, name not found
    HOST_KEY = "host-key"  # the key is not pinned, or is not the pinned one
    AUTH = "auth"  # no key was accepted
    PRIVILEGE = "privilege"  # no root, and sudo refuses
    LOST = "lost"  # the connection died while work was under way
    PROTOCOL = "protocol"  # the answer is not a valid answer of the agent
    REFUSED = "refused"  # the agent rejected the request: locked, stale plan, disk full, ...
    BUSY = "busy"  # a robot that the change would touch moves or is under command
    NEWER = "newer"  # it has a release that was chosen after this one
    EDITED = "edited"  # the change would replace what people have edited on the host
    UNFIT = "unfit"  # the host lacks what its part of the swarm needs
    HELD = "held back"  # never changed: another host is unfit
    FAILED = "failed"  # the agent failed
    STOPPED = "stopped"  # never started: the run was interrupted before
    BUG = "bug"  # a bug in swarmctl


@dataclass(unsafe_hash=True)
class HostError(Exception):
    """An error of one host: what happened, and in ``hint`` how to fix it."""

    kind: Kind
    message: str
    hint: str = ""

    @property
    def retryable(self) -> bool:
        """True if the same command may succeed when run again without any change."""
        return self.kind in (Kind.UNREACHABLE, Kind.LOST)

    @property
    def reached(self) -> bool:
        """True if the host itself answered."""
        return self.kind is not Kind.UNREACHABLE

    def to_json(self) -> dict[str, str]:
        """What every verb prints of it with ``--json``."""
        return {"kind": self.kind.value, "message": self.message, "hint": self.hint}

    def __str__(self) -> str:
        return self.message


@dataclass(frozen=True)
class Target:
    """How to reach one host.

    ``keys`` are the pinned public host keys, ``"ssh-ed25519 AAAA..."`` each. Keys in ``revoked`` are refused.
    swarmctl connects to no host that is ``expelled``, nor through one.
    ``proxy_command`` leads to the host instead of a TCP connection, and ``ssh_only`` has the options of
    ``~/.ssh/config`` that concern the login and that only the program ``ssh`` knows.
    """

    host: str
    address: str
    user: str
    port: int = 22
    keys: tuple[str, ...] = ()
    identities: tuple[Path, ...] = ()
    jump: Target | None = None
    revoked: tuple[str, ...] = ()
    proxy_command: str = ""
    ssh_only: tuple[str, ...] = ()
    expelled: bool = False

    def way(self) -> Iterator[Target]:
        """The host and the hosts that it is reached through."""
        yield self
        if self.jump is not None:
            yield from self.jump.way()


@dataclass(frozen=True)
class Output:
    """What a command printed in one exchange, and its exit status; None while it runs."""

    status: int | None
    stdout: bytes
    stderr: bytes


class Channel(Protocol):
    """One command on a host with its streams. The first exchange starts it."""

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 60.0
    ) -> Output:
        """Write ``stdin`` to the command and read its output until ``enough`` is True or the command ends.

        ``enough`` sees standard output as it arrives. Raises ``HostError`` when the host dies, sends more
        than the limit on one stream, or is not done within ``timeout`` seconds, which closes the session.
        After that the channel is closed, and every further exchange raises the same.
        """
        ...

    def more(self) -> Output:
        """Wait for more output, on either stream, or the end of the command, while the connection lives.

        Raises ``HostError`` as ``exchange`` does.
        """
        ...


class AgentSession(Protocol):
    """One agent at work on a host, for all requests of a session."""

    def request(
        self,
        request: Mapping[str, Any],
        payload: bytes = b"",
        *,
        on_note: Callable[[str], None] | None = None,
        timeout: float = 60.0,
    ) -> Any:
        """The agent's answer to ``request``, the JSON of an ``Answer`` of its verb.

        Raises ``HostError``. After an error that the agent reports (refused, failed, unknown verb) another
        request may follow; after any other the agent is gone, and every further request fails.
        """
        ...


class ChannelSession(Protocol):
    """One authenticated connection of this process to one host."""

    def channel(self, command: str, *, limit: int = 1 << 20) -> AbstractContextManager[Channel]:
        """A channel for ``command``; each exchange reads at most ``limit`` bytes of each stream.

        On leaving, the standard input of the command ends and its output is no longer read.
        """
        ...

    def close(self) -> None:
        """End the connection at once, from any thread; an ``exchange`` under way raises ``HostError``."""
        ...


@runtime_checkable
class SudoSession(Protocol):
    """A connection whose operator has given the password of ``sudo``."""

    def sudo_password(self) -> bytes | None:
        """The password as a line; None if there is none, or if the host has rejected it."""
        ...

    def sudo_rejected(self) -> None:
        """The host did not accept the password."""
        ...


@runtime_checkable
class WorkerSession(Protocol):
    """A connection that another process has to a host: its agent session is there, too."""

    def agent_session(self, chosen: Agent, *, become: bool) -> AgentSession:
        """The only agent session of the connection, with the agent ``chosen``."""
        ...

    def become_root(self) -> None:
        """Have the host run the shortest command as root. Raises ``HostError``."""
        ...

    def close(self) -> None:
        """End the connection at once, from any thread; a ``request`` under way raises ``HostError``."""
        ...


Session = ChannelSession | WorkerSession


class Transport(Protocol):
    """Opens sessions: ``either_ssh.EitherSsh`` here, ``dask_cluster.Workers`` in other processes."""

    def connect(self, target: Target) -> AbstractContextManager[Session]:
        """Connect and log in, or raise ``HostError``."""
        ...
