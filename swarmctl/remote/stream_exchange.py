"""One exchange with a command whose streams are pipes of this process: both ways at once, within limits."""

from __future__ import annotations

import os
import select
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from swarmctl.remote.ssh_errors import flooded, unfinished
from swarmctl.remote.transport import Output

_CHUNK = 1 << 16
_IDLE = 0.25  # s between two looks whether the command has ended
_LINGER = 1.0  # s a finished command's streams may stay open, held by a child it left behind


@dataclass(frozen=True)
class Streams:
    """The operator's ends of the pipes of a command, and how to find out its exit status.

    ``status`` returns None while the command runs, and may raise ``HostError``; ``watched``, a descriptor, is
    readable when it may have changed.
    """

    host: str
    stdin: int
    stdout: int
    stderr: int
    status: Callable[[], int | None]
    watched: int

    def __post_init__(self) -> None:
        for descriptor in (self.stdin, self.stdout, self.stderr):
            os.set_blocking(descriptor, False)


def exchange(
    streams: Streams,
    stdin: Sequence[bytes],
    enough: Callable[[bytes], bool],
    enough_errors: Callable[[bytes], bool],
    *,
    limit: int,
    timeout: float,
    begun: float,
) -> Output:
    """Sends ``stdin`` and returns the output once ``enough`` accepts it, or the command has ended.

    ``enough`` sees what comes on standard output, ``enough_errors`` what comes on standard error.

    Raises ``HostError`` for more than ``limit`` bytes on a stream, and ``timeout`` seconds after ``begun``,
    a time of the monotonic clock.
    """
    return _Exchange(streams, stdin, enough, enough_errors, limit).complete(timeout, begun)


class _Exchange:
    def __init__(
        self,
        streams: Streams,
        stdin: Sequence[bytes],
        enough: Callable[[bytes], bool],
        enough_errors: Callable[[bytes], bool],
        limit: int,
    ) -> None:
        self._streams = streams
        # Slices of a memoryview cost nothing; slices of bytes copy the rest of the payload each time.
        self._pending = deque(memoryview(chunk) for chunk in stdin if chunk)
        self._enough = {streams.stdout: enough, streams.stderr: enough_errors}
        self._limit = limit
        self._received = {streams.stderr: bytearray(), streams.stdout: bytearray()}
        self._open = set(self._received)

    def complete(self, timeout: float, begun: float) -> Output:
        end = begun + timeout
        ended: float | None = None
        while True:
            status = self._streams.status()  # looked at before the last bytes are taken
            ready = self._ready(end, runs=status is None)
            if self._streams.stdin in ready:
                self._feed()
            if any(one in ready and self._take(one) for one in self._received):
                return self._output(None)
            if status is not None:
                ended = ended or time.monotonic()
                if not self._open or (not ready and time.monotonic() > ended + _LINGER):
                    return self._output(status)
            if time.monotonic() >= end:
                raise unfinished(self._streams.host, timeout)

    def _ready(self, end: float, *, runs: bool) -> set[int]:
        poll = select.poll()
        for descriptor in self._open:
            poll.register(descriptor, select.POLLIN)
        if self._pending:
            poll.register(self._streams.stdin, select.POLLOUT)
        if runs:
            poll.register(self._streams.watched, select.POLLIN)
        left = max(0.0, min(_IDLE, end - time.monotonic()))
        return {descriptor for descriptor, _event in poll.poll(1000 * left)}

    def _feed(self) -> None:
        try:
            sent = os.write(self._streams.stdin, self._pending[0][:_CHUNK])
        except BlockingIOError:
            return
        except OSError:  # the command ended without reading all of its input; its output gives the reason
            self._pending.clear()
            return
        self._pending[0] = self._pending[0][sent:]
        if not self._pending[0]:
            self._pending.popleft()

    def _take(self, descriptor: int) -> bool:
        """Reads once; returns True if what came is enough."""
        try:
            piece = os.read(descriptor, _CHUNK)
        except BlockingIOError:
            return False
        if not piece:
            self._open.discard(descriptor)
            return False
        kept = self._received[descriptor]
        if len(kept) + len(piece) > self._limit:
            raise flooded(self._streams.host, self._limit)
        kept += piece
        return self._enough[descriptor](piece)

    def _output(self, status: int | None) -> Output:
        return Output(
            status, bytes(self._received[self._streams.stdout]), bytes(self._received[self._streams.stderr])
        )
