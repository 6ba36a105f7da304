"""The grammar of a selection such as ``ep-*,!ep-07`` or ``@lab&type:epuck2``. Pure text; knows no names.

A comma adds, ``&`` keeps what is in both, ``!`` takes away; ``!`` binds tightest, then ``&``, then the comma.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn, TypeAlias

from swarmctl.suggest import did_you_mean
from swarmctl.yamltext import hostlist

PREFIXES = ("host", "robot", "program", "type", "island", "mode")
OTHER_PREFIXES = {"group": "@", "label": "@", "tag": "@", "hosts": "host:", "robots": "robot:"}
_MOST_NESTED = 8
_MOST_STARS = 8  # of one word
_MOST_NAMES = 100_000  # that the ranges of one selection write out

_OPERATOR = re.compile(r"[*?@&!,():]")
_BRACKETS = re.compile(r"\[[^\[\]]*\]")
_BLANKS = re.compile(r"\s*")
_WORD = re.compile(r"(?:\[[^\[\]]*\]?|[^\s,&!()\[])+")
_PREFIX = re.compile(r"(@|[a-z]+:)?(.*)", re.DOTALL)
_NAME = re.compile(r"[A-Za-z0-9_.*?-]+", re.ASCII)


class SelectionError(Exception):
    """What is wrong between two columns of a selection, counted from 0, and what to write instead.

    ``code`` is the rule; ``number`` is the index of the selection in a list of them, ``inside`` the group or
    island that has it, such as ``@lab``; ``meant`` is what probably belongs between the columns, or empty.
    """

    def __init__(self, message: str, start: int, end: int, *help_lines: str, code: str = "SEL001") -> None:
        super().__init__(message)
        self.message, self.start, self.end = message, start, end
        self.help_lines, self.code = help_lines, code
        self.number, self.inside, self.meant = 0, "", ""
        self.steps: frozenset[str] = frozenset()  # of groups that contain each other


@dataclass(frozen=True)
class Word:
    """One word: its text, its prefix (``@``, ``host``, ... or none), and the names or globs that it means.

    A range has several; ``start`` and ``end`` are its columns.
    """

    text: str
    prefix: str
    names: tuple[str, ...]
    start: int
    end: int


@dataclass(frozen=True)
class Without:
    """Everything but this; after a comma, it is taken away from what stands before."""

    part: Part


@dataclass(frozen=True)
class Both:
    """What all of the parts have in common."""

    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Either:
    """What one of the parts has, from left to right."""

    parts: tuple[Part, ...]


Part: TypeAlias = Word | Without | Both | Either


def is_selection(text: str) -> bool:
    """True for a text that is more than a name or a range of names."""
    return _OPERATOR.search(_BRACKETS.sub("", text)) is not None


def is_glob(name: str) -> bool:
    """True for a pattern of several names."""
    return "*" in name or "?" in name


def parse(text: str) -> Either:
    """Returns what a selection means. Raises ``SelectionError``."""
    reader = _Reader(text)
    found = reader.either(0)
    if reader.next:  # a bracket that nothing opened
        reader.fail("nothing opens this parenthesis", help_line="remove it")
    return found


def words_in(text: str) -> tuple[Word, ...]:
    """Returns the words of a selection; none of one that is wrong."""
    try:
        return tuple(_words(parse(text)))
    except SelectionError:
        return ()


def _words(part: Part) -> Iterator[Word]:
    if isinstance(part, Word):
        yield part
    elif isinstance(part, Without):
        yield from _words(part.part)
    else:
        for one in part.parts:
            yield from _words(one)


class _Reader:
    """Reads a selection from left to right; ``at`` is the column of the next character."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self._left = _MOST_NAMES
        self._skip_blanks()

    @property
    def next(self) -> str:
        """The next character; empty at the end."""
        return self.text[self.at : self.at + 1]

    def fail(self, message: str, length: int = 1, *, help_line: str) -> NoReturn:
        """Raises the error about the next ``length`` characters."""
        raise SelectionError(message, self.at, self.at + length, help_line)

    def _skip_blanks(self) -> None:
        self.at = _BLANKS.match(self.text, self.at).end()  # type: ignore[union-attr]

    def _step(self) -> None:
        self.at += 1
        self._skip_blanks()

    def either(self, depth: int) -> Either:
        parts = [self._both(depth)]
        while self.next == ",":
            self._step()
            parts.append(self._both(depth))
        if self.next not in ("", ")"):
            self.fail("a comma is missing here", help_line="write `a,b` for both, `a&b` for what is in both")
        return Either(tuple(parts))

    def _both(self, depth: int) -> Part:
        start = self.at
        parts = [self._part(depth)]
        while self.next == "&":
            self._step()
            parts.append(self._part(depth))
        if len(parts) == 1:
            return parts[0]
        if isinstance(parts[0], Without):
            raise SelectionError(
                "this can be read in two ways", start, self.at, "write `b&!a`, or `!(a&b)` with parentheses"
            )
        return Both(tuple(parts))

    def _part(self, depth: int) -> Part:
        if self.next == "!":
            self._step()
            if self.next == "!":
                self.fail("there are two `!`", help_line="write one of them, or none")
            return Without(self._part(depth))
        if self.next != "(":
            return self._word()
        if depth == _MOST_NESTED:
            self.fail("parentheses are nested too deep here", help_line="put a part into a group")
        opened = self.at
        self._step()
        found = self.either(depth + 1)
        if self.next != ")":
            raise SelectionError(
                "this parenthesis is not closed", opened, opened + 1, f"write it like `{self.text})`"
            )
        self._step()
        return found

    def _word(self) -> Word:
        found = _WORD.match(self.text, self.at)
        if found is None:
            where = f"before `{self.next}`" if self.next else "at the end"
            self.fail(f"a name is missing {where}", help_line="write a name, or remove what joins it")
        word, start = found[0], self.at
        prefix, name = _PREFIX.fullmatch(word).groups(default="")  # type: ignore[union-attr]
        prefix = prefix.rstrip(":")
        if prefix not in ("", "@", *PREFIXES):
            self.fail(f"there is no prefix `{prefix}:`", len(word), help_line=_other_prefix(prefix, name))
        names = self._names(word, name)
        self.at = found.end()
        self._skip_blanks()
        return Word(word, prefix, names, start, found.end())

    def _names(self, word: str, name: str) -> tuple[str, ...]:
        if not name:
            self.fail(f"a name is missing after `{word}`", len(word), help_line=f"write it like `{word}lab`")
        found = hostlist.read(name)
        if isinstance(found, hostlist.NoRange):
            self.fail(found.message, len(word), help_line=found.help)
        self._left -= len(found.numbers) if found else 1
        if self._left < 0:
            self.fail(f"this has more than {_MOST_NAMES} names", len(word), help_line="write globs instead")
        names = (name,) if found is None else found.names
        if not all(map(_NAME.fullmatch, names[:1])):
            self.fail(f"`{word}` is not a name", len(word), help_line=_other_form(word))
        if name.count("*") > _MOST_STARS:
            self.fail(f"`{word}` has more than {_MOST_STARS} asterisks", len(word), help_line="write fewer")
        return names


def _other_prefix(prefix: str, name: str) -> str:
    if prefix in OTHER_PREFIXES:
        return f"write `{OTHER_PREFIXES[prefix]}{name}`"
    known = [f"{one}:" for one in PREFIXES]
    return did_you_mean(f"{prefix}:", known, "prefixes")[0]


def _other_form(word: str) -> str:
    key, equals, value = word.partition("=")
    if equals and key in (*PREFIXES, *OTHER_PREFIXES):
        return f"write `{OTHER_PREFIXES.get(key, f'{key}:')}{value}`"
    return "write names, globs like `ep-*`, ranges like `ep-[1-6]`, `@lab` or `type:epuck2`"
