"""Settings of emulators and faults: values from texts or YAML, checked against their types."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

SWITCHES = {
    "true": True,
    "yes": True,
    "on": True,
    "1": True,
    "false": False,
    "no": False,
    "off": False,
    "0": False,
}
KINDS: dict[type, str] = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}


def number_or_switch(kind: type, value: Any) -> Any:
    """Returns ``value``, possibly a text, as ``kind`` (bool, int, float or str). Raises ``ValueError``."""
    if kind is str:
        return str(value)
    if kind is bool:
        if (text := str(value).lower()) not in SWITCHES:
            raise ValueError(f"{value!r} is neither true nor false")
        return SWITCHES[text]
    if isinstance(value, bool) or (kind is int and isinstance(value, float)):
        raise ValueError(f"{value!r} is not {KINDS[kind]}")
    return kind(value)


def setting_value(kinds: Mapping[str, type], name: str, value: Any) -> Any:
    """Returns ``value`` as the type of setting ``name``. Raises ``ValueError`` with what to write instead."""
    if name not in kinds:
        raise unknown("setting", name, kinds)
    try:
        return number_or_switch(kinds[name], value)
    except (ValueError, TypeError):
        raise ValueError(f"setting {name!r} is {KINDS[kinds[name]]}, not {value!r}") from None


def unknown(noun: str, name: str, known: Iterable[str]) -> ValueError:
    """Returns the error for a name that does not exist, with the closest and all known names."""
    names = list(known)
    near = difflib.get_close_matches(name, names, 1)
    meant = f"; did you mean {near[0]!r}?" if near else "."
    return ValueError(f"unknown {noun} {name!r}{meant} There are: {', '.join(names)}")
