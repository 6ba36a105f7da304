"""What people get wrong is found, at its line, and no fix that is called certain makes another swarm of it.

`python -m tests.mutations` prints the rates, and every defect that passes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest

from tests.mutations.accepted import Accepted, accepted
from tests.mutations.defects import bases, defects
from tests.mutations.judge import Outcome, Verdict, clean, judged

MOST = 2  # defects of one mistake in one file
LEAST = 500  # defects of all bases
BASES = {base.name: base for base in bases()}


@cache
def verdicts(name: str) -> tuple[Verdict, ...]:
    return tuple(judged(one) for one in defects(BASES[name], MOST))


def shown(some: list[Verdict]) -> str:
    return "\n".join(f"{one.defect}: {', '.join(found.message for found in one.found[:2])}" for one in some)


@pytest.mark.parametrize("name", BASES)
def test_the_unchanged_spec_has_no_finding(name: str) -> None:
    assert not clean(BASES[name])


def test_there_are_many_defects() -> None:
    assert sum(1 for base in BASES.values() for _ in defects(base, MOST)) >= LEAST


@pytest.mark.parametrize("name", BASES)
def test_every_defect_is_found_or_its_passing_has_a_reason(
    name: str, note: Callable[[str, str, str], None]
) -> None:
    missed = [one for one in verdicts(name) if not one.found]
    rate = 1 - len(missed) / len(verdicts(name))
    note(f"defects found in {name}", f"{rate:.1%} of {len(verdicts(name))}", "all, or with a reason")
    assert not (left := [one for one in missed if not accepted(Accepted.PASSES, one.defect)]), shown(left)


@pytest.mark.parametrize("name", BASES)
def test_a_finding_is_where_the_defect_is(name: str, note: Callable[[str, str, str], None]) -> None:
    found = [one for one in verdicts(name) if one.found]
    elsewhere = [one for one in found if not one.at_the_line]
    left = [one for one in elsewhere if not accepted(Accepted.ELSEWHERE, one.defect)]
    note(f"at the right line in {name}", f"{1 - len(elsewhere) / len(found):.1%}", "all, or with a reason")
    assert not (left := [one for one in elsewhere if not accepted(Accepted.ELSEWHERE, one.defect)]), shown(
        left
    )


@pytest.mark.parametrize("name", BASES)
def test_a_certain_fix_makes_no_other_swarm(name: str, note: Callable[[str, str, str], None]) -> None:
    outcomes = [one.after for one in verdicts(name)]
    repaired = outcomes.count(Outcome.ORIGINAL) + outcomes.count(Outcome.EQUAL)
    note(f"repaired by --fix in {name}", f"{repaired / len(outcomes):.1%}", "no other swarm")
    other = [one for one in verdicts(name) if one.after is Outcome.OTHER]
    assert not (left := [one for one in other if not accepted(Accepted.OTHER_SWARM, one.defect)]), shown(left)
