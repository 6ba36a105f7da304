"""The line protocol: requests with their payloads on standard input, marked JSON lines on standard output.

Output of a login shell may come between the marked lines; the nonce distinguishes them.
"""

from __future__ import annotations

import binascii
import signal
import sys
import zlib

from . import json_text
from .errors import OperatorGoneError, RefusedError, UploadEndedError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, BinaryIO, Iterator

IDLE = 60  # s without a byte from the operator
LONGEST_REQUEST = 1 << 20
LONGEST_PAYLOAD = 64 << 20
_WORTH_PACKING = 512


def requests(source: BinaryIO) -> Iterator[tuple[dict[str, Any], bytes]]:
    """Yields the requests with their payloads, until ``source`` ends.

    A silent operator is given up on. Raises ``RefusedError``; amid a payload ``UploadEndedError``.
    """

    def give_up(*_: object) -> None:
        raise RefusedError(f"no data came for {IDLE} s", "run the same command again")

    signal.signal(signal.SIGALRM, give_up)
    while True:
        signal.alarm(IDLE)
        try:
            line = source.readline(LONGEST_REQUEST)
            if not line:
                return
            if not line.endswith(b"\n"):
                raise RefusedError("the request is too long or ended early", "run the same command again")
            request = json_text.loads(line.decode("utf-8"))
            payload = _payload(source, request)
        finally:
            signal.alarm(0)
        yield request, payload


def _payload(source: BinaryIO, request: dict[str, Any]) -> bytes:
    missing = request.get("payload", 0)
    if not isinstance(missing, int) or not 0 <= missing <= LONGEST_PAYLOAD:
        raise RefusedError(f"a payload of {missing!r} bytes is too long")
    chunks: list[bytes] = []
    while missing:
        signal.alarm(IDLE)
        try:
            chunk = source.read1(min(missing, 1 << 18))  # type: ignore[attr-defined]
        except RefusedError as error:
            raise UploadEndedError(error.message, request, b"".join(chunks)) from error
        if not chunk:
            raise UploadEndedError("the upload ended early", request, b"".join(chunks))
        chunks.append(chunk)
        missing -= len(chunk)
    return b"".join(chunks)


class Report:
    """Sends the operator notes and the result of one request.

    Until ``detach`` a vanished operator raises ``OperatorGoneError``, so that nothing starts that nobody
    waits for; after it the work goes on to its end, listened to or not.
    """

    def __init__(self, nonce: str, sink: BinaryIO | None = None) -> None:
        self._nonce = nonce.encode("ascii")
        self._sink = sink if sink is not None else sys.stdout.buffer
        self._detached = False
        self._before: dict[int, Any] = {}

    def detach(self) -> None:
        """From here on finishes what has begun: no hang-up, closed pipe or Ctrl-C ends it."""
        self._detached = True
        for number in (signal.SIGHUP, signal.SIGPIPE, signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, signal.SIG_IGN)

    def close(self) -> None:
        """Ends the request: signals may end the agent again."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def note(self, text: str) -> None:
        """Sends a line of progress."""
        self._write({"note": text})

    def answer(self, value: dict[str, Any]) -> None:
        """Sends the answer of the verb."""
        self._write({"answer": value})

    def error(self, kind: str, message: str, hint: str) -> None:
        """Sends the error of the verb."""
        self._write({"error": {"kind": kind, "message": message, "hint": hint}})

    def _write(self, value: dict[str, Any]) -> None:
        text = json_text.dumps(value).encode("ascii")
        if len(text) > _WORTH_PACKING:
            text = b"z:" + binascii.b2a_base64(zlib.compress(text, 9), newline=False)
        try:
            self._sink.write(b"\n@" + self._nonce + b" " + text + b"\n")
            self._sink.flush()
        except OSError as error:
            if not self._detached:
                raise OperatorGoneError from error
