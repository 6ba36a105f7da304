"""The codec of a robot type's own: a class in a file, loaded here, and kept from doing harm.

Whatever it raises or returns is a failed exchange, told with file and line. A call that takes too long ends
the whole process by a signal, which no Python code holds up: systemd then stops the motors, and starts anew.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import signal
import sys
import traceback
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, Iterator, Sequence, TypeVar

from swarm_driver.codec import BadReplyError, Codec, Reply, Request
from swarm_driver.config import Actuator
from swarm_driver.protocols import PythonProtocol

_PATIENCE = 0.25  # s for one call: what only turns numbers into bytes needs a thousandth of it
_LONGEST_REQUEST = 4096
_LARGEST = 2.0**64  # no robot counts further
_MODULE = "swarm_own_codec"

T = TypeVar("T")


class InterruptionError(BaseException):
    """What a signal raises here while the class works. No fault of the class: all else that comes out is."""


class OwnCodec:
    """Calls the class of ``protocol``. Raises ``BadReplyError`` from here on, and nothing else."""

    def __init__(self, protocol: PythonProtocol) -> None:
        self._protocol = protocol
        self._codec: Codec = self._call(lambda: _made(protocol))
        self._stop = replace(self._request("speed", 0, 0), urgent=True)

    def speed(self, left: int, right: int) -> Request:
        """Zeros are always said: where the class fails now, in the bytes that it had for them at first."""
        try:
            return replace(self._request("speed", left, right), urgent=True)
        except BadReplyError as failed:
            if (left, right) != (0, 0):
                raise
            error = failed  # `failed` is gone with this block
            return replace(self._stop, reader=lambda: FailedReader(error), answered=True)

    def query(self, name: str) -> Request:
        return self._request("query", name, values=self._protocol.values[name])

    def actuator(self, actuator: Actuator, index: int, values: Sequence[int]) -> Request:
        return self._request("actuator", actuator, index, tuple(values))

    def setup(self) -> list[Request]:
        """A class need not have that."""
        return self._call(self._setup)

    def _setup(self) -> list[Request]:
        made = getattr(self._codec, "setup", list)()
        if not isinstance(made, (list, tuple)):
            raise BadReplyError(f"{self._name}: `setup` returns {_shown(made)} instead of a list of Requests")
        return [self._checked("setup", one, None) for one in made]

    def identify(self) -> Request | None:
        return self._request("identify") if self._protocol.identify else None

    def read(self, method: str, call: Callable[[], Any], values: int | None) -> Reply | None:
        """What a reader makes of bytes: nothing yet, or a reply that is one."""
        reply = self._call(call)
        if reply is None:
            return None
        if not isinstance(reply, Reply) or not isinstance(reply.text, str):
            raise BadReplyError(
                f"{self._name}: `{method}` returns {_shown(reply)} instead of a Reply or None"
            )
        numbers = tuple(reply.values) if isinstance(reply.values, (tuple, list)) else None
        if numbers is None or not all(_is_number(one) for one in numbers):
            raise BadReplyError(
                f"{self._name}: `{method}` returns {_shown(reply.values)}, which are no numbers"
            )
        if values is not None and len(numbers) != values:
            raise BadReplyError(f"{self._name}: `{method}` returns {len(numbers)} values instead of {values}")
        return Reply(numbers, reply.text)

    def _request(self, method: str, *arguments: Any, values: int | None = None) -> Request:
        def made() -> Request:
            return self._checked(method, getattr(self._codec, method)(*arguments), values)

        return self._call(made)

    def _checked(self, name: str, made: Any, values: int | None) -> Request:
        if not isinstance(made, Request) or not isinstance(made.data, bytes) or not callable(made.reader):
            raise BadReplyError(
                f"{self._name}: `{name}` returns {_shown(made)} instead of a Request of bytes"
            )
        if not 0 < len(made.data) <= _LONGEST_REQUEST:
            raise BadReplyError(f"{self._name}: `{name}` makes a request of {len(made.data)} bytes")
        return replace(made, name=str(made.name), reader=lambda: OwnReader(self, made.reader, values))

    def _call(self, call: Callable[[], T]) -> T:
        try:
            with _kept():
                return call()
        except (BadReplyError, InterruptionError):
            raise
        except BaseException as error:  # sys.exit() ends no driver either
            raise BadReplyError(f"{_place(error, self._protocol.module)}: {_told(error)}") from error

    @property
    def _name(self) -> str:
        return self._protocol.module.name


class OwnReader:
    """A reader of the class's, whose answers are looked at."""

    def __init__(self, codec: OwnCodec, reader: Callable[[], Any], values: int | None) -> None:
        self._codec = codec
        self._values = values
        self._make = reader
        self._reader: Any = None
        self.noise = 0
        self.stray = ""

    def feed(self, data: bytes) -> Reply | None:
        return self._codec.read("feed", lambda: self._fed(data), self._values)

    def _fed(self, data: bytes) -> Any:
        if self._reader is None:
            self._reader = self._make()
        try:
            return self._reader.feed(data)
        finally:
            self.noise = int(getattr(self._reader, "noise", 0))
            self.stray = str(getattr(self._reader, "stray", ""))


class FailedReader:
    """Of the answer to a stop that the class could not make: the stop is out, the exchange has failed."""

    def __init__(self, error: BadReplyError) -> None:
        self._error = error
        self.noise = 0
        self.stray = ""

    def feed(self, _: bytes) -> Reply | None:
        raise self._error


def _made(protocol: PythonProtocol) -> Codec:
    """An object of the class; loaded anew each time, so that it remembers nothing of a lost connection."""
    spec = importlib.util.spec_from_file_location(_MODULE, str(protocol.module))
    if spec is None or spec.loader is None:
        raise ImportError(f"{protocol.module} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[_MODULE] = module  # dataclasses look themselves up there
    spec.loader.exec_module(module)
    made: Codec = getattr(module, protocol.codec)(dict(protocol.options))
    return made


@contextlib.contextmanager
def _kept() -> Iterator[None]:
    """In time, and with nothing on stdout, where results are; a copy that is forked ends here."""
    process = os.getpid()
    signal.setitimer(signal.ITIMER_REAL, _PATIENCE)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    finally:
        if os.getpid() != process:
            os._exit(1)
        signal.setitimer(signal.ITIMER_REAL, 0)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= _LARGEST


def _shown(value: Any) -> str:
    return f"a {type(value).__name__}"


def _place(error: BaseException, module: Path) -> str:
    """The line of the class's own file where it happened: the last one, if it called others."""
    if isinstance(error, SyntaxError) and error.filename == str(module):
        return f"{module.name}:{error.lineno}"
    frames = traceback.extract_tb(error.__traceback__)
    line = next((frame.lineno for frame in reversed(frames) if frame.filename == str(module)), None)
    return module.name + (f":{line}" if line is not None else "")


def _told(error: BaseException) -> str:
    try:
        with _kept():
            text = str(error)
    except InterruptionError:
        raise
    except BaseException:  # noqa: BLE001
        text = ""
    return f"{type(error).__name__}: {text}"[:200].rstrip(": ")
