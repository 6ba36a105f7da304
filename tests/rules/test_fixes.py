"""Fixes edit the user's own text and never break what was right."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.diagnostics import Diagnostic, Edit, Fix, Span, has_errors
from swarmctl.linter.fixes import Findings, Fixed, Stage, Texts, fixable
from tests import ROOT
from tests.loading import lint_files
from tests.rules.specs import BROKEN, specs_in
from tests.timing import work_at_most

FIXABLE = Path(__file__).parent / "fixable"
EXAMPLE = (ROOT / "examples/paper-leader/swarm.yaml").read_text("utf-8")
SPEC = Path("swarm.yaml")


def lint_with(text: str) -> Callable[[Texts], Findings]:
    return lambda texts: lint_files([SPEC], lambda _: texts.get("swarm.yaml", text).encode())


def fixed(text: str) -> str:
    """``text`` with all its fixes, safe or not."""
    return fixable(lint_with(text), lambda _: text).all.texts.get("swarm.yaml", text)


@pytest.mark.parametrize(
    "spec",
    [file for file in sorted(FIXABLE.glob("*.yaml")) if not file.stem.endswith(".fixed")],
    ids=lambda spec: spec.stem,
)
def test_a_fix_changes_only_the_faulty_text(spec: Path, golden: Callable[[Path, str], None]) -> None:
    text = spec.read_bytes().decode("utf-8-sig")
    done = fixed(text)
    golden(spec.with_suffix(".fixed.yaml"), done.replace("\r\n", "\n"))
    assert ("\r" in text) == ("\r" in done)
    after = lint_with(done)({})
    assert not has_errors(after.diagnostics)
    assert fixed(done) == done
    for line in text.splitlines():  # every comment is where it was, or its line is gone
        note = line.partition("#")[2]
        assert note in done or "hub:" in line


@pytest.mark.parametrize("spec", specs_in(BROKEN), ids=lambda spec: spec.stem)
def test_no_fix_makes_a_broken_spec_worse(spec: Path) -> None:
    try:
        text = spec.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError:
        return
    before = lint_with(text)({})
    offered = {(found.code, found.message) for found in before.diagnostics if found.fix}
    after = lint_with(fixed(text))({}) if offered else before
    assert after.stage >= before.stage
    assert len(after.diagnostics) <= len(before.diagnostics) or after.stage > before.stage
    left = {(found.code, found.message) for found in after.diagnostics}
    assert offered.isdisjoint(left)


RANGE = """version: 1
name: lab
mode: central
hub: laptop
hosts:
  laptop: {address: 10.0.0.1}
  "pi-[1-2]": {address: "10.0.0.[2-3]"}
robots:
  "k3-[1-2]": {type: khepera3, host: "pi-[1-2]", optional: true}
links:
  - {kind: wlan, name: lab, hosts: [laptop, "pi-[1-2]"], subnet: 10.0.0.0/24}
  - {kind: serial, host: "pi-[1-2]", robot: "k3-[1-2]", usb: {serial: "A[1-2]"}}
