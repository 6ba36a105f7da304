"""Commands over a connection of the program ``ssh``: streams have limits, every exchange has one deadline."""

from __future__ import annotations

import os
import select
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from swarmctl.remote.openssh_mux import MuxSession, RefusedError
from swarmctl.remote.openssh_process import SshProcess
from swarmctl.remote.ssh_errors import flooded, lost, unfinished
from swarmctl.remote.ssh_limits import FOREVER, SESSION_PAUSES
from swarmctl.remote.sudo_password import SudoPassword
from swarmctl.remote.transport import CHANNEL_TIMEOUT, HostError, Output

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


class OpenSshSession:
    """A logged-in connection. Not for several threads, ``close`` apart."""

    def __init__(
        self, process: SshProcess, control: Path, host: str, sudo: SudoPassword | None = None
    ) -> None:
        self._process = process
        self._control = control
        self._host = host
        self._sudo = sudo

    def sudo_password(self) -> bytes | None:
        """See ``SudoSession``."""
        return self._sudo.of(self._host) if self._sudo else None

    def sudo_rejected(self) -> None:
        """See ``SudoSession``."""
        if self._sudo:
            self._sudo.rejected_by(self._host)

    def close(self) -> None:
        """Closes the connection."""
        self._process.kill()

    @contextmanager
    def channel(self, command: str, *, limit: int = 1 << 20) -> Iterator[OpenSshChannel]:
        """Yields a channel that runs ``command``; ``limit`` is its maximum output in bytes."""
        channel = OpenSshChannel(self._process, self._control, self._host, command, limit)
        try:
            yield channel
        finally:
            channel.close()


class OpenSshChannel:
    """One command; the first exchange starts it, and its deadline covers that, too."""

    def __init__(self, process: SshProcess, control: Path, host: str, command: str, limit: int) -> None:
        self._process = process
        self._control = control
        self._host = host
        self._command = command
        self._limit = limit
        self._session: MuxSession | None = None
        self._streams: Streams | None = None
        self._failure: HostError | None = None

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 60.0
    ) -> Output:
        """Sends ``stdin`` and returns the output once ``enough`` accepts it.

        Raises ``HostError`` if the command ends early or ``timeout`` seconds pass; that ends the connection.
        """
        return self._exchanged(stdin, enough, timeout)

    def more(self) -> Output:
        """Returns the next output of either stream."""
        return self._exchanged((), bool, FOREVER, bool)

    def _exchanged(
        self,
        stdin: Sequence[bytes],
        enough: Callable[[bytes], bool],
        timeout: float,
        enough_errors: Callable[[bytes], bool] = lambda _: False,
    ) -> Output:
        if self._failure is not None:
            raise self._failure
        begun = time.monotonic()
        try:
            streams = self._streams = self._streams or self._started(timeout)
            return exchange(
                streams, stdin, enough, enough_errors, limit=self._limit, timeout=timeout, begun=begun
            )
        except HostError as error:
            self._failure = error  # what arrives later must not be taken for the answer to something else
            self._process.kill()
            raise

    def close(self) -> None:
        """Closes the channel."""
        if self._session is not None:
            self._session.close()
            self._session = None

    def _started(self, timeout: float) -> Streams:
        session = self._session = self._opened(min(CHANNEL_TIMEOUT, timeout))
        ends = (session.stdin, session.stdout, session.stderr)
        return Streams(self._host, *ends, status=session.status, watched=session.fileno())

    def _opened(self, timeout: float) -> MuxSession:
        for pause in SESSION_PAUSES:
            with suppress(RefusedError):
                return MuxSession(self._control, self._host, self._command, timeout)
            time.sleep(pause)
        try:
            return MuxSession(self._control, self._host, self._command, timeout)
        except RefusedError as error:
            raise lost(self._host, str(error)) from error
