"""Commands over a connection of the program ``ssh``: streams have limits, every exchange has one deadline."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from swarmctl.remote.openssh_mux import MuxSession, RefusedError
from swarmctl.remote.openssh_process import SshProcess
from swarmctl.remote.ssh_errors import lost
from swarmctl.remote.ssh_limits import FOREVER, SESSION_PAUSES
from swarmctl.remote.stream_exchange import Streams, exchange
from swarmctl.remote.sudo_password import SudoPassword
from swarmctl.remote.transport import CHANNEL_TIMEOUT, HostError, Output


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
