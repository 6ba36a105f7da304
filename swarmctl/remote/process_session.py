"""A session whose commands are processes of this machine, such as those of a container on it."""

from __future__ import annotations

import os
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress

from swarmctl.remote.transport import HostError, Kind, Output

_CHUNK = 1 << 16


class ProcessSession:
    """Runs each command with ``/bin/sh -c`` behind the words of ``argv``."""

    def __init__(self, argv: Sequence[str], env: Mapping[str, str]) -> None:
        self._argv = argv
        self._env = env
        self._channels: list[_ProcessChannel] = []

    @contextmanager
    def channel(self, command: str, *, limit: int = 1 << 20) -> Iterator[_ProcessChannel]:
        """Yields a channel that runs ``command``; ``limit`` is its maximum output in bytes."""
        channel = _ProcessChannel((*self._argv, "/bin/sh", "-c", command), self._env, limit)
        self._channels.append(channel)
        try:
            yield channel
        finally:
            channel.close()

    def close(self) -> None:
        """Kills the commands that run."""
        for channel in self._channels:
            channel.kill()


class _ProcessChannel:
    """One process; the first exchange starts it."""

    def __init__(self, argv: Sequence[str], env: Mapping[str, str], limit: int) -> None:
        self._argv = argv
        self._env = env
        self._limit = limit
        self._process: subprocess.Popen[bytes] | None = None
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115  (closed with the channel)

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 60.0
    ) -> Output:
        """Sends ``stdin`` and returns the output once ``enough`` accepts it, or at its end.

        Raises ``HostError`` after ``timeout`` seconds, and for more output than the limit.
        """
        process = self._process = self._process or self._started()
        end = time.monotonic() + timeout
        alarm = threading.Timer(timeout, process.kill)
        alarm.daemon = True
        alarm.start()
        try:
            found = _answer(process, stdin, enough, self._limit)
        finally:
            alarm.cancel()
        if found.status is not None and time.monotonic() >= end:
            raise HostError(
                Kind.LOST, f"it did not finish within {timeout:g} s", "run the same command again"
            )
        self._stderr.seek(0)
        return Output(found.status, found.stdout, self._stderr.read(self._limit))

    def kill(self) -> None:
        """Kills the process."""
        if self._process is not None:
            self._process.kill()

    def close(self) -> None:
        """Ends the standard input of the process and waits for its end, which comes at once."""
        if self._process is not None:
            with suppress(OSError):
                self._process.communicate(timeout=10)
            self._process.kill()
            self._process.wait()
        self._stderr.close()

    def _started(self) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            self._argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._stderr, env=self._env,
            bufsize=0,
        )  # fmt: skip


def _answer(
    process: subprocess.Popen[bytes], stdin: Sequence[bytes], enough: Callable[[bytes], bool], limit: int
) -> Output:
    assert process.stdin is not None
    assert process.stdout is not None
    with suppress(BrokenPipeError):  # its output gives the reason
        for chunk in stdin:
            view = memoryview(chunk)
            while view:
                view = view[process.stdin.write(view) :]
    received = bytearray()
    while piece := os.read(process.stdout.fileno(), _CHUNK):
        received += piece
        if len(received) > limit:
            process.kill()
            raise HostError(
                Kind.PROTOCOL, f"it sent more than {limit} bytes where a short answer was expected"
            )
        if enough(piece):
            return Output(None, bytes(received), b"")
    return Output(process.wait(), bytes(received), b"")
