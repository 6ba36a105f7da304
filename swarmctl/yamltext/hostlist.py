"""Ranges as Slurm and pdsh write them: ``epuck-[01-06,08-20]`` is nineteen names. Pure text.

Numbers of a part are padded to the width of its first. A part may be repeated: ``[1-5,1-5]`` is ten names.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

MAX_ELEMENTS = 10_000
FORMS = "write numbers like [01-20], [01-06,08-20], or [1-5,1-5] to use each number twice"
_MAX_SHOWN = 8  # repetitions that a message writes out

_BRACKET = re.compile(r"([^\[\]]*)\[([^\[\]]*)\]([^\[\]]*)")
_LAST_NUMBER = re.compile(r"(.*?)([0-9]*)([^0-9]*)", re.DOTALL)
_PART = re.compile(r"([0-9]{1,9})(?:-([0-9]{1,9}))?", re.ASCII)
_MULTIPLIED = re.compile(r"([0-9]+(?:-[0-9]+)?)\*([0-9]+)", re.ASCII)


@dataclass(frozen=True)
class Range:
    """The text before and after the bracket, and the numbers in it, padded."""

    head: str
    numbers: tuple[str, ...]
    tail: str

    @property
    def names(self) -> tuple[str, ...]:
        """The names that the range expands to."""
        return tuple(f"{self.head}{number}{self.tail}" for number in self.numbers)

    def without(self, names: Collection[str]) -> str:
        """Returns the range as text without ``names``; empty if none is left."""
        kept = [number for number in self.numbers if f"{self.head}{number}{self.tail}" not in names]
        return f"{self.head}[{','.join(_parts(kept))}]{self.tail}" if kept else ""

    def exchanged(self, one: str, other: str) -> str:
        """Returns the range as text, with two of its names in each other's place; empty unless each is in
        it once."""
        names = list(self.names)
        if not names.count(one) == names.count(other) == 1:
            return ""
        first, second = names.index(one), names.index(other)
        numbers = list(self.numbers)
        numbers[first], numbers[second] = numbers[second], numbers[first]
        return f"{self.head}[{','.join(_parts(numbers))}]{self.tail}"

    def repeated(self, times: int) -> str:
        """Returns the range as text, repeated ``times`` times; empty if too long for a message."""
        return (
            f"{self.head}[{','.join([*_parts(self.numbers)] * times)}]{self.tail}"
            if times <= _MAX_SHOWN
            else ""
        )


@dataclass(frozen=True)
class NoRange:
    """Why a text with a bracket is not a range, and how to fix it. ``meant`` is likely the right text."""

    code: str
    message: str
    help: str
    meant: str = ""


def written(names: Iterable[str]) -> str:
    """Returns the names, those that differ by their last number as one range: ``ep-[01-06], k3``."""
    return ", ".join(text for text, _ in ranges_of(names))


def ranges_of(names: Iterable[str]) -> list[tuple[str, int]]:
    """Returns the ranges that ``written`` joins, each with its number of names."""
    ranges: dict[tuple[str, str, bool], list[str]] = {}  # `pi` is of no range with `pi2`
    for name in dict.fromkeys(names):
        head, number, tail = _LAST_NUMBER.fullmatch(name).groups()  # type: ignore[union-attr]  # any text matches
        ranges.setdefault((head, tail, True) if number else (name, "", False), []).append(number)
    return [
        (f"{head}{numbers[0]}{tail}", 1)
        if len(numbers) == 1
        else (f"{head}[{','.join(_parts(numbers))}]{tail}", len(numbers))
        for (head, tail, _), numbers in ranges.items()
    ]


def read(text: str) -> Range | NoRange | None:
    """Parses ``text``; None without a bracket, or for that of an IPv6 address or an escape sequence."""
    inside = text.partition("[")[2].partition("]")[0]
    if "[" not in text or ":" in inside or not text.isprintable():
        return None
    found = _BRACKET.fullmatch(text)
    if found is None:
        return _odd_brackets(text)
    head, inside, tail = found.groups()
    numbers: list[str] = []
    for part in inside.split(","):
        counted = _PART.fullmatch(part.strip())
        if counted is None:
            return _bad_part(part.strip(), inside)
        first, last = int(counted[1]), int(counted[2] or counted[1])
        if first > last:
            turned = f"{head}[{inside.replace(part.strip(), f'{counted[2]}-{counted[1]}')}]{tail}"
            return NoRange(
                "RANGE002", f"the range {part.strip()} runs backwards", f"write `{turned}`", turned
            )
        size = len(numbers) + last - first + 1
        if size > MAX_ELEMENTS:
            return NoRange(
                "RANGE003", f"this range has {size} elements", f"at most {MAX_ELEMENTS} are allowed"
            )
        width = len(counted[1])
        numbers += [f"{number:0{width}}" for number in range(first, last + 1)]
    return Range(head, tuple(numbers), tail)


def _bad_part(part: str, inside: str) -> NoRange:
    """The error for one part of a range, between commas, that is not a number or two."""
    multiplied = _MULTIPLIED.fullmatch(part)
    if multiplied is not None:
        times = int(multiplied[2]) if len(multiplied[2]) == 1 else 0
        instead = (
            ",".join([multiplied[1]] * times)
            if 0 < times <= _MAX_SHOWN
            else f"{multiplied[1]},{multiplied[1]}"
        )
        return NoRange("RANGE001", f"`{part}`: a range has no `*`", f"repeat the part instead: [{instead}]")
    message = f"`{part}` is not a range of numbers" if part else f"a number is missing in `[{inside}]`"
    return NoRange("RANGE001", message, FORMS)


def _odd_brackets(text: str) -> NoRange:
    if "[" in text.partition("]")[2]:
        return NoRange(
            "RANGE004",
            "one word has two ranges",
            "write one of them out, with an entry for each number",
        )
    if "]" not in text:
        return NoRange(
            "RANGE001", "this bracket is not closed", f"write it like `{text}]`, if it is a range", f"{text}]"
        )
    return NoRange("RANGE001", "these brackets do not make a range", FORMS)


def _parts(numbers: Sequence[str]) -> Iterator[str]:
    """Joins consecutive numbers of the same width into parts."""
    start = 0
    for index in range(1, len(numbers) + 1):
        if index < len(numbers) and _follows(numbers[index - 1], numbers[index], len(numbers[start])):
            continue
        first, last = numbers[start], numbers[index - 1]
        yield first if start == index - 1 else f"{first}-{last}"
        start = index


def _follows(number: str, following: str, width: int) -> bool:
    return following == f"{int(number) + 1:0{width}}"
