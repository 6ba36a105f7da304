"""Runs the protocol class of a user's robot type: a time limit for each call, a clear error for each fault.

Whatever the class raises or returns wrongly is a failed exchange, reported with file and line. A call beyond
the time limit ends the process by SIGALRM, which no Python code can hold up: systemd then stops the motors
and starts the driver again.
"""

from __future__ import annotations

import contextlib
import importlib.util
import signal
import sys
import traceback
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, Sequence, TypeVar

from swarm_driver.codec import BadReplyError, Reply, Request
from swarm_driver.config import Actuator
from swarm_driver.protocols import PythonProtocol

_TIME_LIMIT = 0.25  # s for one call, which turns a few numbers into bytes
_LONGEST_REQUEST = 4096  # bytes
_LARGEST = 2.0**64
_MODULE = "swarm_user_codec"

T = TypeVar("T")


class InterruptionError(BaseException):
    """Raised by a signal handler while the class works: no fault of the class, so it passes."""


class UserCodec:
    """Calls the class of ``protocol``. Raises ``BadReplyError`` only."""

    def __init__(self, protocol: PythonProtocol) -> None:
        self._protocol = protocol
        self._codec: Any = self.call(lambda: _loaded(protocol))
        self._stop = replace(self._request("speed", 0, 0), urgent=True)

    def speed(self, left: int, right: int) -> Request:
        """A stop is always sent: if the class fails now, with the bytes that it made at first."""
        try:
            return replace(self._request("speed", left, right), urgent=True)
        except BadReplyError as error:
            if (left, right) != (0, 0):
                raise
            failed = FailedReader(error)
            return replace(self._stop, reader=lambda: failed, answered=True)

    def query(self, name: str) -> Request:
        return self._request("query", name, values=self._protocol.values[name])

    def actuator(self, actuator: Actuator, index: int, values: Sequence[int]) -> Request:
        return self._request("actuator", actuator, index, tuple(values))

    def setup(self) -> list[Request]:
        """The requests of the optional method ``setup``."""
        made: Any = self.call(lambda: getattr(self._codec, "setup", list)())  # noqa: PLW0108  (getattr may raise)
        if not isinstance(made, (list, tuple)):
            raise self.fault("setup", f"returns {_kind(made)} instead of a list of Requests")
        return [self._checked("setup", one, None) for one in made]

    def identify(self) -> Request | None:
        return self._request("identify") if self._protocol.identify else None

    def call(self, work: Callable[[], T]) -> T:
        """The result of ``work`` within the time limit; what it prints goes to stderr, beside all results."""
        signal.setitimer(signal.ITIMER_REAL, _TIME_LIMIT)
        try:
            with contextlib.redirect_stdout(sys.stderr):
                return work()
        except (BadReplyError, InterruptionError):
            raise
        except BaseException as error:  # sys.exit() ends no driver either
            raise BadReplyError(_described(error, self._protocol.module)) from error
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)

    def fault(self, method: str, problem: str) -> BadReplyError:
        return BadReplyError(f"{self._protocol.module.name}: `{method}` {problem}")

    def _request(self, method: str, *arguments: Any, values: int | None = None) -> Request:
        made = self.call(lambda: getattr(self._codec, method)(*arguments))
        return self._checked(method, made, values)

    def _checked(self, method: str, made: Any, values: int | None) -> Request:
        if not isinstance(made, Request) or not isinstance(made.data, bytes) or not callable(made.reader):
            raise self.fault(method, f"returns {_kind(made)} instead of a Request of bytes")
        if not 0 < len(made.data) <= _LONGEST_REQUEST:
            raise self.fault(method, f"makes a request of {len(made.data)} bytes")
        name = made.name if isinstance(made.name, str) else method
        return replace(made, name=name, reader=lambda: UserReader(self, made.reader, values))


class UserReader:
    """Calls the class's reader, and checks its replies: ``values`` numbers, if that is known."""

    def __init__(self, codec: UserCodec, make: Callable[[], Any], values: int | None) -> None:
        self._codec = codec
        self._make = make
        self._values = values
        self._reader: Any = None
        self.noise = 0
        self.stray = ""

    def feed(self, data: bytes) -> Reply | None:
        reply = self._codec.call(lambda: self._fed(data))
        if reply is None:
            return None
        if not isinstance(reply, Reply) or not isinstance(reply.text, str):
            raise self._codec.fault("feed", f"returns {_kind(reply)} instead of a Reply or None")
        numbers = reply.values if isinstance(reply.values, (tuple, list)) else (None,)
        if not all(_is_number(one) for one in numbers):
            raise self._codec.fault("feed", f"returns {_kind(reply.values)}, which are no numbers")
        if self._values is not None and len(numbers) != self._values:
            raise self._codec.fault("feed", f"returns {len(numbers)} values instead of {self._values}")
        return Reply(tuple(numbers), reply.text)

    def _fed(self, data: bytes) -> Any:
        if self._reader is None:
            self._reader = self._make()
        try:
            return self._reader.feed(data)
        finally:
            self.noise = int(getattr(self._reader, "noise", 0))
            self.stray = str(getattr(self._reader, "stray", ""))


class FailedReader:
    """The reply to a stop that the class could not make: the stop is sent, the exchange has failed."""

    def __init__(self, error: BadReplyError) -> None:
        self._error = error
        self.noise = 0
        self.stray = ""

    def feed(self, _: bytes) -> Reply | None:
        raise self._error


def _loaded(protocol: PythonProtocol) -> Any:
    """An object of the class; loaded anew for each connection, so that it keeps nothing of a lost one."""
    spec = importlib.util.spec_from_file_location(_MODULE, str(protocol.module))
    if spec is None or spec.loader is None:
        raise ImportError(f"{protocol.module} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[_MODULE] = module  # dataclasses look themselves up there
    spec.loader.exec_module(module)
    return getattr(module, protocol.codec)(dict(protocol.options))


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= _LARGEST


def _kind(value: Any) -> str:
    return f"a {type(value).__name__}"


def _described(error: BaseException, module: Path) -> str:
    """The error with the last line of the user's file that it passed."""
    if isinstance(error, SyntaxError) and error.filename == str(module):
        line = error.lineno
    else:
        frames = reversed(traceback.extract_tb(error.__traceback__))
        line = next((frame.lineno for frame in frames if frame.filename == str(module)), None)
    text = ""
    with contextlib.suppress(Exception):  # its own __str__ may fail
        text = str(error)
    place = module.name if line is None else f"{module.name}:{line}"
    return f"{place}: {type(error).__name__}: {text}"[:200].rstrip(": ")
