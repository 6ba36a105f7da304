"""Every example of the rulebook fails, passes or can be ignored as documented."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from swarmctl.diagnostics import Diagnostic, has_errors
from swarmctl.linter.runner import lint
from swarmctl.render.build_bundle import bundles
from swarmctl.rulebook import RuleText, Severity, example, rulebook
from swarmctl.spec.load import Document, load
from swarmctl.swarm import names
from swarmctl.swarm.resolve import resolve

RULES = [rule for rule in rulebook().values() if rule.fails is not None]


def examined(*texts: str) -> tuple[Document | None, Sequence[Diagnostic]]:
    """What ``validate`` finds in the texts, each laid over those before."""
    files = {f"book/{number}.yaml": text for number, text in enumerate(texts)}

    def read(path: Path) -> bytes:
        if str(path) not in files:  # of the keystore
            raise FileNotFoundError(path)
        return files[str(path)].encode()

    document, found = load([Path(file) for file in files], read=read)
    return (document, found) if document is None else (document, lint(document, found))


def summary(found: Sequence[Diagnostic]) -> set[tuple[str, Severity]]:
    return {(one.code, one.severity) for one in found}


def test_the_swarm_that_the_examples_change_is_right() -> None:
    assert examined(example())[1] == ()


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.id)
def test_examples_fail_pass_and_are_ignored_as_documented(rule: RuleText) -> None:
    failing = summary(examined(example(), rule.fails or "")[1])
    assert (rule.id, rule.severity) in failing
    assert {code for code, severity in failing if severity is Severity.ERROR} <= {rule.id}
    document, found = examined(example(), rule.passes or "")
    assert document is not None
    assert not summary(found)
    ignored(rule)


def ignored(rule: RuleText) -> None:
    """A firm rule cannot be ignored; any other can, and the swarm is rendered."""
    ignore = f"ignore: [{{rule: {rule.id}, reason: looked at}}]"
    document, found = examined(example(), rule.fails or "", ignore)
    codes = {code for code, _ in summary(found)}
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
        name = names.unit(swarm.name, robot.name)
        drivers = [host for host, one in made.items() for unit in one.units if unit.name == name]
        assert drivers == [robot.host], "one driver, where the robot's line begins"
