"""The messages that rosserial itself needs, and the command messages: conversion between bytes and values.

Little-endian, nothing padded; a text is its length (4 bytes) and its UTF-8. Of rosserial_msgs and std_msgs.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any, Sequence

INTEGERS = {"std_msgs/Int16": "<h", "std_msgs/Int32": "<i"}
TWIST_TYPE, TWIST_MD5 = "geometry_msgs/Twist", "9f195f881246fdfa2798d1d3eebca84a"
_INT32 = range(-(1 << 31), 1 << 31)


class BadMessageError(Exception):
    """Bytes that are not a message of the expected type, or a value that no message can hold."""


@dataclass(frozen=True)
class TopicInfo:
    """How a board announces one of its topics. ``buffer_size`` is that of the buffer its messages pass."""

    topic_id: int
    topic_name: str
    message_type: str
    md5sum: str
    buffer_size: int

    @classmethod
    def decode(cls, message: bytes) -> TopicInfo:
        """Returns the decoded message. Raises ``BadMessageError``."""
        fields = _Fields(message)
        info = cls(fields.number("<H"), fields.text(), fields.text(), fields.text(), fields.number("<i"))
        fields.end()
        return info


@dataclass(frozen=True)
class Log:
    """A log message of a board: level 0 debug, 1 info, 2 warning, 3 error, 4 fatal."""

    level: int
    text: str

    @classmethod
    def decode(cls, message: bytes) -> Log:
        """Returns the decoded message. Raises ``BadMessageError``."""
        fields = _Fields(message)
        log = cls(fields.number("<B"), fields.text())
        fields.end()
        return log


def parameter_name(message: bytes) -> str:
    """The name of the parameter that a board requests."""
    fields = _Fields(message)
    name = fields.text()
    fields.end()
    return name


def parameter(value: Any) -> bytes:
    """Returns the answer to a request for a parameter: bool, integer, float or text, or a list of one kind.

    Raises ``BadMessageError``.
    """
    values = value if isinstance(value, list) else [value]
    kinds = {int if isinstance(one, bool) else type(one) for one in values}
    if not kinds <= {int, float, str}:
        raise BadMessageError("rosserial has only whole numbers, floats, texts, and lists of these")
    if len(kinds) > 1:
        raise BadMessageError("rosserial has lists of one kind only")
    ints, floats, texts = ([one for one in values if kinds == {kind}] for kind in (int, float, str))
    if not all(one in _INT32 for one in ints):
        raise BadMessageError("rosserial has only numbers of 32 bits")
    return b"".join([_array("i", ints), _array("f", map(_float32, floats)), _texts(texts)])


def time(nanoseconds: int) -> bytes:
    """std_msgs/Time from the time since 1970."""
    seconds, rest = divmod(nanoseconds, 1_000_000_000)
    return struct.pack("<II", seconds & 0xFFFFFFFF, rest)


def twist(linear: float, angular: float) -> bytes:
    """geometry_msgs/Twist: m/s forward, rad/s to the left."""
    return struct.pack("<6d", linear, 0.0, 0.0, 0.0, 0.0, angular)


def integer(message_type: str, message: bytes) -> int:
    """The number in a message of one of INTEGERS."""
    fields = _Fields(message)
    number = fields.number(INTEGERS[message_type])
    fields.end()
    return number


def _array(kind: str, values: Any) -> bytes:
    numbers: Sequence[float] = list(values)
    return struct.pack(f"<I{len(numbers)}{kind}", len(numbers), *numbers)


def _float32(value: float) -> float:
    try:
        struct.pack("<f", value)
    except OverflowError:
        raise BadMessageError(f"rosserial's floats of 32 bits hold no {value:g}") from None
    return value


def _texts(texts: Sequence[str]) -> bytes:
    encoded = [text.encode("utf-8") for text in texts]
    return struct.pack("<I", len(encoded)) + b"".join(struct.pack("<I", len(one)) + one for one in encoded)


class _Fields:
    """Takes one field after the other from a message."""

    def __init__(self, message: bytes) -> None:
        self._message = message
        self._at = 0

    def number(self, layout: str) -> int:
        (value,) = struct.unpack(layout, self._take(struct.calcsize(layout)))
        return int(value)

    def text(self) -> str:
        return self._take(self.number("<I")).decode("utf-8", "replace")

    def end(self) -> None:
        if self._at != len(self._message):
            raise BadMessageError(f"{len(self._message) - self._at} bytes too many")

    def _take(self, count: int) -> bytes:
        taken = self._message[self._at : self._at + count]
        if len(taken) < count:
            raise BadMessageError(f"{count - len(taken)} bytes are missing")
        self._at += count
        return taken
