"""Writes plain YAML quickly: the same bytes as PyYAML's emitter, for data of names, words and numbers only.

A swarm of 10 000 robots has millions of these. Anything that needs quotes is left to PyYAML.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

WIDTH = 110  # columns; behind them a list on one line goes on in the next
_STEP = 2  # columns of indentation
_PLAIN = re.compile(
    r"(?!(?:yes|no|true|false|on|off|null)\Z|deg\(|rad\()(?:\.\./|<)?"
    r"[a-z_/][a-z0-9_/.()<>-]*(?: [a-z0-9_/.()<>]+)*"
    r"|[0-9]+(?:\.[0-9]+){3}",  # an IPv4 address
    re.ASCII | re.IGNORECASE,
)
_LONGEST_KEY = 100  # letters; PyYAML writes a key of 128 in another form
_DECIMAL = re.compile(r"-?[0-9]+\.[0-9]+")


class NotPlainError(ValueError):
    """The data has something that needs quotes, or another form than plain YAML."""


def written(data: Mapping[str, Any]) -> str:
    """Returns a mapping with an entry on each line, and lists and mappings of scalars on one line.

    Raises ``NotPlainError`` for data that only PyYAML writes.
    """
    return "".join(_mapping(data, 0))


def _mapping(data: Mapping[str, Any], indent: int) -> Iterator[str]:
    for key, value in data.items():
        start = f"{' ' * indent}{_key(key)}:"
        if _is_block(value):
            yield f"{start}\n"
            below = indent if isinstance(value, (list, tuple)) else indent + _STEP
            yield from _block(value, below)
        else:
            yield f"{start} {_inline(value, len(start) + 1, indent + _STEP)}\n"


def _sequence(items: Sequence[Any], indent: int) -> Iterator[str]:
    start = f"{' ' * indent}- "
    for item in items:
        if _is_block(item):
            lines = _block(item, indent + _STEP)
            yield start + next(lines)[len(start) :]
            yield from lines
        else:
            yield f"{start}{_inline(item, len(start), indent + _STEP)}\n"


def _is_block(value: Any) -> bool:
    """True for a list or a mapping with another one in it."""
    if isinstance(value, dict):
        value = value.values()
    elif not isinstance(value, (list, tuple)):
        return False
    for one in value:  # noqa: SIM110  # a third of the time of any() and a generator
        if isinstance(one, (dict, list, tuple)):
            return True
    return False


def _block(value: Any, indent: int) -> Iterator[str]:
    return _mapping(value, indent) if isinstance(value, dict) else _sequence(value, indent)


def _inline(value: Any, column: int, indent: int) -> str:
    """A scalar, or a list or mapping of scalars, from ``column`` on; what does not fit goes to ``indent``."""
    if isinstance(value, dict):
        return _flow([(f"{_key(key)}: ", one) for key, one in value.items()], "{}", column, indent)
    if isinstance(value, (list, tuple)):
        return _flow([("", one) for one in value], "[]", column, indent)
    return _fitting(value, column)


def _flow(items: Sequence[tuple[str, Any]], brackets: str, column: int, indent: int) -> str:
    text, column = brackets[0], column + 1
    for number, (key, value) in enumerate(items):
        if number:
            text, column = f"{text},", column + 1
        if column > WIDTH:
            text, column = f"{text}\n{' ' * indent}", indent
        elif number:
            text, column = f"{text} ", column + 1
        scalar = _fitting(value, column + len(key))
        text, column = f"{text}{key}{scalar}", column + len(key) + len(scalar)
    return text + brackets[1]


def _fitting(value: Any, column: int) -> str:
    """The text of a scalar at ``column``; PyYAML would break words that go on behind the width."""
    text = _scalar(value) if type(value) is not str else _text(value)
    if column + len(text) > WIDTH and " " in text:
        raise NotPlainError
    return text


def _key(key: Any) -> str:
    if type(key) is not str or not key or len(key) > _LONGEST_KEY:
        raise NotPlainError
    return _text(key)


@lru_cache(maxsize=1 << 14)
def _text(text: str) -> str:
    if not text:
        return "''"
    if not _PLAIN.fullmatch(text):
        raise NotPlainError
    return text


def _scalar(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if type(value) is int:
        return str(value)
    if type(value) is float and _DECIMAL.fullmatch(text := repr(value)):
        return text
    raise NotPlainError
