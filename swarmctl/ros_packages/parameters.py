"""The parameters of a node as their readers take them: rosparam of ROS 1, rcl of ROS 2. Pure.

rcl: `rcl_yaml_param_parser/src/parse.c` of ros2/rcl; its numbers are those of strtol and strtod. rosparam:
`rosparam/__init__.py` of ros_comm, behind which XML-RPC carries the values to the master.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Any, Literal, NamedTuple

Loc = tuple[str | int, ...]
Reader = Literal["rcl", "rosparam"]

_WORDS = {
    form: value
    for value, words in ((True, "y yes true on"), (False, "n no false off"))
    for word in words.split()
    for form in (word, word.capitalize(), word.upper())
}
_INTEGER = re.compile(r"[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)", re.ASCII)
_DECIMAL = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)(e[-+]?[0-9]+)?", re.ASCII | re.IGNORECASE)
_HEXADECIMAL = re.compile(
    r"[-+]?0x([0-9a-f]+\.?[0-9a-f]*|\.[0-9a-f]+)(p[-+]?[0-9]+)?", re.ASCII | re.IGNORECASE
)
_NO_NUMBER = re.compile(r"[-+]?(?:\.?(inf)|(inf)inity|\.?(nan)|nan\([a-z0-9_]*\))", re.ASCII | re.IGNORECASE)
_LONGEST = 100  # characters of a whole number, far beyond 64 bits
_BITS = {"rcl": 64, "rosparam": 32}
_WHOSE = {"rcl": "ROS 2", "rosparam": "ROS 1"}


def rcl_value(text: str) -> bool | int | float | str:
    """Returns what rcl reads where a text stands without quotes."""
    if text in _WORDS:
        return _WORDS[text]
    if len(text) < _LONGEST and _INTEGER.fullmatch(text):
        digits = text.lstrip("+-")
        base = 16 if digits[:2] in ("0x", "0X") else 8 if digits[0] == "0" else 10
        value = int(text.replace(digits, digits[2:] if base == 16 else digits), base)
        if fits(value, 64):
            return value
    return _double(text)


def _double(text: str) -> float | str:
    """A number as strtod takes it; text where that is beyond what a double can be."""
    if found := _NO_NUMBER.fullmatch(text):
        number = math.inf if found[1] or found[2] else math.nan
        return -number if text[0] == "-" else number
    try:
        if found := _DECIMAL.fullmatch(text):
            value = float(text)
        elif found := _HEXADECIMAL.fullmatch(text):
            value = float.fromhex(text)
        else:
            return text
    except OverflowError:
        return text
    is_zero = not found[1].strip("0.")
    return value if is_zero or sys.float_info.min <= abs(value) <= sys.float_info.max else text


def fits(value: int, bits: int) -> bool:
    """Returns whether a signed integer of so many bits holds ``value``."""
    return -(1 << bits - 1) <= value < 1 << bits - 1


def for_rcl(params: Mapping[str, Any]) -> dict[str, Any]:
    """Returns parameters as rcl reads them right.

    A list with decimals has no whole numbers, no mapping is empty, and none has a name with a dot: after
    such a one rcl gives the next parameters other names.
    """
    found: dict[str, Any] = {}
    for key, value in params.items():
        if isinstance(value, Mapping):
            below = for_rcl(value)
            found.update(_named(key, below) if "." in key or not below else {key: below})
        elif isinstance(value, (list, tuple)) and {type(one) for one in value} == {int, float}:
            found[key] = [float(one) for one in value]
        else:
            found[key] = value
    return found


def _named(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """The parameters of a mapping by their full names."""
    if isinstance(value, Mapping):
        for key, one in value.items():
            yield from _named(f"{name}.{key}", one)
    else:
        yield name, value


class Refusal(NamedTuple):
    """A value that a node does not get as it is written, by its place; ``help`` begins with a verb."""

    loc: Loc
    message: str
    help: str


def refusals(params: Mapping[str, Any], reader: Reader) -> Iterator[Refusal]:
    """Yields what ``reader`` refuses or reads as something else of the parameters of a node, by name."""
    names: dict[str, Loc] = {}
    yield from _of_mapping(params, reader, (), (), names)


def _of_mapping(
    params: Mapping[Any, Any], reader: Reader, loc: Loc, outer: tuple[str, ...], names: dict[str, Loc]
) -> Iterator[Refusal]:
    between = "." if reader == "rcl" else "/"
    for key, value in params.items():
        here: Loc = (*loc, key)
        if not isinstance(key, str) or not key:
            yield Refusal(
                here, f"`{key}` is no name of a parameter", "write a name, which begins with a letter"
            )
            continue
        name = between.join((*outer, key))
        if name in names:
            first = between.join(map(str, names[name]))
            yield Refusal(
                here, f"`{name}` is given twice, and in two forms", f"remove one: `{first}` is the other"
            )
        names.setdefault(name, here)
        if not isinstance(value, Mapping):
            yield from _of_value(value, reader, here)
        else:
            yield from _of_mapping(value, reader, here, (*outer, key), names)


def _of_value(value: Any, reader: Reader, loc: Loc) -> Iterator[Refusal]:
    if isinstance(value, (list, tuple)):
        yield from _of_list(value, loc) if reader == "rcl" else _items(value, loc)
    elif isinstance(value, Mapping):  # in a list of ROS 1
        for key, one in value.items():
            if not isinstance(key, str):
                yield Refusal((*loc, key), f"the name `{key}` is no text", "put it into quotes")
            yield from _of_value(one, reader, (*loc, key))
    elif isinstance(value, int) and not isinstance(value, bool):
        if not fits(value, _BITS[reader]):
            message = (
                f"{value} does not fit into the {_BITS[reader]} bits of a whole number in {_WHOSE[reader]}"
            )
            yield Refusal(loc, message, "write it as a decimal, or as text in quotes")
    elif isinstance(value, float):
        if reader == "rcl" and 0 < abs(value) < sys.float_info.min:
            yield Refusal(loc, f"{value!r} is so small that rcl reads it as text", "write 0.0")
    elif not isinstance(value, (bool, str, bytes, datetime) if reader == "rosparam" else (bool, str)):
        what = "null" if value is None else f"a value of type {type(value).__name__}"
        yield Refusal(loc, f"{what} is no parameter", "put it into quotes")


def _items(value: list[Any] | tuple[Any, ...], loc: Loc) -> Iterator[Refusal]:
    for index, one in enumerate(value):
        yield from _of_value(one, "rosparam", (*loc, index))


_KINDS: dict[type, str] = {bool: "true or false", int: "numbers", float: "numbers", str: "texts"}


def _of_list(value: list[Any] | tuple[Any, ...], loc: Loc) -> Iterator[Refusal]:
    """What rcl refuses of a list: it has items of one type, and at least one, which gives it its type."""
    own_file = "let the node read a file of its own: files: {NAME.yaml: PATH}"
    if not value:
        yield Refusal(loc, "an empty list has no type, and ROS 2 refuses it", "leave it out")
    first = _KINDS.get(type(value[0])) if value else None
    for index, one in enumerate(value):
        kind = _KINDS.get(type(one))
        if isinstance(one, (list, tuple, Mapping)):
            what = "mapping" if isinstance(one, Mapping) else "list"
            yield Refusal((*loc, index), f"a {what} in a list is no parameter of ROS 2", own_file)
            return
        if kind != first and kind and first:
            message = f"a list of ROS 2 has items of one type: here are {first} and {kind}"
            yield Refusal((*loc, index), message, "put all into quotes, or write two lists")
            return
        yield from _of_value(one, "rcl", (*loc, index))
