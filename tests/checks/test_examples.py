"""Every example of the rulebook does what the book says: it fails, it passes, it can be silenced or not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from swarmctl.checks.check import check
from swarmctl.checks.rulebook import RuleText, example, rulebook
from swarmctl.render.host import bundles
from swarmctl.spec.diagnostics import Diagnostic, Severity, has_errors
from swarmctl.spec.load import Document, load
from swarmctl.topology.resolve import resolve

RULES = [rule for rule in rulebook().values() if rule.fails is not None]


def examined(*texts: str) -> tuple[Document | None, Sequence[Diagnostic]]:
    """What ``validate`` finds in the texts, each laid over those before."""
    files = {f"book/{number}.yaml": text for number, text in enumerate(texts)}
    document, found = load([Path(file) for file in files], read=lambda path: files[str(path)].encode())
    return (document, found) if document is None else (document, check(document, found))


def said(found: Sequence[Diagnostic]) -> set[tuple[str, Severity]]:
    return {(one.code, one.severity) for one in found}


def test_the_swarm_that_the_examples_change_is_right() -> None:
    assert examined(example())[1] == ()


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.id)
def test_what_fails_brings_this_finding_and_no_other_error(rule: RuleText) -> None:
    found = said(examined(example(), rule.fails or "")[1])
    assert (rule.id, rule.severity) in found
    assert {code for code, severity in found if severity is Severity.ERROR} <= {rule.id}


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.id)
def test_what_passes_brings_no_finding(rule: RuleText) -> None:
    document, found = examined(example(), rule.passes or "")
    assert document is not None
    assert not said(found)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.id)
def test_it_can_be_silenced_unless_it_is_firm(rule: RuleText) -> None:
    wish = f"silence: [{{rule: {rule.id}, reason: looked at}}]"
    document, found = examined(example(), rule.fails or "", wish)
    codes = {code for code, _ in said(found)}
    if rule.firm:
        assert document is None or rule.id in codes or "SIL004" in codes
        assert has_errors(found) or rule.severity is Severity.WARNING
        return
    assert rule.id not in codes
    assert not has_errors(found)
    assert document is not None
    swarm = resolve(document)
    made = bundles(swarm)
    for robot in swarm.robots.values():
        drivers = [host for host, one in made.items() for unit in one.units if unit.robot == robot.name]
        assert drivers == [robot.host], "one driver, where the robot's line begins"
