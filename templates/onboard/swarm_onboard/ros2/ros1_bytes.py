"""Converts messages of ROS 2 to and from bytes as ROS 1 serialises them, for boards and islands of ROS 1.

Little-endian as the computers here, nothing padded; a text or a list of any length begins with its length in
4 bytes (wiki.ros.org/msg). A header has a sequence number in front, which ROS 2 does not have.
"""

from __future__ import annotations

import re
import struct
from array import array
from functools import lru_cache
from importlib import import_module
from typing import Any, Callable, Tuple

_BOOLEAN, _OCTET = "boolean", "octet"  # lists of them are no arrays in rclpy
_NUMBERS = {
    _BOOLEAN: "?", "uint8": "B", "int8": "b", "uint16": "H", "int16": "h", "uint32": "I",
    "int32": "i", "uint64": "Q", "int64": "q", "float": "f", "double": "d",
}  # fmt: skip
LIST = re.compile(r"sequence<(?P<any>[^,>]+(<\d+>)?)(, (?P<bound>\d+))?>|(?P<some>.+)\[(?P<count>\d+)\]")
_TIMES = {"builtin_interfaces/Time": "<II", "builtin_interfaces/Duration": "<ii"}
_HEADER = "std_msgs/Header"
_NEW_FIELDS = {"sensor_msgs/Range": "variance"}  # which ROS 1 does not have

#: Writes a value to bytes; reads one from bytes at a position and returns the position behind it.
Codec = Tuple[Callable[[Any], bytes], Callable[[bytes, int], Tuple[Any, int]]]


def message_class(name: str) -> Any:
    """Returns the class of a type such as ``std_msgs/String``. Raises any error if this host has none."""
    package, _, kind = name.partition("/")
    return getattr(import_module(f"{package}.msg"), kind)


def encode(message: Any) -> bytes:
    """Returns a message as ROS 1 serialises it."""
    kind = type(message)
    return _message(f"{kind.__module__.partition('.')[0]}/{kind.__name__}")[0](message)


def decode(name: str, data: bytes) -> Any:
    """Returns the message of the type ``name`` in ``data``. Raises ValueError if it holds another one."""
    try:
        message, end = _message(name)[1](data, 0)
    except (struct.error, UnicodeDecodeError, AssertionError) as error:  # the last: of rclpy
        raise ValueError(f"{len(data)} bytes are no {name}: {error}") from error
    if end != len(data):
        raise ValueError(f"{len(data)} bytes are no {name}: {len(data) - end} too many")
    return message


@lru_cache(maxsize=None)
def _message(name: str) -> Codec:
    kind = message_class(name)
    fields = [(field, _codec(text)) for field, text in kind.get_fields_and_field_types().items()
              if field != _NEW_FIELDS.get(name)]  # fmt: skip
    sequence_number = 4 if name == _HEADER else 0

    def write(message: Any) -> bytes:
        written = (codec[0](getattr(message, field)) for field, codec in fields)
        return bytes(sequence_number) + b"".join(written)

    def read(data: bytes, at: int) -> tuple[Any, int]:
        message, at = kind(), at + sequence_number
        for field, codec in fields:
            value, at = codec[1](data, at)
            setattr(message, field, value)
        return message, at

    return write, read


@lru_cache(maxsize=None)
def _codec(text: str) -> Codec:
    """The codec of a field, by its type as ``get_fields_and_field_types`` has it."""
    found = LIST.fullmatch(text)
    if found:
        count = found["count"]
        return _list(found["any"] or found["some"], int(count) if count else None)
    if text in _NUMBERS:
        return _number(f"<{_NUMBERS[text]}")
    if text == _OCTET:
        return _octet()
    if text in _TIMES:
        return _time(text, struct.Struct(_TIMES[text]))
    return _text() if text.startswith("string") else _message(text)


def _number(layout: str) -> Codec:
    packed = struct.Struct(layout)
    return packed.pack, lambda data, at: (packed.unpack_from(data, at)[0], at + packed.size)


def _octet() -> Codec:
    """A `byte`, which rclpy has as bytes of length 1."""
    return bytes, lambda data, at: (struct.unpack_from("c", data, at)[0], at + 1)


def _time(name: str, packed: struct.Struct) -> Codec:
    kind = message_class(name)

    def read(data: bytes, at: int) -> tuple[Any, int]:
        seconds, nanoseconds = packed.unpack_from(data, at)
        return kind(sec=min(seconds, (1 << 31) - 1), nanosec=nanoseconds), at + packed.size

    return lambda value: packed.pack(value.sec, value.nanosec), read


def _text() -> Codec:
    def write(value: str) -> bytes:
        encoded = value.encode("utf-8")
        return struct.pack("<I", len(encoded)) + encoded

    def read(data: bytes, at: int) -> tuple[str, int]:
        (length,) = struct.unpack_from("<I", data, at)
        (encoded,) = struct.unpack_from(f"{length}s", data, at + 4)
        return encoded.decode("utf-8"), at + 4 + length

    return write, read


def _list(element: str, count: int | None) -> Codec:
    """A list; numbers in one piece, since images and scans are long."""
    write_one, read_one = _codec(element)
    layout = _NUMBERS[element] if element in _NUMBERS and element != _BOOLEAN else ""
    least = struct.calcsize(f"<{layout}") if layout else 1  # bytes of an element

    def write(values: Any) -> bytes:
        length = b"" if count is not None else struct.pack("<I", len(values))
        if layout:
            return length + array(layout, values).tobytes()
        return length + b"".join(map(write_one, values))

    def read(data: bytes, at: int) -> tuple[Any, int]:
        length = count
        if length is None:
            (length,), at = struct.unpack_from("<I", data, at), at + 4
        if length * least > len(data) - at:
            raise struct.error(f"a list of {length} is cut short")
        if layout:
            numbers = array(layout, data[at : at + length * least])
            return (numbers if count is None else numbers.tolist()), at + length * least
        values = []
        for _ in range(length):
            value, at = read_one(data, at)
            values.append(value)
        return values, at

    return write, read
