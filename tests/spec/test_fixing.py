"""What can be mended is mended in the user's own text, and nothing that was right gets worse."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.checks.check import look
from swarmctl.checks.fixing import Findings, Fixed, Stage, Texts, fixed
from swarmctl.spec.diagnostics import Diagnostic, Edit, Fix, Span, has_errors

FIXABLE = Path(__file__).parent / "fixable"
BROKEN = Path(__file__).parent / "broken"
EXAMPLE = (Path(__file__).parents[2] / "examples/paper-leader/swarm.yaml").read_text("utf-8")
SPEC = Path("swarm.yaml")


def look_at(text: str) -> Callable[[Texts], Findings]:
    return lambda texts: look([SPEC], lambda _: texts.get("swarm.yaml", text).encode())


def mended(text: str) -> str:
    """``text`` with all its fixes."""
    return fixed(look_at(text), lambda _: text).texts.get("swarm.yaml", text)


@pytest.mark.parametrize(
    "spec",
    [file for file in sorted(FIXABLE.glob("*.yaml")) if not file.stem.endswith(".fixed")],
    ids=lambda spec: spec.stem,
)
def test_a_spec_is_mended_and_only_that(spec: Path, golden: Callable[[Path, str], None]) -> None:
    text = spec.read_bytes().decode("utf-8-sig")
    done = mended(text)
    golden(spec.with_suffix(".fixed.yaml"), done.replace("\r\n", "\n"))
    assert ("\r" in text) == ("\r" in done)
    after = look_at(done)({})
    assert not has_errors(after.diagnostics)
    assert mended(done) == done
    for line in text.splitlines():  # every comment is where it was, or its line is gone
        note = line.partition("#")[2]
        assert note in done or "hub:" in line


# Fixes that are offered but not made: each would bring another error, such as a robot on another host's line.
TRADES = ("island-hub-elsewhere", "robot-off-the-island-leader")


@pytest.mark.parametrize("spec", sorted(BROKEN.glob("*.yaml")), ids=lambda spec: spec.stem)
def test_no_fix_makes_a_broken_spec_worse(spec: Path) -> None:
    try:
        text = spec.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError:
        return
    before = look_at(text)({})
    after = look_at(mended(text))({})
    assert after.stage >= before.stage
    assert len(after.diagnostics) <= len(before.diagnostics) or after.stage > before.stage
    offered = {(found.code, found.message) for found in before.diagnostics if found.fix}
    left = {(found.code, found.message) for found in after.diagnostics}
    assert bool(offered & left) == (spec.stem in TRADES)


def test_what_is_written_once_for_many_is_not_changed_for_one() -> None:
    text = EXAMPLE.replace(
        "  k3: {type: khepera3, host: k3-pi}", '  "k3-[1-2]": {type: khepera, host: k3-pi}'
    )
    (found, *_) = [one for one in look_at(text)({}).diagnostics if one.code == "REF001"]
    assert (found.message, found.fix) == ("there is no robot type called `khepera`", None)


words = st.sampled_from(
    ["koala", "hosts", "kind", "yes", "K3_Pi", "12", "hub", '"', *"[]{}", ", ", ": ", "- ", "\n", "# ", "*a"]
)  # fmt: skip
cuts = st.tuples(st.integers(0, len(EXAMPLE)), st.integers(0, 9), words)


@settings(max_examples=200, deadline=5000)
@given(st.lists(cuts, min_size=1, max_size=4))
def test_whatever_stands_in_a_spec_fixing_ends_and_makes_nothing_worse(
    changes: list[tuple[int, int, str]],
) -> None:
    text = EXAMPLE
    for place, length, word in changes:
        text = text[:place] + word + text[place + length :]
    before, after = look_at(text)({}), look_at(mended(text))({})
    assert after.stage >= before.stage


def finding(message: str, line: int, start: int, end: int, text: str) -> Diagnostic:
    """A finding whose fix writes ``text`` over some columns of one line."""
    edit = Edit(Span("swarm.yaml", line, start, line, end), text)
    return Diagnostic("T001", message, edit.span, fix=Fix(message, (edit,)))


def run(text: str, judge: Callable[[str], tuple[Diagnostic, ...]]) -> tuple[str, Fixed]:
    """Fix ``text`` by what ``judge`` finds in it."""
    done = fixed(lambda texts: Findings(Stage.SENSE, judge(texts.get("swarm.yaml", text))), lambda _: text)
    return done.texts.get("swarm.yaml", text), done


def test_fixes_of_the_same_text_are_made_one_after_the_other() -> None:
    first, second = finding("first", 1, 1, 3, "A"), finding("second", 1, 2, 4, "B")

    def judge(text: str) -> tuple[Diagnostic, ...]:
        return {"abcd": (first, second), "Acd": (finding("second", 1, 2, 3, "B"),)}.get(text, ())

    text, done = run("abcd", judge)
    assert text == "ABd"
    assert [found.message for found in done.made] == ["first", "second"]


def test_a_fix_that_does_harm_is_left_out_and_the_others_are_made() -> None:
    good, bad = finding("good", 1, 1, 2, "A"), finding("bad", 2, 1, 2, "B")

    def judge(text: str) -> tuple[Diagnostic, ...]:
        wrong = (Diagnostic("T002", "new"), Diagnostic("T003", "new")) if "B" in text else (bad,)
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
