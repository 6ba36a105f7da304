"""Runs the protocol class of a user's robot type: each fault is a failed exchange that names file and line.

A call beyond the time limit ends the process by SIGALRM, which no Python code can hold up; stderr then has
the line that hung. systemd stops the motors and starts the driver again.
"""

from __future__ import annotations

import contextlib
import faulthandler
import importlib.machinery
import importlib.util
import signal
import sys
import traceback
from dataclasses import replace
from types import CodeType
from typing import Any, Callable, Sequence, TypeVar

from swarm_onboard.driver.codec import BadReplyError, Reply, Request
from swarm_onboard.driver.config import Actuator
from swarm_onboard.driver.protocols import PythonProtocol

_TIME_LIMIT = 0.25  # s for one call, which turns a few numbers into bytes
_LONGEST_REQUEST = 4096  # bytes
_LARGEST = 2.0**64
_MODULE = "swarm_user_codec"

T = TypeVar("T")


class InterruptionError(BaseException):
    """Raised by a signal handler while the class works: no fault of the class, so it passes."""


class _SourceLoader(importlib.machinery.SourceFileLoader):
    """Compiles the file each time: a cached module of the same second and size would be taken for it."""

    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self.get_data(self.path), self.path)


class UserCodec:
    """Calls the class of ``protocol``. Raises ``BadReplyError`` only."""

    def __init__(self, protocol: PythonProtocol) -> None:
        self._protocol = protocol
        if signal.getsignal(signal.SIGALRM) is signal.SIG_DFL:  # it may reach another thread than this one
            faulthandler.register(signal.SIGALRM, file=2, chain=True)
        self._codec: Any = self.call(self._loaded)
        self._stop = self._request("speed", 0, 0)

    def speed(self, left: int, right: int) -> Request:
        """Returns a speed request.

        If the class fails, a stop is still sent, with the bytes of its first stop.
        """
        try:
            return self._request("speed", left, right)
        except BadReplyError as error:
            if (left, right) != (0, 0):
                raise
            failed = error  # raised once its reply is read

        def make() -> Any:
            raise failed

        return replace(self._stop, reader=lambda: UserReader(self, make, None), answered=True)

    def query(self, name: str) -> Request:
        return self._request("query", name, values=self._protocol.values[name])

    def actuator(self, actuator: Actuator, index: int, values: Sequence[int]) -> Request:
        return self._request("actuator", actuator, index, tuple(values))

    def setup(self) -> list[Request]:
        """The requests of the optional method ``setup``."""

        def made() -> list[Request]:
            method = getattr(self._codec, "setup", list)
            requests: Any = method()
            if not isinstance(requests, (list, tuple)):
                raise self.wrong(method, f"returns {_kind(requests)} instead of a list of Requests")
            return [self._checked(method, one, None) for one in requests]

        return self.call(made)

    def identify(self) -> Request | None:
        return self._request("identify") if self._protocol.identify else None

    def call(self, work: Callable[[], T]) -> T:
        """Returns the result of ``work`` within the time limit. What it prints goes to stderr.

        Raises ``BadReplyError``.
        """
        signal.setitimer(signal.ITIMER_REAL, _TIME_LIMIT)
        try:
            with contextlib.redirect_stdout(sys.stderr):
                return work()
        except InterruptionError:
            raise
        except BaseException as error:  # sys.exit() ends no driver either
            raise BadReplyError(self._described(error)) from error
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)

    def wrong(self, function: Any, problem: str) -> BadReplyError:
        """The error about what ``function`` returned, with the line where that begins."""
        code = getattr(function, "__code__", None)
        place = f"{self._protocol.module.name}:{code.co_firstlineno}" if code else self._protocol.module.name
        return BadReplyError(f"{place}: `{getattr(function, '__name__', function)}` {problem}")

    def _loaded(self) -> Any:
        """An object of the class; loaded anew for each connection, so that it keeps nothing of a lost one."""
        loader = _SourceLoader(_MODULE, str(self._protocol.module))
        spec: Any = importlib.util.spec_from_loader(_MODULE, loader)
        module = sys.modules[_MODULE] = importlib.util.module_from_spec(spec)  # dataclasses look there
        loader.exec_module(module)
        return getattr(module, self._protocol.codec)(dict(self._protocol.options))

    def _request(self, name: str, *arguments: Any, values: int | None = None) -> Request:
        made = self.call(
            lambda: self._checked(method := getattr(self._codec, name), method(*arguments), values)
        )
        return replace(made, urgent=made.urgent or name == "speed")

    def _checked(self, method: Any, made: Any, values: int | None) -> Request:
        if not isinstance(made, Request) or not isinstance(made.data, bytes) or not callable(made.reader):
            raise self.wrong(method, f"returns {_kind(made)} instead of a Request of bytes")
        if not made.data and values is None:
            raise self.wrong(method, "makes a request of 0 bytes; only a query may send nothing")
        if len(made.data) > _LONGEST_REQUEST:
            raise self.wrong(method, f"makes a request of {len(made.data)} bytes, {_LONGEST_REQUEST} at most")
        name, make = str(made.name or "request"), made.reader
        return Request(
            made.data, name, lambda: UserReader(self, make, values), made.answered, made.framed, made.urgent
        )

    def _described(self, error: BaseException) -> str:
        """The error with the last line of the user's file that it passed."""
        file, text = self._protocol.module, ""
        with contextlib.suppress(Exception):  # its own __str__ may fail
            text = str(error)
        if isinstance(error, BadReplyError) and text:
            return text[:200]  # about a reply, in the words of the class
        steps = traceback.walk_tb(error.__traceback__)
        lines = [line for frame, line in steps if frame.f_code.co_filename == str(file)]
        if isinstance(error, SyntaxError) and error.filename == str(file):
            lines.append(error.lineno or 1)
        place = ":".join([file.name, *map(str, lines[-1:])])
        return f"{place}: {type(error).__name__}: {text}"[:200].rstrip(": ")


class UserReader:
    """Calls the class's reader, and checks its replies: ``values`` numbers, if that is known."""

    def __init__(self, codec: UserCodec, make: Callable[[], Any], values: int | None) -> None:
        self._codec, self._make, self._values = codec, make, values
        self._reader: Any = None
        self.noise = 0
        self.stray = ""

    def feed(self, data: bytes) -> Reply | None:
        return self._codec.call(lambda: self._fed(data))

    def _fed(self, data: bytes) -> Reply | None:
        self._reader = self._make() if self._reader is None else self._reader
        if not callable(feed := getattr(self._reader, "feed", None)):
            raise self._codec.wrong(self._make, f"makes {_kind(self._reader)}, which has no `feed`")
        try:
            reply = feed(data)
        finally:
            self.noise = int(getattr(self._reader, "noise", 0))
            self.stray = str(getattr(self._reader, "stray", ""))
        if reply is None:
            return None
        if not isinstance(reply, Reply) or not isinstance(reply.text, str):
            raise self._codec.wrong(feed, f"returns {_kind(reply)} instead of a Reply or None")
        numbers = reply.values if isinstance(reply.values, (tuple, list)) else (None,)
        if not all(_is_number(one) for one in numbers):
            raise self._codec.wrong(feed, f"returns {_kind(reply.values)}, which are not numbers")
        if self._values is not None and len(numbers) != self._values:
            raise self._codec.wrong(feed, f"returns {len(numbers)} values instead of {self._values}")
        return Reply(tuple(numbers), reply.text)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= _LARGEST


def _kind(value: Any) -> str:
    return f"a {type(value).__name__}"
