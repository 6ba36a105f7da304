"""Every rule is hit by a whole spec of this folder, or by a test that the rulebook names."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import pytest

from swarmctl.rules.rulebook import RuleText, rulebook
from swarmctl.rules.runner import load_swarm
from tests.rules.specs import BROKEN, DOUBTFUL, specs_in

HERE = Path(__file__).parent
ENOUGH = 150
_SHOWN = re.compile(r"(tests/\S+\.py) shows it")


def layers() -> list[list[Path]]:
    """Every spec of the folders, with what is laid over it."""
    single = [[spec] for folder in (BROKEN, DOUBTFUL) for spec in specs_in(folder)]
    several = [
        [spec, *spec.parent.glob("field.yaml")]
        for spec in sorted((HERE / "several_files").glob("*/swarm.yaml"))
    ]
    return [*single, *several]


@cache
def results() -> Mapping[str, tuple[bool, frozenset[str]]]:
    """Of each spec whether it is refused, and the ids of what is found."""
    found = {str(spec[0]): load_swarm(*spec) for spec in layers()}
    return {
        name: (swarm is None, frozenset(one.code for one in problems))
        for name, (swarm, problems) in found.items()
    }


@pytest.mark.parametrize("rule", rulebook().values(), ids=lambda rule: rule.id)
def test_a_whole_spec_has_the_finding(rule: RuleText) -> None:
    elsewhere = _SHOWN.search(rule.shown)
    if elsewhere is None:
        assert any(rule.id in codes for _, codes in results().values())
    else:
        assert rule.id in (HERE.parents[1] / elsewhere[1]).read_text("utf-8")


def test_there_are_many_failing_specs(refused: list[str]) -> None:
    refused += [name for name, (wrong, _) in results().items() if wrong]
    assert len(refused) >= ENOUGH
