"""Regular expressions that a driver matches in a time that grows with the line, whatever a robot sends.

A part that may take more or less of a line never stands before one that could take the same characters, and
only single characters are repeated: so there is one way to match a line, and none is tried again and again.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_ESCAPE = r"\\(?:[dDwWsS]|[!-/:-@\[-`{-~])"
_ATOM = (
    rf"\[\^?(?:{_ESCAPE}|-(?!-)|[ -,./0-9:-@A-Za-z^_`{{}}])+\]|{_ESCAPE}|[ -#%-'\--/0-9,:->@A-Z\]_`a-z}}~]|\."
)
_TOKEN = re.compile(
    rf"(?P<group>[()])|(?P<end>\$\Z)|(?P<atom>{_ATOM})(?P<count>(?:[*+?]|\{{[0-9]{{1,3}}(?:,[0-9]{{0,3}})?\}})\??)?"
)
_CHARACTERS = [chr(code) for code in range(128)]  # a driver reads lines as ASCII


@dataclass(frozen=True)
class _Part:
    """A piece of an expression that takes characters of ``takes``."""

    text: str
    takes: frozenset[str]
    varies: bool
    optional: bool


def bounded(pattern: str) -> str:
    """Returns ``pattern`` if matching it takes linear time; raises ValueError with the reason if not."""
    try:
        parts = list(_parts(pattern))
        re.compile(pattern)
    except re.error as error:
        raise ValueError(f"`{pattern}` is not a regular expression: {error}") from None
    for number, part in enumerate(parts):
        for after in _followers(parts[number + 1 :]) if part.varies else ():
            if part.takes & after.takes:
                raise ValueError(
                    f"`{part.text}` may take what is meant for `{after.text}`, and trying each way can hold "
                    "up a robot; begin what follows with a character that the first does not take"
                )
    return pattern


def groups_of(pattern: str) -> list[frozenset[str]]:
    """Returns the characters that each group of a bounded ``pattern`` can take, in the order they open."""
    groups: list[set[str]] = []
    inside: list[set[str]] = []
    for token in _TOKEN.finditer(pattern):
        if token["group"] == "(":
            groups.append(set())
            inside.append(groups[-1])
        elif token["group"]:
            inside.pop()
        for group in inside if token["atom"] else ():
            group.update(_taken(token["atom"]))
    return [frozenset(group) for group in groups]


def _taken(atom: str) -> frozenset[str]:
    one = re.compile(atom, re.ASCII)
    return frozenset(each for each in _CHARACTERS if one.fullmatch(each))


def _parts(pattern: str) -> Iterator[_Part]:
    at = 0
    while at < len(pattern):
        token = _TOKEN.match(pattern, at)
        if token is None:
            raise ValueError(
                f"`{pattern[at:]}` is more than a driver understands; write characters, classes like [0-9], "
                "a group ( ) around each value, and + * ? {2} behind a character or a class"
            )
        at = token.end()
        atom, count = token["atom"], token["count"] or ""
        if atom:
            fixed = re.fullmatch(r"(\{[0-9]+\}\??)?", count) is not None
            yield _Part(
                atom + count, _taken(atom), not fixed, count[:1] in ("*", "?") or count.startswith("{0")
            )


def _followers(parts: list[_Part]) -> Iterator[_Part]:
    """What may come right behind: all up to the first that must."""
    for part in parts:
        yield part
        if not part.optional:
            return
