"""Substitution arguments of launch files, as far as their value is certain. Python is never evaluated."""

from __future__ import annotations

import re
from collections.abc import Mapping

_ARGUMENT = re.compile(r"\$\(([^()$]{0,200})\)")
#: What roslaunch replaces by the folder of a package.
FIND = re.compile(r"\$\(find [A-Za-z0-9_-]+\)", re.ASCII)
_LATER = {"env", "optenv", "anon"}  # known on the host only
_COMMANDS = ("find", "env", "optenv", "dirname", "anon", "arg")
_WORDS = {"true": True, "1": True, "false": False, "0": False}

Arguments = Mapping[str, str | None]  # None: declared, with a value that is not known here


class SubstitutionError(ValueError):
    """What roslaunch refuses. ``argument`` is the name of the argument that has no value."""

    def __init__(self, message: str, argument: str = "") -> None:
        super().__init__(message)
        self.argument = argument


def substituted(text: str, arguments: Arguments, dirname: str = "") -> str | None:
    """Returns ``text`` with the values of its arguments; None if the result is not known here.

    `$(find PACKAGE)` remains as it is, since only the host knows the path. Raises `SubstitutionError`.
    """
    if "$(" not in text:
        return text
    if text.startswith("$(eval ") and text.endswith(")"):
        return None
    certain, parts, end = True, list[str](), 0
    for match in _ARGUMENT.finditer(text):
        command, *rest = match[1].split() or [""]
        if command not in _COMMANDS:
            raise SubstitutionError(f"`$({command} ...)` is not a substitution of roslaunch")
        value = _value(command, rest, arguments, dirname) if command not in _LATER else None
        certain = certain and value is not None
        parts += [text[end : match.start()], value or ""]
        end = match.end()
    return "".join((*parts, text[end:])) if certain else None


def _value(command: str, rest: list[str], arguments: Arguments, dirname: str) -> str | None:
    if command == "dirname":
        return dirname or None
    if len(rest) != 1:
        raise SubstitutionError(f"`$({command} ...)` has one name")
    if command == "find":
        return f"$(find {rest[0]})"
    if rest[0] not in arguments:
        raise SubstitutionError(f"the argument `{rest[0]}` has no value", rest[0])
    return arguments[rest[0]]


def unknown_part(text: str, arguments: Arguments, reasons: Mapping[str, str]) -> str:
    """Returns the substitution that keeps ``text`` from being known; ``reasons`` are those of arguments."""
    if text.startswith("$(eval "):
        return "$(eval)"
    for match in _ARGUMENT.finditer(text):
        command, name = [*match[1].split(), "", ""][:2]
        if command == "arg" and arguments.get(name) is None:
            return reasons.get(name, match[0])
        if command in _LATER:
            return f"$({command} {name})"
    return "a value that is too long"


def is_true(value: str | None) -> bool | None:
    """Returns the meaning of an `if` or `unless`; None if it is not known. Raises `SubstitutionError`."""
    if value is None:
        return None
    if value.strip().lower() not in _WORDS:
        raise SubstitutionError("the value of `if` and `unless` is true, false, 1 or 0")
    return _WORDS[value.strip().lower()]
