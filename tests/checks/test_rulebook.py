"""Every rule is explained, and every example of the book does what it says."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from swarmctl.checks.rulebook import RuleText, pitfalls, rulebook
from swarmctl.cli import exits
from swarmctl.cli.app import run
from swarmctl.views.rules import page

ROOT = Path(__file__).parents[2]
_ID = re.compile(r"[A-Z]{2,8}[0-9]{3}")


def ids_in_the_code() -> set[str]:
    """Every string of the program that is a rule's id."""
    found = set()
    for file in (ROOT / "swarmctl").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and _ID.fullmatch(node.value):
                found.add(node.value)
    return found


def test_every_rule_is_explained_and_every_explanation_has_a_rule() -> None:
    assert set(rulebook()) == ids_in_the_code()


@pytest.mark.parametrize("rule", rulebook().values(), ids=lambda rule: rule.id)
def test_a_rule_says_what_why_and_where_it_comes_from(
    rule: RuleText, capsys: pytest.CaptureFixture[str]
) -> None:
    assert rule.what.endswith(".")
    assert rule.why.endswith((".", ")"))
    assert rule.threads
    assert all(link.startswith("https://") for link in rule.links)
    assert (rule.fails is None) == (rule.passes is None) == bool(rule.shown)
    assert run(["explain", rule.id.lower()]) == exits.OK
    assert rule.what in capsys.readouterr().out


def test_pitfalls_name_rules_that_exist() -> None:
    numbers = [pitfall.number for pitfall in pitfalls()]
    assert numbers == sorted(set(numbers))
    for pitfall in pitfalls():
        assert set(pitfall.rules) <= set(rulebook()), pitfall
        assert pitfall.answer in ("rule", "generator", "vocabulary", "health", "not")
        assert bool(pitfall.rules) == (pitfall.answer == "rule") or pitfall.how, pitfall


def test_the_page_is_up_to_date() -> None:
    made = page(rulebook(), pitfalls())
    assert (ROOT / "docs/rules.md").read_text("utf-8") == made, "run `make generated`"
