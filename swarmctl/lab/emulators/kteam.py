"""Parses the lines of K-Team's Koalas: a capital letter, then decimal numbers between commas."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

NUMBER = re.compile(r"[+-]?[0-9]{1,10}")

Handlers = Mapping[str, tuple[int, Callable[..., bytes]]]  # by letter: the count of numbers, and the function


def answered(handlers: Handlers, line: str, refusal: bytes) -> bytes:
    """Returns the reply to a line; ``refusal`` if letter, count or numbers are wrong."""
    letter, *fields = line.split(",")
    if letter not in handlers:
        return refusal
    arity, handler = handlers[letter]
    if len(fields) != arity or not all(NUMBER.fullmatch(field) for field in fields):
        return refusal
    return handler(*map(int, fields))
