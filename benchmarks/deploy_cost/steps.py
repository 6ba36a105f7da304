"""A transport that takes the time of each step with a host, in the order in which they happen."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.transport import Channel, ChannelSession, Output, Target


@dataclass
class Steps:
    """``connect`` is that of a transport. ``taken``: name, s of wall time, s of the operator's CPU time."""

    taken: list[tuple[str, float, float]] = field(default_factory=list)
    _transport: SshTransport = field(default_factory=SshTransport)

    @contextmanager
    def connect(self, target: Target) -> Iterator[ChannelSession]:
        """See ``Transport``."""
        with self.timed("a connection, login"):
            opened = self._transport.connect(target)
            session = opened.__enter__()
        try:
            yield _Session(self, session)
        finally:
            with self.timed("its end"):
                opened.__exit__(None, None, None)

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Takes the time of the block."""
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self.taken.append((name, time.perf_counter() - wall, time.process_time() - cpu))


@dataclass(eq=False)
class _Session:
    steps: Steps
    session: ChannelSession

    @contextmanager
    def channel(self, command: str, *, limit: int = 1 << 20) -> Iterator[Channel]:
        with self.session.channel(command, limit=limit) as channel:
            yield _Channel(self.steps, channel)

    def close(self) -> None:
        self.session.close()


@dataclass(eq=False)
class _Channel:
    steps: Steps
    channel: Channel
    _started: bool = False

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 60.0
    ) -> Output:
        first, self._started = not self._started, True
        with self.steps.timed(_name(stdin, first=first)):
            return self.channel.exchange(stdin, enough, timeout=timeout)


def _name(stdin: Sequence[bytes], *, first: bool) -> str:
    """The verb of the request in ``stdin``."""
    for piece in stdin:
        with suppress(ValueError, LookupError, TypeError):
            request = json.loads(piece)
            start = ", with a channel and the agent's start" if first else ""
            back = ", given back" if request.get("want") is False else ""
            return f"`{request['verb']}`{back}{start}"
    return "a channel, `true`"
