"""The standard streams, so that no closed pipe, full disk or missing stream ends a verb halfway.

Importing this module imports nothing else: it stands before every verb, also ``--help``.
"""

from __future__ import annotations

import errno
import io
import os
import sys


class Output(io.FileIO):
    """An output that may fail: what nobody can read is dropped, and the verb goes on to its exit code."""

    failure: OSError | None = None

    def __init__(self, file: int, mode: str, *, closefd: bool = True) -> None:
        super().__init__(file, mode, closefd=closefd)
        self._written: list[int] = []

    def write(self, data: object, /) -> int:
        """Writes, or keeps the first error; returns as many bytes as there were.

        After a write that Ctrl-C interrupts when the bytes are out, a buffer writes them again: they are not
        written twice.
        """
        length = memoryview(data).nbytes  # type: ignore[arg-type]
        if self.failure is None:
            try:
                if not self._written:  # written and kept in one call, in which nothing can be raised between
                    self._written.extend(map(super().write, (data,)))  # type: ignore[arg-type]
                length = self._written[0]
                del self._written[:]
            except BlockingIOError:
                raise
            except OSError as error:
                self.failure = error
        return length


def install() -> Output | None:
    """Replaces the standard streams; returns stdout, or None if the caller closed it and so wants nothing."""
    outputs = {}
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if stream is None:  # /dev/null, so that no other file takes the descriptor
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115
        elif mode == "w" and isinstance(stream, io.TextIOWrapper):
            outputs[name] = Output(stream.fileno(), "w", closefd=False)
            setattr(sys, name, _text(outputs[name], stream))
    return outputs.get("stdout")


def _text(raw: Output, like: io.TextIOWrapper) -> io.TextIOWrapper:
    """Characters that the terminal cannot show are escaped."""
    return io.TextIOWrapper(
        io.BufferedWriter(raw),
        encoding=like.encoding,
        errors="backslashreplace",
        line_buffering=like.line_buffering,
        write_through=like.write_through,
    )


def has_failed() -> bool:
    """True once stdout can no longer be written, for verbs without an end."""
    raw = getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    return isinstance(raw, Output) and raw.failure is not None


def finish(output: Output | None) -> bool:
    """Flushes both streams. Returns False if stdout lacks something that its reader still waits for."""
    sys.stdout.flush()
    failure = output.failure if output is not None else None
    lost = failure is not None and failure.errno != errno.EPIPE  # `| head` has what it wanted
    if lost and failure is not None:
        print(f"error: cannot write to stdout: {failure.strerror}", file=sys.stderr)
    sys.stderr.flush()
    return not lost
