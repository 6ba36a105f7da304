"""Requests as lines of text, lines as replies. Pure, and unmoved by whatever bytes arrive."""

from __future__ import annotations

import re
from typing import Sequence

from swarm_onboard.driver.codec import BadReplyError, Number, Reply, Request
from swarm_onboard.driver.config import Actuator
from swarm_onboard.driver.protocols import LineProtocol, LineQuery

# Longer than any reply; what is longer is noise and not worth keeping.
_LONGEST_LINE = 512
_LINE_END = re.compile(rb"[\r\n]+")
_WHOLE = re.compile(r"[+-]?[0-9]{1,20}", re.ASCII)  # 64 bits
_DECIMAL = re.compile(r"[+-]?[0-9]{1,18}(?:\.[0-9]{1,18})?", re.ASCII)
_VERSION = re.compile(r"[0-9]{1,6}(?:\.[0-9]{1,6})?", re.ASCII)


class LineCodec:
    """The codec of robots that are polled in lines of text."""

    def __init__(self, protocol: LineProtocol) -> None:
        self._protocol = protocol

    def speed(self, left: int, right: int) -> Request:
        query = self._protocol.set_speed
        return self._request(filled(query.send, left=left, right=right), query, urgent=True)

    def query(self, name: str) -> Request:
        query = self._protocol.queries[name]
        return self._request(query.send, query)

    def actuator(self, actuator: Actuator, index: int, values: Sequence[int]) -> Request:
        query = LineQuery(actuator.send, actuator.reply or "")
        together = self._protocol.separator.join(str(value) for value in values)
        return self._request(filled(query.send, index=index, value=values[index], values=together), query)

    def setup(self) -> list[Request]:
        return [self._request(one.send, one) for one in self._protocol.setup]

    def identify(self) -> Request | None:
        query = self._protocol.identify
        return self._request(query.send, query) if query else None

    def _request(self, text: str, query: LineQuery, *, urgent: bool = False) -> Request:
        return Request(
            (text + self._protocol.terminator).encode("ascii"),
            text,
            lambda: LineReader(query, self._protocol),
            answered=bool(query.reply),
            urgent=urgent,
        )


class LineReader:
    """Waits for the reply to one query among the lines that arrive."""

    def __init__(self, query: LineQuery, protocol: LineProtocol) -> None:
        self._query = query
        self._protocol = protocol
        self._lines = LineBuffer()
        self.noise = 0
        self.stray = ""

    def feed(self, data: bytes) -> Reply | None:
        for line in self._lines.feed(data):
            reply = understand(line, self._query, self._protocol.error_heads, self._protocol.separator)
            if reply is not None:
                return reply
            self.noise += 1
            self.stray = reported_by(line, self._protocol) or self.stray
        return None


def filled(send: str, **values: int | str) -> str:
    """A request with ``values`` in its places."""
    for name, value in values.items():
        send = send.replace("{" + name + "}", str(value))
    return send


def understand(
    line: bytes, query: LineQuery, error_heads: Sequence[str], separator: str = ","
) -> Reply | None:
    """Returns the reply in ``line``, or None if it is noise: a banner, an old answer.

    Raises BadReplyError.
    """
    text = _text(line)
    head, rest = _parted(text, separator)
    if head != query.reply:
        if text.startswith(tuple(error_heads)):
            raise BadReplyError(f"the robot answers `{text[:80]}`")
        return None
    if query.values == 0:
        return Reply((), rest)
    fields = _fields(rest, query, separator)
    if fields is None:
        raise BadReplyError(f"`{text[:80]}` is not what is expected after `{query.reply}`")
    if not query.values <= len(fields) <= query.values + query.extra:
        raise BadReplyError(f"`{text[:80]}` has {len(fields)} values instead of {query.values}")
    number = _DECIMAL if query.pattern else _WHOLE
    if not all(number.fullmatch(field) for field in fields):
        raise BadReplyError(f"`{text[:80]}` is not made of numbers")
    return Reply(tuple(_number(field) for field in fields[: query.values]), rest)


def reported_by(line: bytes, protocol: LineProtocol) -> str:
    """The meaning of an unsolicited line, empty if the robot type does not know it."""
    text = _text(line)
    for stray in protocol.strays:
        if text.startswith(stray.begins) and not text.startswith(stray.unless):
            return f"the robot reports `{text[:80]}`: {stray.means}"
    return ""


def overheard(data: bytes, protocol: LineProtocol) -> str:
    """The meaning of the last unsolicited line that the robot type knows; empty if there is none."""
    meanings = (reported_by(line, protocol) for line in LineBuffer().feed(data + b"\n"))
    return next((one for one in reversed(list(meanings)) if one), "")


def _text(line: bytes) -> str:
    return line.decode("ascii", "backslashreplace").strip()


def _parted(text: str, separator: str) -> tuple[str, str]:
    """The head of a line, and the rest."""
    blank = None if separator.isspace() else separator.strip()
    head, *rest = text.split(blank, 1) or [""]
    return head.strip(), "".join(rest)


def _fields(rest: str, query: LineQuery, separator: str) -> list[str] | None:
    """Returns the numbers as text; None if the reply does not have the form that ``query`` describes."""
    if query.pattern is None:
        if separator.isspace():
            return rest.split()
        return [field.strip() for field in rest.split(separator.strip())] if rest else []
    found = query.pattern.match(rest)
    return [group or "" for group in found.groups()] if found else None


def _number(field: str) -> Number:
    return float(field) if "." in field else int(field)


def firmware_version(text: str) -> float | None:
    """Returns the first number in the reply to ``identify``."""
    found = _VERSION.search(text)
    return float(found.group()) if found else None


class LineBuffer:
    """Cuts a stream of bytes into lines. CR, LF or both end a line; empty lines do not count."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Returns the lines that ``data`` completes."""
        *lines, rest = _LINE_END.split(self._rest + data)
        self._rest = rest[-_LONGEST_LINE:]
        return [line for line in lines if line]
