"""Every rule has an explanation, and every example in the rulebook behaves as documented."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from pathlib import Path

import pytest
import yaml

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.diagnostics import Diagnostic
from swarmctl.linter.runner import RULES
from swarmctl.rulebook import FOLDER, RuleText, Severity, pitfalls, rulebook
from swarmctl.views.rules import page
from tests import ROOT

_ID = re.compile(r"[A-Z]{2,8}[0-9]{3}")
#: A thread is an issue, or a message or question at a site where people write to each other.
_THREAD = re.compile(
    r"[\w.-]+/[\w.-]+#[0-9]+"
    r"|https://\S+/(issues|pull|discussions|questions?|t|viewtopic\.php|msg[0-9]+\.html)([/?]\S+)?"
)


def ids_in_the_code() -> set[str]:
    """Every string of the program that is a rule's id."""
    found = set()
    package = ROOT / "swarmctl"
    for file in package.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and _ID.fullmatch(node.value):
                found.add(node.value)
    return found


def ids_in(texts: Path) -> set[str]:
    return set(yaml.safe_load(texts.read_text("utf-8"))["rules"])


def test_every_rule_has_a_text_and_every_text_a_rule() -> None:
    assert set(rulebook()) == ids_in_the_code()


def test_a_finding_has_the_severity_of_its_rule() -> None:
    assert {one.severity for one in rulebook().values()} == set(Severity)
    assert all(Diagnostic(id_, "").severity is rule.severity for id_, rule in rulebook().items())


def test_a_rule_stands_beside_its_text() -> None:
    texts = {(one.stem, id_) for one in FOLDER.glob("*.yaml") for id_ in ids_in(one)}
    functions = {(one.find.__module__.split(".")[-1], id_) for one in RULES for id_ in one.ids}
    assert functions - texts == set(), "no entry in the YAML file of the function's family"
    families = {family for family, _ in functions}
    assert {one for one in texts - functions if one[0] in families} == set(), "no function beside the YAML"


@pytest.mark.parametrize("rule", rulebook().values(), ids=lambda rule: rule.id)
def test_a_rule_has_what_and_why(rule: RuleText, capsys: pytest.CaptureFixture[str]) -> None:
    assert rule.what.endswith(".")
    assert rule.why.endswith((".", ")"))
    assert (rule.fails is None) == (rule.passes is None) == bool(rule.shown)
    assert run(["explain", rule.id.lower()]) == exit_codes.OK
    assert rule.what in capsys.readouterr().out


def defect_of(threads: Sequence[str], manuals: Sequence[str], *, own: bool) -> str:
    """What is wrong with the grounds of a rule; empty if nothing is."""
    if not threads and not manuals and not own:
        return "neither a thread nor a manual, and not marked `own`"
    if own and (threads or manuals):
        return "marked `own`, and cites something"
    if wrong := [one for one in threads if not _THREAD.fullmatch(one)]:
        return f"not a thread: {wrong}"
    if wrong := [one for one in manuals if _THREAD.fullmatch(one) or not one.startswith("https://")]:
        return f"not a manual: {wrong}"
    return ""


@pytest.mark.parametrize("rule", rulebook().values(), ids=lambda rule: rule.id)
def test_a_rule_cites_a_thread_or_is_marked_manual(rule: RuleText) -> None:
    assert defect_of(rule.threads, rule.manuals, own=rule.own) == ""


@pytest.mark.parametrize(
    ("threads", "manuals", "own"),
    [
        ((), (), False),
        (("ros/ros_comm#1",), (), True),
        ((), ("https://wiki.ros.org/Names",), True),
        (("https://wiki.ros.org/Names",), (), False),
        ((), ("https://github.com/ros/ros_comm/issues/1",), False),
        ((), ("ros/ros_comm#1",), False),
    ],
)
def test_wrong_grounds_are_refused(threads: Sequence[str], manuals: Sequence[str], own: bool) -> None:
    assert defect_of(threads, manuals, own=own)


@pytest.mark.parametrize(
    ("id_", "shown"),
    [
        (
            "NET001",
            ["Met in:", "github.com/ros/ros_comm/issues/144", "Manual:", "wiki.ros.org/ROS/NetworkSetup"],
        ),
        ("MODE007", ["This format's own rule."]),
        ("PKG009", ["Met in:"]),
    ],
)
def test_explain_shows_threads_and_manuals(
    id_: str, shown: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["explain", id_]) == exit_codes.OK
    text = capsys.readouterr().out
    assert [one for one in shown if one not in text] == []
    assert {"Met in:", "Manual:"} & set(shown) == {one for one in ("Met in:", "Manual:") if one in text}


def test_pitfalls_name_rules_that_exist() -> None:
    numbers = [pitfall.number for pitfall in pitfalls()]
    assert numbers == sorted(set(numbers))
    for pitfall in pitfalls():
        assert set(pitfall.rules) <= set(rulebook()), pitfall
        assert pitfall.answer in ("rule", "generator", "format", "health", "none")
        assert bool(pitfall.rules) == (pitfall.answer == "rule") or pitfall.how, pitfall


def test_the_page_has_every_rule_and_links_to_its_headings() -> None:
    made = page(rulebook(), pitfalls())
    headings = {
        re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-") for one in re.findall("^#+ (.+)$", made, re.M)
    }
    assert {one.lower() for one in rulebook()} <= headings
    assert set(re.findall(r"\]\(#([^)]+)\)", made)) <= headings
