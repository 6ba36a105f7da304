"""Ten mistakes in ten lines of one file show in one run, and nothing that follows from one of them."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import pytest

from swarmctl.diagnostics import Diagnostic
from tests.mutations.defects import Base, bases, defects
from tests.mutations.judge import clean, lint

pytestmark = pytest.mark.slow
TOGETHER, TRIALS, LEAST = 10, 3, 0.9  # of the rest, one mistake hides or explains another
_HIDES_ALL = ("YAML0", "FILE", "INC", "SPEC006")


class Mistake(NamedTuple):
    """What one line becomes, and what is found then."""

    line: str
    found: frozenset[tuple[str, str]]
    lines: frozenset[int]


def found_in(base: Base, text: str) -> list[Diagnostic]:
    known = {(one.code, one.message) for one in clean(base)}
    found = lint(base, {str(base.files[0].path): text}).diagnostics
    return [one for one in found if (one.code, one.message) not in known]


def mistakes(base: Base) -> Iterator[tuple[int, Mistake]]:
    """Yields those that change one line of the first file, by its number, and that hide no others."""
    lines = base.files[0].text.split("\n")
    for one in defects(base, most=1):
        changed = one.change.text.split("\n")
        places = [at for at, both in enumerate(zip(lines, changed, strict=False)) if both[0] != both[1]]
        if one.file is base.files[0] and len(changed) == len(lines) and len(places) == 1:
            found = found_in(base, one.change.text)
            if found and not any(finding.code.startswith(_HIDES_ALL) for finding in found):
                messages = frozenset((finding.code, finding.message) for finding in found)
                spans = frozenset(finding.span.line for finding in found if finding.span)
                yield places[0], Mistake(changed[places[0]], messages, spans)


def trials(made: list[tuple[int, Mistake]]) -> Iterator[Mapping[int, Mistake]]:
    chance = random.Random(7)
    for _ in range(TRIALS):
        mixed = dict(chance.sample(made, len(made)))
        yield dict(list(mixed.items())[:TOGETHER])


def test_ten_mistakes_show_in_one_run(note: Callable[[str, str, str], None]) -> None:
    shown, count = 0, 0
    for base in bases():
        lines = base.files[0].text.split("\n")
        for chosen in trials(list(mistakes(base))):
            text = "\n".join(chosen[at].line if at in chosen else line for at, line in enumerate(lines))
            found = found_in(base, text)
            messages = {(one.code, one.message) for one in found}
            at = {one.span.line for one in found if one.span}
            count += len(chosen)
            shown += sum(bool(one.found & messages) or number + 1 in at for number, one in chosen.items())
            expected = {line + 1 for line in chosen}.union(*(one.lines for one in chosen.values()))
            alone = set().union(*(one.found for one in chosen.values()))  # may stand at its next mention here
            others = {one.span.line for one in found if one.span and (one.code, one.message) not in alone}
            assert others <= expected, f"{others - expected} in {text}"
    note("of ten mistakes in ten lines, found in one run", f"{shown / count:.1%} of {count}", f"{LEAST:.0%}")
    assert shown >= count * LEAST
