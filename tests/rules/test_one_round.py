"""All faults of a spec show at once, and nothing that is only a consequence of another finding."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from itertools import combinations
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.diagnostics import Diagnostic
from swarmctl.rules.runner import lint_files
from swarmctl.spec.load import load
from tests import ROOT
from tests.rules.faults import Fault, faults_of, with_faults
from tests.timing import work_at_most

CASES = sorted(folder for folder in (Path(__file__).parent / "one_round").iterdir() if folder.is_dir())
EXAMPLES = sorted((ROOT / "examples").glob("*/swarm.yaml"))
FAULTS = 18  # of each example, which are combined
EACH = 25  # combinations of each example
TOGETHER = 3

Found = frozenset[tuple[str, int, str]]  # code, line and message


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_independent_faults_show_at_once(
    case: Path,
    golden: Callable[[Path, str], None],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.chdir(case)
    overlay = ["-f", "field.yaml"] if Path("field.yaml").exists() else []
    assert run(["validate", "swarm.yaml", *overlay]) == exit_codes.ERROR
    golden(case / "message.txt", capsys.readouterr().err.replace(f"{case}/", ""))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_is_repaired_for_checking_is_no_document(case: Path) -> None:
    assert load([case / "swarm.yaml"])[0] is None


@pytest.mark.slow
def test_faults_of_different_places_show_together_as_they_do_alone(
    note: Callable[[str, str, str], None],
) -> None:
    """Of the findings that each fault causes alone, 95 % are there with the other faults; none is added."""
    chosen = random.Random(7)
    wanted = missed = added = 0
    for spec in EXAMPLES:
        text = spec.read_text("utf-8")
        alone = {fault: brief(found) for fault, found in findings_alone(spec).items()}
        faults = [one for one, found in alone.items() if found]
        combined = [some for some in combinations(faults, TOGETHER) if independent(some, alone)]
        for some in chosen.sample(combined, EACH):
            expected = frozenset[tuple[str, int, str]]().union(*(alone[one] for one in some))
            shown = brief(findings(spec, with_faults(text, some)))
            wanted += len(expected)
            missed += len(expected - shown)
            added += len(shown - expected)
    note("findings of combined faults: shown", f"{1 - missed / wanted:.1%} of {wanted}", "95 %")
    note("findings of combined faults: added", str(added), "0")
    assert missed <= 0.05 * wanted
    assert added == 0


@cache
def findings_alone(spec: Path) -> Mapping[Fault, tuple[Diagnostic, ...]]:
    """What each of some faults of a spec causes alone."""
    text = spec.read_text("utf-8")
    some = random.Random(7).sample(list(faults_of(text)), FAULTS)
    return {one: findings(spec, with_faults(text, [one])) for one in some}


def findings(spec: Path, text: str) -> tuple[Diagnostic, ...]:
    """What is found in a spec with another text."""
    return lint_files([spec], lambda path: text.encode() if path == spec else path.read_bytes()).diagnostics


def brief(found: Iterable[Diagnostic]) -> Found:
    """Findings without counts of further places."""
    return frozenset(
        (one.code, one.span.line if one.span else 0, re.sub(r" and [0-9]+ more|[0-9]+ %", "", one.message))
        for one in found
    )


def independent(some: Sequence[Fault], alone: Mapping[Fault, Found]) -> bool:
    """True if no fault changes a line that another one changes or is found in, or writes its name."""
    return all(
        one.line != other.line
        and one.text not in other.loc
        and all(line != other.line + 1 for _, line, _ in alone[one])
        for one in some
        for other in some
        if one is not other
    )


def test_a_file_that_cannot_be_read_may_define_any_name(tmp_path: Path) -> None:
    spec = tmp_path / "swarm.yaml"
    text = (ROOT / "examples/paper-leader/swarm.yaml").read_text("utf-8")
    spec.write_text("include: more.yaml\n" + text.replace("leader: koala-laptop", "leader: other"), "utf-8")
    assert [one.code for one in lint_files([spec]).diagnostics] == ["FILE001"]


@pytest.mark.parametrize(
    ("entries", "references"),
    [
        (lambda: "".join(f"  r{one}: {{type: zz{one}, host: hh{one}}}\n" for one in range(10_000)), 700),
        (lambda: "".join(f"  r{one}: {{tpe: koala, hst: laptop}}\n" for one in range(10_000)), 400),
        (lambda: "".join(f"  r{one}: {{type: koala, zz: 1}}\n" for one in range(190)), 150),
    ],
    ids=["names", "keys", "repairs"],
)
def test_many_errors_cost_little(entries: Callable[[], str], references: int) -> None:
    text = (
        "version: 1\nname: lab\nmode: leader\nleader: laptop\n"
        "hosts:\n  laptop: {address: 10.0.0.1}\n" + "robots:\n" + entries()
    )
    path = Path("swarm.yaml")
    with work_at_most(references):
        assert lint_files([path], lambda _: text.encode()).diagnostics


def test_words_that_stand_in_for_wrong_ones_are_not_shown() -> None:
    for spec in EXAMPLES:
        for fault, found in findings_alone(spec).items():
            assert "standin" not in str(found), fault
