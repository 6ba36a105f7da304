"""The seam between what swarmctl wants of a host and how it gets there: targets, sessions, errors. No SSH."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Protocol


class Kind(str, Enum):
    """Why a host could not do what it was asked. The exit code and the retry advice follow from it."""

    UNREACHABLE = "unreachable"  # no route, refused, timed out, name not found
    HOST_KEY = "host-key"  # the key is not pinned, or is not the pinned one
    AUTH = "auth"  # the host knows us not
    PRIVILEGE = "privilege"  # no root and no password-free sudo
    LOST = "lost"  # the connection died while work was under way
    PROTOCOL = "protocol"  # the answer was not what the agent says
    REFUSED = "refused"  # the agent said no: locked, stale plan, disk full, ...
    FAILED = "failed"  # the agent tried and could not
    STOPPED = "stopped"  # never begun: the run was interrupted before
    BUG = "bug"  # swarmctl itself went wrong


@dataclass(unsafe_hash=True)
class HostError(Exception):
    """What happened to one host, for the person who must act. Travels as a value; never as a traceback."""

    kind: Kind
    message: str
    hint: str = ""

    @property
    def retryable(self) -> bool:
        """Whether the same command, run again, may well succeed without anyone changing anything."""
        return self.kind in (Kind.UNREACHABLE, Kind.LOST)

    @property
    def reached(self) -> bool:
        """Whether the host itself answered."""
        return self.kind is not Kind.UNREACHABLE

    def __str__(self) -> str:
        return self.message


@dataclass(frozen=True)
class Target:
    """How to reach one host. ``keys`` are the pinned public host keys, ``"ssh-ed25519 AAAA..."`` each."""

    host: str
    address: str
    user: str
    port: int = 22
    keys: tuple[str, ...] = ()
    identities: tuple[Path, ...] = ()
    jump: Target | None = None


@dataclass(frozen=True)
class Output:
    """What a command printed in one exchange, and its status, which is None while it goes on."""

    status: int | None
    stdout: bytes
    stderr: bytes


class Channel(Protocol):
    """One command on a host, with its streams. It starts with the first exchange."""

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 60.0
    ) -> Output:
        """Feed the command ``stdin`` and listen until ``enough`` was heard or the command has ended.

        ``enough`` sees standard output as it arrives. Raises ``HostError`` when the host dies, sends more
        than the limit on one stream, or is not done within ``timeout`` seconds, which closes the session.
        After that the channel is closed, and every further exchange raises the same.
        """
        ...


class Session(Protocol):
    """One authenticated connection to one host."""

    def channel(self, command: str, *, limit: int = 1 << 20) -> AbstractContextManager[Channel]:
        """A channel for ``command``; each exchange reads at most ``limit`` bytes of each stream.

        On leaving, the standard input of the command ends and nobody listens to it any more.
        """
        ...

    def close(self) -> None:
        """End the connection at once, from any thread; an ``exchange`` under way raises ``HostError``."""
        ...


class Transport(Protocol):
    """Opens sessions. The real one is ``ssh.SshTransport``; tests may bring their own."""

    def connect(self, target: Target) -> AbstractContextManager[Session]:
        """Connect and log in, or raise ``HostError``."""
        ...
