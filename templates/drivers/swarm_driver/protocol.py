"""Requests as lines, lines as replies. Pure, and unmoved by whatever bytes arrive."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Sequence

from swarm_driver.config import Query

# Longer than any reply; what is longer is noise and not worth keeping.
_LONGEST_LINE = 512
_LINE_END = re.compile(rb"[\r\n]+")
_NUMBER = re.compile(r"[+-]?[0-9]{1,18}", re.ASCII)
_VERSION = re.compile(r"[0-9]{1,6}(?:\.[0-9]{1,6})?", re.ASCII)


class BadReplyError(Exception):
    """The robot answered, but refused the request or garbled the reply."""


@dataclass(frozen=True)
class Reply:
    """A good reply: its numbers, and its text after the head."""

    values: tuple[int, ...]
    text: str


def speed_request(query: Query, left: int, right: int) -> str:
    return query.send.replace("{left}", str(left)).replace("{right}", str(right))


def framed(request: str, terminator: str) -> bytes:
    return (request + terminator).encode("ascii")


def understand(line: bytes, query: Query, error_heads: Sequence[str]) -> Reply | None:
    """The reply in ``line``, or nothing when it is noise: a banner, an old answer. Raises BadReplyError."""
    text = line.decode("ascii", "backslashreplace").strip()
    head, _, rest = text.partition(",")
    if head != query.reply:
        if text.startswith(tuple(error_heads)):
            raise BadReplyError(f"the robot answers `{text[:80]}`")
        return None
    fields = [field.strip() for field in rest.split(",")] if rest else []
    if query.values == 0:
        return Reply((), rest)
    if not query.values <= len(fields) <= query.values + query.extra:
        raise BadReplyError(f"`{text[:80]}` has {len(fields)} values instead of {query.values}")
    if not all(_NUMBER.fullmatch(field) for field in fields):
        raise BadReplyError(f"`{text[:80]}` is not made of numbers")
    return Reply(tuple(int(field) for field in fields[: query.values]), rest)


def firmware_version(text: str) -> float | None:
    """The first number in the answer to the question for the firmware."""
    found = _VERSION.search(text)
    return float(found.group()) if found else None


class LineBuffer:
    """Cuts a stream of bytes into lines. CR, LF or both end a line; empty lines do not count."""

    def __init__(self) -> None:
        self._rest = b""

    def clear(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """The lines that ``data`` completes."""
        *lines, rest = _LINE_END.split(self._rest + data)
        self._rest = rest[-_LONGEST_LINE:]
        return [line for line in lines if line]
