"""Every rule is hit by a whole spec of this folder, or by a test that the rulebook names."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from swarmctl.rules.rulebook import RuleText, rulebook
from swarmctl.rules.runner import load_swarm
from tests.rules.specs import BROKEN, DOUBTFUL, specs_in

HERE = Path(__file__).parent
ENOUGH = 150
_SHOWN = re.compile(r"(tests/\S+\.py) shows it")


@cache
def layers() -> list[list[Path]]:
    """Every spec of the folders, with what is laid over it."""
    single = [[spec] for folder in (BROKEN, DOUBTFUL) for spec in specs_in(folder)]
    several = [
        [spec, *spec.parent.glob("field.yaml")]
        for spec in sorted((HERE / "several_files").glob("*/swarm.yaml"))
    ]
    return [*single, *several]


@cache
def result(*files: Path) -> tuple[bool, frozenset[str]]:
    """Whether a spec is refused, and the ids of what is found."""
    swarm, problems = load_swarm(*files)
    return swarm is None, frozenset(one.code for one in problems)


@pytest.mark.parametrize("rule", rulebook().values(), ids=lambda rule: rule.id)
def test_a_whole_spec_has_the_finding(rule: RuleText) -> None:
    elsewhere = _SHOWN.search(rule.shown)
    if elsewhere is None:
        own_first = sorted(layers(), key=lambda files: rule.id not in str(files[0]))
        assert any(rule.id in result(*files)[1] for files in own_first)
    else:
        assert rule.id in (HERE.parents[1] / elsewhere[1]).read_text("utf-8")


def test_there_are_many_failing_specs(refused: list[str]) -> None:
    refused += [str(files[0]) for files in layers() if result(*files)[0]]
    assert len(refused) >= ENOUGH