"""


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("khepera3", "kheperra3"),
        ("optional: true", "optional: yes"),
        ("optional", "optionl"),
        ("kind: serial", "kind: seral"),
        ("serial, host", "serial, hots"),
        ("usb", '"usb"'),
    ],
)
def test_what_is_wrong_for_a_whole_range_is_corrected_in_it(right: str, wrong: str) -> None:
    assert not has_errors(lint_with(RANGE)({}).diagnostics)
    text = RANGE.replace(right, wrong)
    done = fixable(lint_with(text), lambda _: text).safe.texts.get("swarm.yaml", text)
    assert done in (RANGE, text if '"usb"' in wrong else RANGE)


def test_a_range_is_not_changed_for_one_element() -> None:
    text = RANGE.replace('"pi-[1-2]": {', '"pi-[1,3]": {', 1).replace(
        '[laptop, "pi-[1-2]"]', '[laptop, "pi-[1,3]"]'
    )
    wrong = [one for one in lint_with(text)({}).diagnostics if one.code == "REF001"]
    assert {one.message for one in wrong} == {"unknown host `pi-2`"}
    assert fixed(text) == text


words = st.sampled_from(
    ["koala", "hosts", "kind", "yes", "K3_Pi", "12", "hub", '"', *"[]{}", ", ", ": ", "- ", "\n", "# ", "*a"]
)  # fmt: skip
cuts = st.tuples(st.integers(0, len(EXAMPLE)), st.integers(0, 9), words)


@settings(max_examples=200)
@given(st.lists(cuts, min_size=1, max_size=4))
def test_fixing_ends_and_makes_no_spec_worse(
    changes: list[tuple[int, int, str]],
) -> None:
    text = EXAMPLE
    for place, length, word in changes:
        text = text[:place] + word + text[place + length :]
    with work_at_most(150):
        before, after = lint_with(text)({}), lint_with(fixed(text))({})
    assert after.stage >= before.stage


def finding(message: str, line: int, start: int, end: int, text: str, *, safe: bool = True) -> Diagnostic:
    """A finding whose fix writes ``text`` over some columns of one line."""
    edit = Edit(Span("swarm.yaml", line, start, line, end), text)
    return Diagnostic("NET001", message, edit.span, fix=Fix(message, (edit,), safe))


def run(text: str, judge: Callable[[str], tuple[Diagnostic, ...]]) -> tuple[str, Fixed]:
    """Fix ``text`` by what ``judge`` finds in it."""
    done = fixable(
        lambda texts: Findings(Stage.RULES, judge(texts.get("swarm.yaml", text))), lambda _: text
    ).safe
    return done.texts.get("swarm.yaml", text), done


def test_fixes_of_the_same_text_are_made_one_after_the_other() -> None:
    first, second = finding("first", 1, 1, 3, "A"), finding("second", 1, 2, 4, "B")

    def judge(text: str) -> tuple[Diagnostic, ...]:
        return {"abcd": (first, second), "Acd": (finding("second", 1, 2, 3, "B"),)}.get(text, ())

    text, done = run("abcd", judge)
    assert text == "ABd"
    assert [found.message for found in done.made] == ["first", "second"]


def test_a_harmful_fix_is_left_out_and_the_others_applied() -> None:
    good, bad = finding("good", 1, 1, 2, "A"), finding("bad", 2, 1, 2, "B")

    def judge(text: str) -> tuple[Diagnostic, ...]:
        wrong = (Diagnostic("NET002", "new"), Diagnostic("NET003", "new")) if "B" in text else (bad,)
        return wrong if text.startswith("A") else (good, *wrong)

    text, done = run("a\nb\n", judge)
    assert text == "A\nb\n"
    assert done.made == (good,)


def test_two_entries_added_at_one_place_are_both_added() -> None:
    def judge(text: str) -> tuple[Diagnostic, ...]:
        end = len(text)
        return tuple(finding(word, 1, end, end, f", {word}") for word in "bc" if word not in text)

    text, _ = run("[a]", judge)
    assert text == "[a, b, c]"


def test_fixes_that_call_each_other_up_end() -> None:
    text, done = run(
        "a", lambda text: (finding("one", 1, 1, 2, "b"),) if text == "a" else (finding("two", 1, 1, 2, "a"),)
    )
    assert (text, done.made) == ("a", ())


def test_a_guess_is_left_to_unsafe_fixes() -> None:
    sure, guess = finding("sure", 1, 1, 2, "A"), finding("guess", 1, 2, 3, "B", safe=False)

    def judge(texts: Texts) -> Findings:
        text = texts.get("swarm.yaml", "ab")
        return Findings(
            Stage.RULES, tuple(one for one in (sure, guess) if one.fix and one.fix.edits[0].text not in text)
        )

    found = fixable(judge, lambda _: "ab")
    assert (found.safe.texts, found.safe.made) == ({"swarm.yaml": "Ab"}, (sure,))
    assert found.all.texts == {"swarm.yaml": "AB"}


def test_one_fix_that_fails_keeps_no_other_back() -> None:
    """More good fixes than rounds, beside one that makes the spec worse."""
    text = "abcdefghijklmnopqrst"
    fixes = [finding(letter, 1, place + 1, place + 2, letter.upper()) for place, letter in enumerate(text)]

    def judge(text: str) -> tuple[Diagnostic, ...]:
        left = tuple(one for one in fixes if one.message in text)
        return (*left, *(Diagnostic("NET002", f"new {number}") for number in range(30) if "K" in text))

    done, _ = run(text, judge)
    assert done == text.upper().replace("K", "k")
