"""Messages of ROS 2 as YAML, and from what YAML reads. Knows no rclpy."""

from __future__ import annotations

import math
from typing import Any, Mapping, Match

import yaml

from swarm_onboard.agent.texts import clipped
from swarm_onboard.ros2.ros1_bytes import LIST, message_class

_MOST = 128  # elements of a list that are shown, as of `ros2 topic echo`
_WIDE = 1 << 30  # letters of a line
_LONGEST = 60  # characters of a value in an error
_LARGEST = {"float": 3.4028234663852886e38, "double": math.inf}


def text(message: Any) -> str:
    """Returns the fields of a message in their order; of a list of more than 128 the first, and `...`."""
    return str(yaml.safe_dump(_plain(message), sort_keys=False, allow_unicode=True, width=_WIDE))


def _plain(value: Any) -> Any:
    if isinstance(value, (str, bool, int, float)):
        return value
    if isinstance(value, bytes):  # an octet
        return value[0]
    if hasattr(value, "get_fields_and_field_types"):
        return {name: _plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    first = value[:_MOST]
    shown = first.tolist() if hasattr(first, "tolist") else [_plain(one) for one in first]
    return shown if len(value) <= _MOST else [*shown, "..."]


def filled(kind: Any, values: Any, now: Any, where: str = "") -> Any:
    """Returns a message of the class ``kind`` with ``values``; other fields have their defaults.

    ``now`` is the message of the time that `now` stands for, and `auto` for a header. Raises ValueError with
    the path of a field that there is not, or whose value is of another type or range.
    """
    if not isinstance(values, Mapping):
        raise _no(where or "the message", values, f"mapping of the fields of {kind.__name__}")
    message, types = kind(), kind.get_fields_and_field_types()
    for name, value in values.items():
        path = f"{where}.{name}" if where else f"{name}"
        if name not in types:
            raise ValueError(f"{path}: {kind.__name__} has no such field, but {', '.join(types) or 'none'}")
        setattr(message, name, _value(types[name], value, now, path))
    return message


def _value(kind: str, value: Any, now: Any, where: str) -> Any:
    """The value for a field, by its type as ``get_fields_and_field_types`` has it."""
    found = LIST.fullmatch(kind)
    if found:
        return _list(found, value, now, where)
    if kind == "boolean":
        if not isinstance(value, bool):
            raise _no(where, value, "`true` or `false`")
        return value
    if kind == "octet":
        return bytes([_whole(value, 0, 255, where)])
    if kind in _LARGEST:
        return _float(value, _LARGEST[kind], where)
    if kind.startswith(("int", "uint")):
        bits = int(kind.lstrip("uint"))
        low, high = (0, (1 << bits) - 1) if kind[0] == "u" else (-(1 << bits - 1), (1 << bits - 1) - 1)
        return _whole(value, low, high, where)
    if kind.startswith(("string", "wstring")):
        return _text(value, kind.partition("<")[2].rstrip(">"), where)
    if kind == "builtin_interfaces/Time" and value == "now":
        return now
    if kind == "std_msgs/Header" and value == "auto":
        return message_class(kind)(stamp=now)
    return filled(message_class(kind), value, now, where)


def _list(found: Match[str], values: Any, now: Any, where: str) -> list[Any]:
    if not isinstance(values, list):
        raise _no(where, values, "list")
    count, bound = found["count"], found["bound"]
    if count and len(values) != int(count):
        raise ValueError(f"{where}: it has {count} elements, not {len(values)}")
    if bound and len(values) > int(bound):
        raise ValueError(f"{where}: it has at most {bound} elements, not {len(values)}")
    element = found["any"] or found["some"]
    return [_value(element, one, now, f"{where}[{place}]") for place, one in enumerate(values)]


def _whole(value: Any, low: int, high: int, where: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise _no(where, value, f"whole number from {low} to {high}")
    return value


def _float(value: Any, largest: float, where: str) -> float:
    """A number, or a text that is one: YAML takes 1e5 for a text."""
    try:
        if isinstance(value, bool):
            raise TypeError
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise _no(where, value, "number") from None
    if largest < abs(number) < math.inf:
        raise _no(where, value, f"number from {-largest:.4g} to {largest:.4g}")
    return number


def _text(value: Any, longest: str, where: str) -> str:
    if not isinstance(value, str):
        raise _no(where, value, "text, which quotes make of it")
    if longest and len(value) > int(longest):
        raise _no(where, value, f"text of at most {longest} characters")
    return value


def _no(where: str, value: Any, wanted: str) -> ValueError:
    return ValueError(f"{where}: {clipped(repr(value), _LONGEST)} is no {wanted}")
