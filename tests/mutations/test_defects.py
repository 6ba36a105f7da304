"""What people get wrong is found, at its line, and no fix that is called certain makes another swarm of it.

`python -m tests.mutations` prints the rates, and every defect that passes.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.mutations.accepted import Accepted, accepted
from tests.mutations.defects import bases, defects
from tests.mutations.judge import Outcome, Verdict, clean, judged

pytestmark = pytest.mark.slow
MOST = 1  # defects of one mistake in one file
LEAST = 500  # defects of all bases
BASES = {base.name: base for base in bases()}


def unaccepted(what: Accepted, verdicts: list[Verdict]) -> list[str]:
    """Returns those without a reason in `accepted.yaml`, with what is found."""
    left = [one for one in verdicts if not accepted(what, one.defect)]
    return [f"{one.defect}: {', '.join(found.message for found in one.found[:2])}" for one in left]


def share(some: list[Verdict], all_: list[Verdict]) -> str:
    return f"{len(some) / len(all_):.1%} of {len(all_)}"


@pytest.mark.parametrize("name", BASES)
def test_the_unchanged_spec_has_no_finding(name: str) -> None:
    assert not clean(BASES[name])


def test_there_are_many_defects() -> None:
    assert sum(1 for base in BASES.values() for _ in defects(base, MOST)) >= LEAST


@pytest.mark.parametrize("name", BASES)
def test_every_defect_is_found_and_no_certain_fix_is_wrong(
    name: str, note: Callable[[str, str, str], None]
) -> None:
    verdicts = [judged(one) for one in defects(BASES[name], MOST)]
    found = [one for one in verdicts if one.found]
    repaired = [one for one in verdicts if one.after in (Outcome.ORIGINAL, Outcome.EQUAL)]
    elsewhere = [one for one in found if not one.at_the_line]
    note(f"defects found in {name}", share(found, verdicts), "all, or with a reason")
    note(f"at another line in {name}", share(elsewhere, found), "none, or with a reason")
    note(f"repaired by --fix in {name}", share(repaired, verdicts), "no other swarm")
    missed = [one for one in verdicts if not one.found]
    others = [one for one in verdicts if one.after is Outcome.OTHER]
    assert not unaccepted(Accepted.PASSES, missed)
    assert not unaccepted(Accepted.ELSEWHERE, elsewhere)
    assert not unaccepted(Accepted.OTHER_SWARM, others)
