"""The attribute `condition` of package.xml (format 3, REP 149), for ROS 1. Pure text."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterator, Mapping

#: What every host has; any other variable but _OF_THE_HOST is not set there, so it is empty.
VARIABLES: Mapping[str, str] = {"ROS_VERSION": "1", "ROS_PYTHON_VERSION": "3"}
_OF_THE_HOST = "$ROS_DISTRO"
_TOKEN = re.compile(r"""\s*(?:(\(|\)|==|!=|<=|>=|<|>)|"([^"]*)"|'([^']*)'|([\w$.-]+))""")
_COMPARE: Mapping[str, Callable[[str, str], bool]] = {
    "==": operator.eq, "!=": operator.ne, "<=": operator.le, ">=": operator.ge, "<": operator.lt,
    ">": operator.gt,
}  # fmt: skip
_DEEPEST = 20  # parentheses


def holds(condition: str) -> bool:
    """Returns whether ``condition`` is met.

    One that REP 149 does not allow, or that depends on the distribution of ROS, counts as met.
    """
    try:
        tokens = _Tokens(condition)
        met = _any_of(tokens, 0)
        return met or not tokens.at_end
    except ValueError:
        return True


class _Tokens:
    """The words of a condition, each as its text and whether it stands in quotes."""

    def __init__(self, text: str) -> None:
        self._rest = list(_tokens(text.rstrip()))[::-1]

    @property
    def at_end(self) -> bool:
        return not self._rest

    def take(self) -> tuple[str, bool]:
        if not self._rest:
            raise ValueError("the condition ends too early")
        return self._rest.pop()

    def skip(self, word: str) -> bool:
        """Takes the next word if it is ``word``, without quotes; returns whether it was."""
        found = bool(self._rest) and self._rest[-1] == (word, False)
        if found:
            self._rest.pop()
        return found


def _tokens(text: str) -> Iterator[tuple[str, bool]]:
    at = 0
    while at < len(text):
        found = _TOKEN.match(text, at)
        if found is None:
            raise ValueError("not a condition")
        quoted = found[2] if found[2] is not None else found[3]
        yield (quoted, True) if quoted is not None else (found[1] or found[4], False)
        at = found.end()


def _any_of(tokens: _Tokens, depth: int) -> bool:
    met = _all_of(tokens, depth)
    while tokens.skip("or"):
        met = _all_of(tokens, depth) or met
    return met


def _all_of(tokens: _Tokens, depth: int) -> bool:
    met = _one(tokens, depth)
    while tokens.skip("and"):
        met = _one(tokens, depth) and met
    return met


def _one(tokens: _Tokens, depth: int) -> bool:
    if depth < _DEEPEST and tokens.skip("("):
        met = _any_of(tokens, depth + 1)
        if not tokens.skip(")"):
            raise ValueError("a parenthesis is open")
        return met
    left, (symbol, quoted), right = _value(tokens), tokens.take(), _value(tokens)
    if quoted or symbol not in _COMPARE:
        raise ValueError("no comparison")
    return _COMPARE[symbol](left, right)


def _value(tokens: _Tokens) -> str:
    text, quoted = tokens.take()
    if not quoted and (text in _COMPARE or text in "()" or text == _OF_THE_HOST):
        raise ValueError("no value, or one that is not known")
    return VARIABLES.get(text[1:], "") if not quoted and text.startswith("$") else text
