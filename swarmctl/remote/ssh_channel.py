"""Commands on SSH channels: both streams have size limits, every exchange has one deadline."""

from __future__ import annotations

import select
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from threading import Timer

from swarmctl.remote.lean_paramiko import paramiko
from swarmctl.remote.ssh_errors import flooded, lost, unfinished, with_losses
from swarmctl.remote.ssh_limits import FOREVER, SESSION_PAUSES
from swarmctl.remote.sudo_password import SudoPassword
from swarmctl.remote.tcp import PromptSocket
from swarmctl.remote.transport import CHANNEL_TIMEOUT, HostError, Kind, Output

ALIVE = 2.0  # s
_CHUNK = 1 << 16
_IDLE = 0.25  # s between looks at what no descriptor reports: exit status, window
_LINGER = 1.0  # s a finished command's streams may stay open, held by a child it left behind


class SshSession:
    """A logged-in connection. Not for several threads, ``close`` apart."""

    def __init__(self, client: paramiko.Transport, host: str, sudo: SudoPassword | None = None) -> None:
        self._client = client
        self._host = host
        self._sudo = sudo

    def sudo_password(self) -> bytes | None:
        """See ``SudoSession``."""
        return self._sudo.of(self._host) if self._sudo else None

    def sudo_rejected(self) -> None:
        """See ``SudoSession``."""
        if self._sudo:
            self._sudo.rejected_by(self._host)

    def alive(self) -> bool:
        """Returns True if the host answers over the connection within ``ALIVE`` s; else it is closed."""
        alarm = Timer(ALIVE, self._client.close)
        alarm.start()
        with suppress(paramiko.SSHException, EOFError, OSError):
            self._client.global_request("keepalive@openssh.com")
        alarm.cancel()
        return self._client.is_active()

    def close(self) -> None:
        """Closes the connection."""
        self._client.close()

    @contextmanager
    def channel(self, command: str, *, limit: int = 1 << 20) -> Iterator[SshChannel]:
        """Yields a channel that runs ``command``; ``limit`` is its maximum output in bytes."""
        channel = SshChannel(self._client, self._host, command, limit)
        try:
            yield channel
        finally:
            channel.close()


class SshChannel:
    """One command; the channel is opened by the first exchange, whose deadline covers that, too."""

    def __init__(self, client: paramiko.Transport, host: str, command: str, limit: int) -> None:
        self._client = client
        self._host = host
        self._command = command
        self._limit = limit
        self._channel: paramiko.Channel | None = None
        self._failure: HostError | None = None

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 60.0
    ) -> Output:
        """Sends ``stdin`` and returns the output once ``enough`` accepts it.

        Raises ``HostError`` if the command ends early or ``timeout`` seconds pass.
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
        try:
            with self._deadline(timeout):
                started = self._started(timeout)
                return _Exchange(
                    self._host, started, stdin, self._limit, enough, enough_errors=enough_errors
                ).complete()
        except HostError as error:
            self._failure = error  # what arrives later must not be taken for the answer to something else
            self.close()
            raise

    def _started(self, timeout: float) -> paramiko.Channel:
        if self._channel is None:
            self._channel = self._session(min(CHANNEL_TIMEOUT, timeout))
            self._channel.exec_command(self._command)
        return self._channel

    def _session(self, timeout: float) -> paramiko.Channel:
        """A new session. sshd may count one that has just been closed for a moment (MaxSessions)."""
        for pause in SESSION_PAUSES:
            with suppress(paramiko.ChannelException):
                return self._client.open_session(timeout=timeout)
            time.sleep(pause)
        return self._client.open_session(timeout=timeout)

    def close(self) -> None:
        """Closes the channel; errors of a lost connection are ignored."""
        if self._channel is not None:
            with suppress(paramiko.SSHException, EOFError, OSError):  # the connection is gone already
                self._channel.close()

    @contextmanager
    def _deadline(self, timeout: float) -> Iterator[None]:
        """Close the connection after ``timeout``: some waits inside paramiko have no time limit."""
        alarm = Timer(timeout, self._client.close)
        alarm.daemon = True
        end = time.monotonic() + timeout
        alarm.start()
        try:
            yield
        except (HostError, paramiko.SSHException, EOFError, OSError) as error:
            gone = error if isinstance(error, HostError) else lost(self._host, str(error))
            if gone.kind is Kind.LOST and time.monotonic() >= end:
                gone = unfinished(self._host, timeout)
            link = self._client.sock
            raise with_losses(
                gone, link.sent_again() if isinstance(link, PromptSocket) else (0, 0)
            ) from error
        finally:
            alarm.cancel()


class _Exchange:
    """Feeds standard input and drains both outputs at once, so that neither side can wait for the other."""

    def __init__(
        self,
        host: str,
        channel: paramiko.Channel,
        stdin: Sequence[bytes],
        limit: int,
        enough: Callable[[bytes], bool],
        *,
        enough_errors: Callable[[bytes], bool],
    ) -> None:
        self._host = host
        self._channel = channel
        # Slices of a memoryview cost nothing; slices of bytes copy the rest of the payload each time.
        self._pending = deque(memoryview(chunk) for chunk in stdin if chunk)
        self._limit = limit
        self._enough = enough
        self._enough_errors = enough_errors
        self._stdout = bytearray()
        self._stderr = bytearray()

    def complete(self) -> Output:
        channel = self._channel
        wakeup = select.poll()
        wakeup.register(channel.fileno(), select.POLLIN)
        ended = 0.0
        while True:
            over = channel.closed or channel.eof_received  # looked at before the last bytes are taken
            moved = self._feed()
            if channel.recv_ready():
                piece = channel.recv(_CHUNK)
                self._keep(self._stdout, piece)
                if self._enough(piece):
                    return Output(None, bytes(self._stdout), bytes(self._stderr))
                moved = True
            if channel.recv_stderr_ready():
                piece = channel.recv_stderr(_CHUNK)
                self._keep(self._stderr, piece)
                if self._enough_errors(piece):
                    return Output(None, bytes(self._stdout), bytes(self._stderr))
                moved = True
            if over and not moved:
                break
            if channel.exit_status_ready():
                ended = ended or time.monotonic()
                if not moved and time.monotonic() > ended + _LINGER:
                    break
            if not moved:
                wakeup.poll(1000 * (_IDLE / 5 if self._pending else _IDLE))
        channel.status_event.wait()  # bounded by the deadline, which closes the connection
        status = channel.exit_status
        if status < 0 and not channel.get_transport().is_active():
            raise lost(self._host)
        return Output(status, bytes(self._stdout), bytes(self._stderr))

    def _feed(self) -> bool:
        if not self._pending or not self._channel.send_ready():
            if self._channel.closed:
                self._pending.clear()
            return False
        chunk = self._pending[0]
        try:
            sent = self._channel.send(bytes(chunk[:_CHUNK]))
        except OSError:  # the command ended without reading all of its input; its output gives the reason
            self._pending.clear()
            return False
        self._pending[0] = chunk[sent:]
        if not self._pending[0]:
            self._pending.popleft()
        return True

    def _keep(self, stream: bytearray, piece: bytes) -> None:
        if len(stream) + len(piece) > self._limit:
            raise flooded(self._host, self._limit)
        stream += piece
