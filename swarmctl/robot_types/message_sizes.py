"""How many bytes a ROS 1 message is when it is sent, from its fields (templates/data/message_sizes.yaml)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import yaml

from swarmctl import resources

FRAME_NAME = 16  # characters that the name of a frame is taken to have, as in `epuck_1/base_link`
_LENGTH = 4  # bytes before a text or a list, which hold its length
_BYTES = {
    "bool": 1, "byte": 1, "char": 1, "int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4,
    "float32": 4, "int64": 8, "uint64": 8, "float64": 8, "time": 8, "duration": 8,
    "frame": _LENGTH + FRAME_NAME,
}  # fmt: skip
_FIELD = re.compile(r"(?P<type>[A-Za-z0-9_/]+)(?:\[(?P<count>[0-9]*)\])?")


@dataclass(frozen=True)
class MessageSize:
    """Bytes of a message as sent. An ``open`` one has texts or lists, which are counted as empty."""

    bytes: int
    open: bool


@cache
def size_of(type_name: str) -> MessageSize | None:
    """Returns the size of messages of a type, in bytes; None for a type that is not a common one."""
    if type_name in _BYTES:
        return MessageSize(_BYTES[type_name], False)
    if type_name == "string":
        return MessageSize(_LENGTH, True)
    fields = _types().get(type_name)
    if fields is None:
        return None
    package = type_name.partition("/")[0]
    sizes = [_field(field, package) for field in fields]
    return MessageSize(sum(one.bytes for one in sizes), any(one.open for one in sizes))


def _field(field: str, package: str) -> MessageSize:
    match = _FIELD.fullmatch(field)
    if match is None:
        raise ValueError(f"`{field}` is not a field of a message")
    name, count = match["type"], match["count"]
    if count == "":
        return MessageSize(_LENGTH, True)
    one = size_of(name) or size_of(f"{package}/{name}")
    if one is None:
        raise ValueError(f"there is no type `{name}` for a field")
    return MessageSize(one.bytes * int(count or 1), one.open)


@cache
def _types() -> Mapping[str, list[str]]:
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    types: Mapping[str, list[str]] = yaml.load(
        (resources.templates() / "data/message_sizes.yaml").read_text("utf-8"), loader
    )
    return types
