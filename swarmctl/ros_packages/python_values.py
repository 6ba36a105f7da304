"""Values of a Python launch file, and what operators, methods and functions of Python make of them.

A value is a constant, a list or dictionary of values, a substitution of launch, or unknown, with the reason.
"""

from __future__ import annotations

import ast
import json
import operator
import posixpath
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from swarmctl.ros_packages.launch_values import Computed, Text, Unknown, Variable

COMPUTED, OF_THE_LAUNCH = "what it computes", "a value of the running launch"
FOLDER = "$(dirname)"
LARGEST = 2_000  # items of a list, characters of a text
_LARGEST_NUMBER = 1 << 63
_WIDE = re.compile(r"\*|\d{3}")  # of a format


class TooMuchError(Exception):
    """The file takes more steps than the limit."""


@dataclass(frozen=True)
class Name:
    """What an import brings, by its last name."""

    name: str


@dataclass(frozen=True)
class Opened(Unknown):
    """The text of a file, which only a reader of YAML or JSON knows."""

    file: Any = None


def why_unknown(value: Any) -> str | None:
    """Returns why a value cannot be tested or iterated here; None if it can."""
    if isinstance(value, Unknown):
        return value.why
    if isinstance(value, Name) and value.name == "environ":
        return "the environment"
    return OF_THE_LAUNCH if isinstance(value, (Text, Variable, Computed, Name)) else None


def is_plain(value: Any) -> bool:
    """Returns True for a value that takes no time to print or compare: nothing within it."""
    if isinstance(value, int):
        return abs(value) <= _LARGEST_NUMBER
    return isinstance(value, (str, float, type(None)))


_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod,
}  # fmt: skip

COMPARISONS: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le,
    ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Is: lambda one, other: one is other or one == other,
    ast.IsNot: lambda one, other: one != other, ast.In: lambda one, other: one in other,
    ast.NotIn: lambda one, other: one not in other,
}  # fmt: skip


def binary(op: ast.operator, left: Any, right: Any) -> Any:
    """Returns the value of an operator between two values; `/` joins paths."""
    for one in (left, right):
        if isinstance(one, (Unknown, bytes)):
            return one if isinstance(one, Unknown) else Unknown(COMPUTED)
    if isinstance(op, ast.Add) and (
        isinstance(left, (Text, Variable)) or isinstance(right, (Text, Variable))
    ):
        return joined([left, right])
    if isinstance(op, ast.Div) and isinstance(left, (str, Text, Variable)):
        return joined([left, "/", right])
    function = _BINARY.get(type(op))
    if (
        function is None
        or isinstance(left, (Text, Variable, Computed, Name))
        or isinstance(right, (Text, Variable, Computed, Name))
    ):
        return Unknown(COMPUTED)
    size = sum(len(one) for one in (left, right) if isinstance(one, (str, list, tuple)))
    if size > LARGEST:
        return Unknown("a long list or text")
    times = next((one for one in (left, right) if isinstance(one, int)), 1)
    if isinstance(op, ast.Mult) and size * abs(times) > LARGEST:
        return Unknown("a long list or text")
    if isinstance(op, ast.Mod) and isinstance(left, str):
        values = right if isinstance(right, tuple) else (right,)
        if _WIDE.search(left) or not all(map(is_plain, values)):
            return Unknown("a format")
    try:
        found = function(left, right)
    except (TypeError, ValueError, ArithmeticError):
        return Unknown(COMPUTED)
    return Unknown("a large number") if isinstance(found, int) and abs(found) > _LARGEST_NUMBER else found


def joined(parts: Sequence[Any]) -> Any:
    """Returns the parts as one text; unknown if one of them is."""
    if unknown := next((one for one in parts if isinstance(one, Unknown)), None):
        return unknown
    if all(map(is_plain, parts)) and sum(len(one) for one in parts if isinstance(one, str)) <= LARGEST:
        text = "".join(map(str, parts))
        return text if len(text) <= LARGEST else Unknown("a long text")
    if all(isinstance(one, (str, int, float, bool, Text, Variable, Computed)) for one in parts):
        return Text(tuple(parts))
    return Unknown(COMPUTED)


def between(text: str, items: Sequence[Any]) -> list[Any]:
    """Returns the items with a text between them."""
    found: list[Any] = []
    for number, one in enumerate(items):
        found += [text, one] if number else [one]
    return found


_OF_TEXT = frozenset(
    ("format", "join", "split", "replace", "lower", "upper", "strip", "lstrip", "rstrip", "startswith",
     "endswith")
)  # fmt: skip

_FORMATS = ":!.["  # of a format: widths, conversions, attributes


def extended_by(into: list[Any], items: Sequence[Any]) -> None:
    """Adds items to a list. Raises ``TooMuchError`` if it grows too long."""
    if len(into) + len(items) > LARGEST:
        raise TooMuchError
    into.extend(items)


def _of_list(into: list[Any], name: str, given: list[Any], _named: Mapping[str, Any]) -> Any:
    if name == "copy":
        return list(into)
    if name == "append":
        extended_by(into, given[:1])
    elif name == "insert" and len(given) > 1 and isinstance(given[0], int):
        into.insert(max(-LARGEST, min(given[0], LARGEST)), given[1])
    elif name == "extend" and given:
        extended_by(into, given[0] if isinstance(given[0], (list, tuple)) else given[:1])
    else:
        return Unknown(f"`.{name}()`")
    return None


