"""Every rule is hit by a whole spec of this folder, or by a test that the rulebook names."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from swarmctl.rulebook import RuleText, rulebook
from tests.loading import load_swarm
from tests.rules.specs import BROKEN, DOUBTFUL, specs_in

HERE = Path(__file__).parent
_RULE = re.compile(r"^\w+\[(\w+)\]:", re.MULTILINE)
_SHOWN = re.compile(r"(tests/\S+\.py) shows it")


@cache
def found_ids() -> frozenset[str]:
    """The ids of all findings: those of one file as their golden messages have them (test_broken.py)."""
    messages = (spec.with_suffix(".txt") for folder in (BROKEN, DOUBTFUL) for spec in specs_in(folder))
    single = {rule for file in messages for rule in _RULE.findall(file.read_text("utf-8"))}
    several = (
        load_swarm(spec, *spec.parent.glob("field.yaml"))[1]
        for spec in sorted((HERE / "several_files").glob("*/swarm.yaml"))
    )
    return frozenset(single | {one.code for findings in several for one in findings})


@pytest.mark.parametrize("rule", rulebook().values(), ids=lambda rule: rule.id)
def test_a_whole_spec_has_the_finding(rule: RuleText) -> None:
    elsewhere = _SHOWN.search(rule.shown)
    if elsewhere is None:
        assert rule.id in found_ids()
    else:
        assert rule.id in (HERE.parents[1] / elsewhere[1]).read_text("utf-8")
