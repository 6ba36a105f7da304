"""Ranges as Slurm and pdsh write them: ``epuck-[01-06,08-20]`` is nineteen names. Pure text.

The numbers of a part are as wide as its first. ``[1-5*4]`` is each of 1 to 5 four times over: four robots on
each of five hosts.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

MAX_ELEMENTS = 10_000
FORMS = "write numbers like [01-20], [01-06,08-20], or [1-5*4] for each of them four times"

_BRACKET = re.compile(r"([^\[\]]*)\[([^\[\]]*)\]([^\[\]]*)")
_PART = re.compile(r"([0-9]{1,9})(?:-([0-9]{1,9}))?(?:\*([0-9]{1,9}))?", re.ASCII)


@dataclass(frozen=True)
class Range:
    """What stands before and after the bracket, and the numbers in it as they are written out."""

    head: str
    numbers: tuple[str, ...]
    tail: str

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"{self.head}{number}{self.tail}" for number in self.numbers)

    def without(self, names: Collection[str]) -> str:
        """The same range as text, with ``names`` left out; nothing where none is left."""
        kept = [number for number in self.numbers if f"{self.head}{number}{self.tail}" not in names]
        return f"{self.head}[{','.join(_parts(kept))}]{self.tail}" if kept else ""

    def repeated(self, times: int) -> str:
        """The same range as text, each of its numbers ``times`` over."""
        return f"{self.head}[{','.join(f'{part}*{times}' for part in _parts(self.numbers))}]{self.tail}"


@dataclass(frozen=True)
class NoRange:
    """Why a text with a bracket is no range, and how to mend it."""

    code: str
    message: str
    help: str


def read(text: str) -> Range | NoRange | None:
    """The range that ``text`` is; nothing without a bracket, or with one of an address or an escape."""
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
            what = (
                f"`{part.strip()}` is no range of numbers" if part.strip() else f"`[{inside}]` lacks a number"
            )
            return NoRange("RANGE001", what, FORMS)
        first, last, times = int(counted[1]), int(counted[2] or counted[1]), int(counted[3] or 1)
        if first > last:
            turned = f"{head}[{inside.replace(part.strip(), f'{counted[2]}-{counted[1]}')}]{tail}"
            return NoRange("RANGE002", f"the range {part.strip()} runs backwards", f"write `{turned}`")
        size = len(numbers) + (last - first + 1) * times
        if size > MAX_ELEMENTS:
            return NoRange("RANGE003", f"this range has {size} elements", f"{MAX_ELEMENTS} are the most")
        width = len(counted[1])
        numbers += [f"{number:0{width}}" for number in range(first, last + 1) for _ in range(times)]
    if not numbers:
        return NoRange("RANGE001", f"the range {inside} counts nothing", FORMS)
    return Range(head, tuple(numbers), tail)


def _odd_brackets(text: str) -> NoRange:
    if "[" in text.partition("]")[2]:
        return NoRange(
            "RANGE004",
            "two ranges stand in one word",
            "write one of them out: an entry for each of its numbers",
        )
    if "]" not in text:
        return NoRange("RANGE001", "this bracket is not closed", f"write it like `{text}]`, if it is a range")
    return NoRange("RANGE001", "these brackets do not make a range", FORMS)


def _parts(numbers: Sequence[str]) -> Iterator[str]:
    """Numbers as few parts: what follows on each other in the same width is one."""
    start = 0
    for index in range(1, len(numbers) + 1):
        if index < len(numbers) and _follows(numbers[index - 1], numbers[index], len(numbers[start])):
            continue
        first, last = numbers[start], numbers[index - 1]
        yield first if start == index - 1 else f"{first}-{last}"
        start = index


def _follows(number: str, following: str, width: int) -> bool:
    return following == f"{int(number) + 1:0{width}}"
