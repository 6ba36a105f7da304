"""Findings as values: a stable code, a position, a message and a fix."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from swarmctl.rulebook import Severity, rulebook

_DIGITS = re.compile("[0-9]+")


@dataclass(frozen=True, order=True)
class Span:
    """A stretch of one file. Lines and columns count from 1, columns in characters; the end is exclusive."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"

    def overlaps(self, other: Span) -> bool:
        """Returns True if both have a character of one file, or begin at the same place."""
        first, second = sorted((self, other))
        start = (second.line, second.column)
        within = start == (first.line, first.column) or start < (first.end_line, first.end_column)
        return first.file == second.file and within


@dataclass(frozen=True)
class Note:
    """A second place that belongs to a diagnostic, and what it has to do with it."""

    span: Span
    text: str


def note_of_other(other: Span, span: Span) -> tuple[Note, ...]:
    """Returns the note for the second of two places; none if it is the place of the diagnostic itself."""
    return (Note(other, "the other one"),) if other != span else ()


@dataclass(frozen=True)
class Edit:
    """What stands in ``span`` becomes ``text``; a span whose end is its start inserts.

    In a range it changes several entries at once, and is right only if all of these ``copies`` need it.
    """

    span: Span
    text: str
    copies: int = 1


@dataclass(frozen=True)
class Fix:
    """A fix that a program can apply: edits that belong together, and a title.

    It is ``safe`` if the text has one possible meaning: then the fix changes nothing that anybody intended,
    and nothing that a node does. Any other fix is a guess, and a person decides.
    """

    title: str
    edits: tuple[Edit, ...]
    safe: bool


@dataclass(frozen=True)
class Diagnostic:
    """One finding. ``label`` stands under the underlined text; each ``help`` is one way to fix it.

    Of a ``secret`` no view shows what stands in ``span``.
    """

    code: str
    message: str
    span: Span | None = None
    severity: Severity = field(init=False)
    label: str = ""
    notes: tuple[Note, ...] = ()
    help: tuple[str, ...] = ()
    fix: Fix | None = None
    secret: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "severity", rulebook()[self.code].severity)

    def to_json(self) -> dict[str, Any]:
        """Returns the finding as JSON data, without its secret."""
        found = asdict(self) | {"severity": self.severity.value}
        del found["secret"]  # it holds no text of the file
        for edit in found["fix"]["edits"] if found["fix"] else ():
            del edit["copies"]
        return found


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Returns True if one of the diagnostics is an error."""
    return any(diagnostic.severity is Severity.ERROR for diagnostic in diagnostics)


def drop_redundant_warnings(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """What is wrong at a place makes a warning about the same place idle."""
    diagnostics = list(diagnostics)
    wrong = {found.span for found in diagnostics if found.severity is Severity.ERROR}
    ends = {(span.file, span.end_line, span.end_column) for span in wrong if span}

    def is_redundant(span: Span | None) -> bool:
        if span in wrong or span is None or (span.line, span.column) != (span.end_line, span.end_column):
            return span in wrong
        # nothing is written there: it is about the key before it
        return any((span.file, span.line, span.column - blanks) in ends for blanks in (0, 1))

    return [
        found for found in diagnostics if found.severity is Severity.ERROR or not is_redundant(found.span)
    ]


def apart_from(known: Iterable[Diagnostic], found: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """Yields what is ``found`` at no place of a ``known`` error."""
    places: dict[tuple[str, int], list[Span]] = {}
    for span in {one.span for one in known if one.severity is Severity.ERROR}:
        if span is not None:
            places.setdefault((span.file, span.line), []).append(span)
    for one in found:
        span = one.span
        if span is None or not any(span.overlaps(place) for place in places.get((span.file, span.line), ())):
            yield one


def in_order(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """By file, line and column; those without a place first; the same finding only once.

    Equal findings about the elements of a range become one, with a count of the others.
    """
    nowhere = Span("", 0, 0, 0, 0)
    unique = Counter(diagnostics)
    alike: dict[tuple[object, ...], list[Diagnostic]] = {}
    for found in unique:
        alike.setdefault((found.span or found, found.code, _DIGITS.sub("", found.message)), []).append(found)
    merged = [_for_all(group, sum(unique[one] for one in group)) for group in alike.values()]
    return tuple(sorted(merged, key=lambda found: (found.span or nowhere, found.code, found.message)))


def _for_all(group: list[Diagnostic], count: int) -> Diagnostic:
    """Returns one finding for those at one place; its fix has to correct all entries written there."""
    first, *others = group
    if first.fix is not None:
        alike = all(one.fix == first.fix for one in others)
        all_wrong = max(edit.copies for edit in first.fix.edits) <= count
        edits = tuple(replace(edit, copies=1) for edit in first.fix.edits)
        first = replace(first, fix=replace(first.fix, edits=edits) if alike and all_wrong else None)
    if not others:
        return first
    return replace(first, help=(*first.help, f"{len(others)} more here have the same problem"))
