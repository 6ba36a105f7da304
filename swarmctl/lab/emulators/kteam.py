"""How K-Team's Koalas take a line apart: a capital letter, then decimal numbers between commas."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

NUMBER = re.compile(r"[+-]?[0-9]{1,10}")

Handlers = Mapping[str, tuple[int, Callable[..., bytes]]]  # by letter: how many numbers, and who takes them


def answered(handlers: Handlers, line: str, refusal: bytes) -> bytes:
    """The reply to one line; ``refusal`` if letter, count or numbers are wrong."""
    letter, *fields = line.split(",")
    if letter not in handlers:
        return refusal
    arity, handler = handlers[letter]
    if len(fields) != arity or not all(NUMBER.fullmatch(field) for field in fields):
        return refusal
    return handler(*map(int, fields))
