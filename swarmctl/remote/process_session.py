"""A session whose commands are processes of this machine, such as those of a container on it."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress

from swarmctl.remote.stream_exchange import Streams, exchange
from swarmctl.remote.transport import HostError, Output

_LAST_WORDS = 10.0  # s that a process has to end by itself


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

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 60.0
    ) -> Output:
        """Sends ``stdin`` and returns the output once ``enough`` accepts it, or at its end.

        Raises ``HostError`` after ``timeout`` seconds, and for more output than the limit.
        """
        process = self._process = self._process or self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        ends = (process.stdin.fileno(), process.stdout.fileno(), process.stderr.fileno())
        streams = Streams("the container", *ends, status=process.poll)
        try:
            return exchange(streams, stdin, enough, limit=self._limit, timeout=timeout)
        except HostError:
            process.kill()
            raise

    def kill(self) -> None:
        """Kills the process."""
        if self._process is not None:
            self._process.kill()

    def close(self) -> None:
        """Ends the standard input of the process and waits for its end, which comes at once."""
        if self._process is not None:
            for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
                assert stream is not None
                stream.close()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_LAST_WORDS)
            self._process.kill()
            self._process.wait()

    def _started(self) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            self._argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=self._env,
            bufsize=0,
        )  # fmt: skip
