"""No finding about what is right."""

from __future__ import annotations

import pytest

from tests.mutations.benign import BENIGN
from tests.mutations.defects import bases, defects
from tests.mutations.judge import clean, lint

pytestmark = pytest.mark.slow
MOST = 2  # edits of one kind in one file
BASES = {base.name: base for base in bases()}
LEAST = 500  # edits of all bases


def test_there_are_many_edits() -> None:
    assert sum(1 for base in BASES.values() for _ in defects(base, MOST, BENIGN)) >= LEAST


@pytest.mark.parametrize("name", BASES)
def test_no_benign_edit_has_a_finding(name: str) -> None:
    before = {(one.code, one.message) for one in clean(BASES[name])}
    found = [
        f"{edit}: {one.code}: {one.message}"
        for edit in defects(BASES[name], MOST, BENIGN)
        for one in lint(BASES[name], {str(edit.file.path): edit.change.text}).diagnostics
        if (one.code, one.message) not in before
    ]
    assert not found
