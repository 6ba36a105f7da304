"""One request, one reply, over one open port. Every reply is read; unsolicited bytes count as noise."""

from __future__ import annotations

import math
import typing
from typing import Callable, TypeVar

from swarm_onboard.driver.codec import BadReplyError, Codec, Reply, Request
from swarm_onboard.driver.tally import Tally

T = TypeVar("T")

_QUIET = 0.05  # s without a byte after which a late answer is over; packets by radio come 20 ms apart


class NoReplyError(Exception):
    """The robot did not answer in time."""


class LinkLostError(Exception):
    """The line must be closed and opened again; the next connection begins with a stop."""


#: How an exchange can fail while the port itself is there.
FAILED_EXCHANGE = (NoReplyError, BadReplyError)


class BytePort(typing.Protocol):
    """What a link needs of a port; ``port.Port`` is one. All but ``close`` may raise ``PortError``."""

    def write(self, data: bytes) -> None:
        """Writes all of ``data``."""

    def read(self, timeout: float) -> bytes:
        """Waits up to ``timeout`` seconds for the first byte. Returns what has arrived."""

    def drain(self) -> None:
        """Discards what has arrived."""

    def fileno(self) -> int:
        """Returns the file descriptor."""

    def close(self) -> None:
        """Closes the port."""


class Link:
    """The exchanges with one robot. They raise what FAILED_EXCHANGE names, or ``PortError``."""

    def __init__(
        self,
        port: BytePort,
        codec: Codec,
        reply_timeout: float,
        tally: Tally,
        clock: Callable[[], float],
        *,
        overhear: Callable[[bytes], str] = lambda _: "",
    ) -> None:
        self._port = port
        self.codec = codec
        self.reply_timeout = reply_timeout
        self._tally = tally
        self._clock = clock
        self._overhear = overhear
        self._unsettled = False  # an answer that has no frame may still be coming
        self._answer_due = -math.inf  # until when the last one may

    def set_speed(self, left: int, right: int) -> None:
        """Sets both wheel speeds, in the robot's units."""
        self.ask(self.codec.speed(left, right))

    def ask(self, request: Request, timeout: float = math.inf, wait: float | None = None) -> Reply:
        """Sends ``request`` and returns its reply. Waits up to ``timeout`` s or the reply timeout.

        ``wait`` replaces the latter for an answer that takes longer than usual.
        """
        deadline = self._clock() + timeout
        if not request.urgent:
            self.settle(timeout)
        doubtful = self._unsettled  # what is read now may be the answer to the request before
        self._tally.reported = self._overhear(self._port.read(0.0)) or self._tally.reported
        self._port.drain()
        self._port.write(request.data)
        if not request.answered:
            return Reply()
        self._unsettled = doubtful or not request.framed
        self._answer_due = self._clock() + (self.reply_timeout if wait is None else wait)
        reply = self._answer(request, min(deadline, self._answer_due))
        self._unsettled = doubtful
        return reply

    def settle(self, timeout: float) -> bool:
        """Waits for a late answer to pass, which would be taken for the next one.

        Returns whether one may have come.
        """
        if not self._unsettled:
            return False
        now = self._clock()
        enough = now + self.reply_timeout
        deadline = min(now + timeout, enough)
        while (now := self._clock()) < deadline:
            if not self._port.read(min(_QUIET, deadline - now)) and now >= self._answer_due:
                break
        self._unsettled = deadline <= now < enough
        return True

    def pass_by(self) -> None:
        """Waits until no more of what follows a reply arrives."""
        deadline = self._clock() + self.reply_timeout
        while (remaining := deadline - self._clock()) > 0 and self._port.read(min(_QUIET, remaining)):
            pass

    def twice(self, exchange: Callable[[], T]) -> T:
        """Returns the outcome of ``exchange``, repeated once if it fails.

        Raises ``LinkLostError`` after that.
        """
        try:
            return exchange()
        except FAILED_EXCHANGE as error:
            self._tally.failed(error)
        try:
            return exchange()
        except FAILED_EXCHANGE as error:
            self._tally.failed(error)
            raise LinkLostError(str(error)) from error

    def send_stop(self) -> None:
        """Sends the stop and waits for no reply: the last request on a line that is given up."""
        self._port.write(self.codec.speed(0, 0).data)

    def close(self) -> None:
        """Closes the port."""
        self._port.close()

    def _answer(self, request: Request, deadline: float) -> Reply:
        reader = request.reader()
        try:
            while True:
                remaining = deadline - self._clock()
                if remaining <= 0:
                    raise NoReplyError(self._tally.reported or f"no reply to `{request.name}`")
                reply = reader.feed(self._port.read(remaining))
                self._tally.reported = reader.stray or self._tally.reported
                if reply is not None:
                    return reply
        finally:
            self._tally.noise_lines += reader.noise