def _of_text(into: str, name: str, given: list[Any], named: Mapping[str, Any]) -> Any:
    if name == "join" and given and isinstance(given[0], (list, tuple)):
        return joined(between(into, given[0]))
    if unknown := next((one for one in (*given, *named.values()) if isinstance(one, Unknown)), None):
        return unknown
    if not all(map(is_plain, (*given, *named.values()))):
        return Unknown(f"`.{name}()`")
    sizes = sum(len(one) for one in given if isinstance(one, str))
    grows = name == "replace" and len(into) * sizes > LARGEST
    if name not in _OF_TEXT or grows or any(char in into for char in _FORMATS if name == "format"):
        return Unknown(f"`.{name}()`")
    try:
        found = getattr(into, name)(*given, **named)
    except (TypeError, ValueError, LookupError, AttributeError):
        return Unknown(f"`.{name}()`")
    return Unknown("a long text") if isinstance(found, str) and len(found) > LARGEST else found


def _of_dict(into: dict[Any, Any], name: str, given: list[Any], named: Mapping[str, Any]) -> Any:
    if name in ("items", "keys", "values"):
        return list(getattr(into, name)())
    if name == "copy":
        return dict(into)
    if name == "update":
        into.update(given[0] if given and isinstance(given[0], dict) else {})
        into.update(named)
        return None
    try:
        return into.get(given[0], given[1] if len(given) > 1 else None) if name == "get" else Unknown(name)
    except (LookupError, TypeError):
        return Unknown(f"`.{name}()`")


METHODS: Mapping[type[Any], Callable[..., Any]] = {list: _of_list, dict: _of_dict, str: _of_text}

_BUILTINS: Mapping[str, Callable[..., Any]] = {
    "len": len, "str": str, "int": int, "float": float, "bool": bool, "list": list, "dict": dict,
    "tuple": tuple, "sorted": sorted, "min": min, "max": max, "sum": sum, "abs": abs, "round": round,
    "enumerate": lambda items, start=0: list(enumerate(items, start)),
    "zip": lambda *items: list(zip(*items, strict=False)),
    "reversed": lambda items: list(reversed(items)),
}  # fmt: skip

_LOOKING = frozenset(("str", "sorted", "min", "max", "sum"))  # what looks into its values

CHANGES = ("append", "insert", "extend", "update", "setdefault")  # of a list or a dictionary

SAME_PATH = ("resolve", "as_posix", "absolute", "expanduser", "__str__")

_OF_PATHS = frozenset((
    "join", "get_package_share_directory", "get_package_share_path", "dirname", "Path", "realpath", "abspath",
))  # fmt: skip

SIMPLE = frozenset((*_BUILTINS, *_OF_PATHS, "range", "print"))


def _of_path(name: str, given: list[Any]) -> Any:
    if name == "join":
        return joined(between("/", given))
    first = given[0] if given else ""
    if name.startswith("get_package"):
        return f"$(find-pkg-share {first})" if isinstance(first, str) else Unknown("a package")
    if name == "Path" and len(given) > 1:
        return joined(between("/", given))
    if name == "dirname":
        return folder_of(first) if isinstance(first, str) else Unknown("a path")
    return first if isinstance(first, (str, Text)) else Unknown("a path")


def folder_of(path: str) -> str:
    """Returns the folder of a path."""
    return f"{path}/.." if path.endswith((")", "..")) else posixpath.dirname(path)


def simple_call(name: str, given: list[Any], named: Mapping[str, Any]) -> Any:
    """Returns the value of a call of one of ``SIMPLE``."""
    if name == "dict" and all(isinstance(one, dict) for one in given):
        return {**(given[0] if given else {}), **named}
    if named and name != "print":
        return Unknown(f"{name}()")
    if name == "print":
        return None
    if unknown := next((one for one in given if isinstance(one, Unknown)), None):
        return unknown
    if name in _OF_PATHS:
        return _of_path(name, given)
    if any(isinstance(one, (Text, Variable, Computed, Name)) for one in given):
        is_text = name == "str" and len(given) == 1 and not isinstance(given[0], Name)
        return given[0] if is_text else Unknown(OF_THE_LAUNCH)
    inside = [one for item in given for one in (item if isinstance(item, (list, tuple, dict)) else [item])]
    if name in _LOOKING and not all(map(is_plain, inside)):
        return Unknown(f"{name}()")
    try:
        if name == "range":
            found = range(*given)
            return list(found) if len(found) <= LARGEST else Unknown("a long range")
        made = _BUILTINS[name](*given)
    except (TypeError, ValueError, ArithmeticError):
        return Unknown(f"{name}()")
    return made


def dumped(value: Any) -> Any:
    """Returns a value as text in YAML, which is that of JSON, too."""
    waiting, count = [value], 0
    while waiting:  # what repeats itself may have no end
        one, count = waiting.pop(), count + 1
        inside = (
            list(one.values()) if isinstance(one, dict) else one if isinstance(one, (list, tuple)) else []
        )
        waiting += inside
        if count > LARGEST or not (inside or is_plain(one) or one in ([], {})):
            return Unknown("dump()")
    try:
        text = json.dumps(value, default=str)
    except TypeError:  # of a key
        return Unknown("dump()")
    return text if len(text) <= LARGEST else Unknown("a long text")


def opened(file: Any) -> Opened:
    """Returns the text of a file at a path."""
    return Opened(f"the text of {file}" if isinstance(file, str) else "the text of a file", file=file)
