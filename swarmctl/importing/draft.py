"""A draft of a spec as values: each has its place in the lab's files, or the reason why it is a guess."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain
from typing import Any, TypeAlias

from swarmctl.ros_packages.launched import Place


@dataclass(frozen=True)
class Fact:
    """A value that a file has or, with a reason in ``guess``, one that is derived from it.

    ``was`` is what the file has, where it had to be converted.
    """

    value: Any
    place: Place | None = None
    guess: str = ""
    was: str = ""


@dataclass(frozen=True)
class Blank:
    """A value that no file has: an example, and what to write instead."""

    example: Any
    why: str


Field: TypeAlias = Fact | Blank


@dataclass(frozen=True)
class Entry:
    """A host, a robot or a program; ``notes`` name what is left out."""

    name: Fact
    fields: Mapping[str, Field] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """The name in the spec."""
        return str(self.name.value)

    def value(self, key: str) -> Any:
        """Returns the value of a field; None if it is to fill in or left out."""
        found = self.fields.get(key)
        return found.value if isinstance(found, Fact) else None


@dataclass(frozen=True)
class Unread:
    """A line, or a whole file, that is not in the draft, and why."""

    place: Place
    why: str


@dataclass(frozen=True)
class Draft:
    """A spec to be: ``first`` are the keys above the hosts, ``last`` those below the programs."""

    source: str
    name: Fact
    first: Mapping[str, Field] = field(default_factory=dict)
    hosts: tuple[Entry, ...] = ()
    robots: tuple[Entry, ...] = ()
    links: tuple[Field, ...] = ()
    programs: tuple[Entry, ...] = ()
    last: Mapping[str, Field] = field(default_factory=dict)
    unread: tuple[Unread, ...] = ()
    notes: tuple[str, ...] = ()  # about several entries

    def fields(self) -> Iterator[Field]:
        """Yields every value of the draft."""
        yield self.name
        yield from chain(self.first.values(), self.links, self.last.values())
        for entry in chain(self.hosts, self.robots, self.programs):
            yield entry.name
            yield from entry.fields.values()


@dataclass(frozen=True)
class Counts:
    """What a draft has, for its summary."""

    hosts: int
    robots: int
    programs: int
    guesses: int
    blanks: int
    unread: int

    def __str__(self) -> str:
        has = (_number(self.hosts, "host"), _number(self.robots, "robot"), _number(self.programs, "program"))
        todo = [_number(self.guesses, "guess", "guesses"), _number(self.blanks, "place") + " to fill in"]
        todo += [_number(self.unread, "place") + " not read"] if self.unread else []
        return f"{', '.join(has)}; {', '.join(todo)}"


def counts(draft: Draft, blanks: int = 0) -> Counts:
    """Counts a draft, with further ``blanks`` that checking its text found."""
    found = list(draft.fields())
    return Counts(
        len(draft.hosts),
        len(draft.robots),
        len(draft.programs),
        sum(isinstance(one, Fact) and bool(one.guess) for one in found),
        sum(isinstance(one, Blank) for one in found) + blanks + (not draft.hosts) + (not draft.robots),
        len(draft.unread),
    )


def _number(count: int, word: str, several: str = "") -> str:
    return f"{count} {word if count == 1 else several or word + 's'}"
