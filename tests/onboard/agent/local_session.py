"""A session that needs no network: what would go over SSH runs in a process here."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress

from swarmctl.remote.transport import Output


class LocalSession:
    """``argv`` comes before the shell that runs the command."""

    def __init__(self, env: Mapping[str, str], argv: Sequence[str] = ()) -> None:
        self._env = env
        self._argv = argv

    @contextmanager
    def channel(self, command: str, *, limit: int = 1 << 20) -> Iterator[LocalChannel]:
        with ExitStack() as until_left:
            yield LocalChannel([*self._argv, "/bin/sh", "-c", command], self._env, until_left)

    def close(self) -> None: ...


class LocalChannel:
    def __init__(self, argv: Sequence[str], env: Mapping[str, str], until_left: ExitStack) -> None:
        self._argv = argv
        self._env = env
        self._until_left = until_left
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115  (closed by the stack)
        until_left.callback(self._stderr.close)
        self._process: subprocess.Popen[bytes] | None = None

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 60.0
    ) -> Output:
        process = self._process = self._process or self._start()
        assert process.stdin is not None
        assert process.stdout is not None
        with suppress(BrokenPipeError):
            for chunk in stdin:
                process.stdin.write(chunk)
        received = b""
        while piece := os.read(process.stdout.fileno(), 1 << 16):
            received += piece
            if enough(piece):
                return Output(None, received, b"")
        status = process.wait(timeout)
        self._stderr.seek(0)
        return Output(status, received, self._stderr.read())

    def _start(self) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            self._argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._stderr, env=self._env,
            bufsize=0,
        )  # fmt: skip
        assert process.stdin is not None
        assert process.stdout is not None
        self._until_left.callback(process.wait, 20)
        self._until_left.callback(process.stdout.close)
        self._until_left.callback(process.stdin.close)
        return process
