"""One request, one reply, over one open port. Every reply is read; what nobody asked for is noise."""

from __future__ import annotations

import math
import typing
from typing import Callable, TypeVar

from swarm_driver.config import Protocol, Query
from swarm_driver.protocol import BadReplyError, LineBuffer, Reply, framed, speed_request, understand
from swarm_driver.report import Tally

T = TypeVar("T")


class NoReplyError(Exception):
    """The robot did not answer in time."""


class LinkLostError(Exception):
    """The line must be closed, opened again, and begun with a stop."""


#: What an exchange can fail of while the port itself is there.
FAILED_EXCHANGE = (NoReplyError, BadReplyError)


class BytePort(typing.Protocol):
    """What a link needs of a port; ``port.Port`` is one. All but ``close`` may raise ``PortError``."""

    def write(self, data: bytes) -> None: ...

    def read(self, timeout: float) -> bytes: ...

    def drain(self) -> None: ...

    def close(self) -> None: ...


class Link:
    """The conversation with one robot. Exchanges raise what FAILED_EXCHANGE names, or ``PortError``."""

    def __init__(self, port: BytePort, protocol: Protocol, tally: Tally, clock: Callable[[], float]) -> None:
        self._port = port
        self._protocol = protocol
        self._tally = tally
        self._clock = clock
        self._lines = LineBuffer()

    def set_speed(self, left: int, right: int) -> None:
        query = self._protocol.set_speed
        self._exchange(speed_request(query, left, right), query, self._protocol.reply_timeout)

    def ask(self, query: Query, timeout: float = math.inf) -> Reply:
        """The reply to ``query``, waited for ``timeout`` seconds; never longer than the protocol says."""
        return self._exchange(query.send, query, min(timeout, self._protocol.reply_timeout))

    def twice(self, exchange: Callable[[], T]) -> T:
        """The outcome of ``exchange``, given a second chance; then the robot counts as lost."""
        try:
            return exchange()
        except FAILED_EXCHANGE as error:
            self._tally.failed(error)
        try:
            return exchange()
        except FAILED_EXCHANGE as error:
            self._tally.failed(error)
            raise LinkLostError(str(error)) from error

    def blurt_stop(self) -> None:
        """Send the stop and wait for no reply: the last thing said on a line that is given up."""
        self._port.write(framed(speed_request(self._protocol.set_speed, 0, 0), self._protocol.terminator))

    def close(self) -> None:
        self._port.close()

    def _exchange(self, request: str, query: Query, timeout: float) -> Reply:
        self._port.drain()
        self._lines.clear()
        self._port.write(framed(request, self._protocol.terminator))
        deadline = self._clock() + timeout
        while True:
            remaining = deadline - self._clock()
            if remaining <= 0:
                raise NoReplyError(f"no reply to `{request}`")
            for line in self._lines.feed(self._port.read(remaining)):
                reply = understand(line, query, self._protocol.error_heads)
                if reply is not None:
                    return reply
                self._tally.noise_lines += 1
