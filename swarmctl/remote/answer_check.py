"""Compares JSON from a host with the type that it should have, and makes values of it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import is_dataclass
from functools import lru_cache, partial
from itertools import islice
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints, is_typeddict

DEEPEST = 32  # levels of lists and objects in one answer
_LARGEST = 1 << 63
_LONGEST_NUMBER = 40  # characters
_LONGEST_TEXT = 300  # of a value
_MOST = 20_000  # entries of one list or mapping of a value
_NAMES = {str: "text", bool: "true or false", int: "a whole number", float: "a number", NoneType: "null"}


def parsed(text: str | bytes) -> Any:
    """Returns JSON from a host; a number too large to compute with is NaN, which fits nowhere.

    Raises ValueError if it is none, or not ``bounded``.
    """
    try:
        value = json.loads(text, parse_int=partial(_number, int), parse_float=partial(_number, float))
    except RecursionError as error:
        raise ValueError(str(error)) from None
    if not bounded(value):
        raise ValueError("too deep, or not UTF-8")
    return value


def _number(kind: Callable[[str], float], text: str) -> float:
    value = kind(text) if len(text) < _LONGEST_NUMBER else math.nan
    return value if abs(value) < _LARGEST else math.nan


def bounded(value: Any) -> bool:
    """Returns True if ``value`` is at most ``DEEPEST`` levels deep and all its texts are valid UTF-8."""
    level: list[Any] = [value]
    for _ in range(DEEPEST):
        if not all(_encodable(one) for one in level if isinstance(one, str)):
            return False
        level = [inner for one in level for inner in _inside(one)]
        if not level:
            return True
    return False


def _inside(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return (*value.keys(), *value.values())
    return value if isinstance(value, list) else ()


def _encodable(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:  # half a surrogate pair
        return False
    return True


def mismatch(value: Any, expected: Any, where: str = "the answer") -> str:
    """The first part of ``value`` that is not of the type ``expected``, as text; empty if all of it fits.

    ``expected`` is a TypedDict, a named tuple, a union, a Literal, Any, or a list, dict or scalar of JSON.
    Unknown keys are ignored.
    """
    if expected is Any:
        return ""
    if is_typeddict(expected) or _is_named_tuple(expected):
        return _object_mismatch(value, expected, where)
    origin, inner = get_origin(expected), get_args(expected)
    if origin is Literal:
        return "" if value in inner and isinstance(value, str) else f"{where} is none of {', '.join(inner)}"
    if origin in (Union, UnionType):
        found = [mismatch(value, one, where) for one in inner]
        return "" if "" in found else f"{where} is not {' or '.join(_name(one) for one in inner)}"
    if origin is list:
        if not isinstance(value, list):
            return f"{where} is not a list"
        return _first(mismatch(one, inner[0], f"{where}[{index}]") for index, one in enumerate(value))
    if origin is dict:
        if not isinstance(value, dict):
            return f"{where} is not an object"
        return _first(mismatch(one, inner[1], f"{where}.{key[:80]}") for key, one in value.items())
    return "" if _is_scalar(value, expected) else f"{where} is not {_name(expected)}"


def _object_mismatch(value: Any, expected: Any, where: str) -> str:
    if not isinstance(value, dict):
        return f"{where} is not an object"
    required = expected.__required_keys__ if is_typeddict(expected) else set(expected._fields)
    if missing := sorted(required - value.keys()):
        return f"{where} has no `{missing[0]}`"
    types = types_of(expected)
    return _first(mismatch(value[key], types[key], f"{where}.{key}") for key in types if key in value)


@lru_cache
def types_of(kind: type) -> Mapping[str, Any]:
    """The types of a class's fields by name, evaluated."""
    return get_type_hints(kind, localns={"Literal": Literal})  # a host does not import `typing`


def _is_scalar(value: Any, expected: type) -> bool:
    """JSON also has NaN, integers beyond any float, and booleans, which Python counts as integers."""
    if expected in (int, float):
        numbers = (int,) if expected is int else (int, float)
        return (
            isinstance(value, numbers)
            and not isinstance(value, bool)
            and abs(value) < _LARGEST
            and math.isfinite(value)
        )
    return isinstance(value, expected)


def _first(found: Iterable[str]) -> str:
    return next((one for one in found if one), "")


def _name(expected: Any) -> str:
    return _NAMES.get(expected, "what it should be")


def value_of(kind: Any, data: Any) -> Any:
    """Returns JSON that fits ``kind`` as a value of that type, of bounded size.

    What is missing or null in an object has the default of a dataclass.
    """
    if _is_named_tuple(kind):
        types = types_of(kind)
        return kind(*(None if data[name] is None else value_of(types[name], data[name]) for name in types))
    if isinstance(kind, type) and is_dataclass(kind):
        types = types_of(kind)
        given = ((name, one) for name, one in data.items() if name in types and one is not None)
        return kind(**{name: value_of(types[name], one) for name, one in given})
    origin, inner = get_origin(kind), get_args(kind)
    if origin is UnionType:
        return value_of(inner[0], data)
    if origin is Mapping:
        return {name[:_LONGEST_TEXT]: value_of(inner[1], one) for name, one in islice(data.items(), _MOST)}
    if origin is tuple:
        return tuple(value_of(inner[0], one) for one in data[:_MOST])
    return data[:_LONGEST_TEXT] if kind is str else data


def _is_named_tuple(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields")
