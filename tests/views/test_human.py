"""Findings on a terminal: word for word, in colour or not, wide or narrow, the caret under its text."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.views.findings import human
from swarmctl.views.findings.human import cells, marked, view
from swarmctl.views.findings.report import Checked
from tests.views import sample_findings as sample

HERE = Path(__file__).parent
WIDE = "日本語🤖"
source_lines = st.text(st.characters(categories=("L", "N", "P", "S", "Zs", "Mn", "So")), max_size=120)


@pytest.mark.parametrize(("name", "width"), [("human", None), ("human-40", 40)])
def test_it_stays_as_it_is(name: str, width: int | None, golden: Callable[[Path, str], None]) -> None:
    report = sample.report()
    verdicts = "\n".join(human.verdict(one, passes=report.passes(one)) for one in report.checked)
    shown = human.findings(report.diagnostics, sample.TEXTS, width).plain
    golden(HERE / f"golden/{name}.txt", f"{shown}\n{verdicts}\n")


@given(source_lines, st.integers(1, 121), st.integers(0, 20), st.integers(12, 160))
def test_the_mark_stands_under_its_text(line: str, column: int, length: int, columns: int) -> None:
    column = min(column, len(line) + 1)
    first, last = marked(line, Span("f", 1, column, 1, column + length))
    shown = view(line, first, last, columns)
    before, marks = shown.under(first, last)
    assert cells(shown.text) <= columns
    under = line[column - 1 : column]
    if under and cells(under) and columns >= 20:
        assert shown_at(shown.text, before) == under
    assert marks >= 1
    assert before + marks <= max(columns, before + 1)


def shown_at(text: str, cell: int) -> str:
    """The letter that begins at a cell, passing by marks that take none."""
    at = 0
    for char in text:
        if at == cell and cell_len(char):
            return char
        at += cell_len(char)
    return ""


def test_wide_letters_before_the_place_take_two_cells() -> None:
    line = f"name: {WIDE} lab"
    column = line.index("lab") + 1
    found = Diagnostic("YAML001", "m", Span("f", 1, column, 1, column + 3))
    row, marks = human.findings([found], {"f": line}).plain.splitlines()[3:5]
    assert cell_len(row[: row.index("lab")]) == marks.index("^^^")


def test_no_line_of_source_is_wider_than_a_narrow_terminal() -> None:
    shown = human.findings(sample.FINDINGS, sample.TEXTS, 40).plain.splitlines()
    assert [line for line in shown if re.match(r"\d+ \| ", line) and cell_len(line) > 40] == []


def test_two_places_far_apart_on_a_long_line_are_both_shown() -> None:
    line = "first" + " " * 300 + "second"
    found = Diagnostic(
        "YAML001", "m", Span("f", 1, 306, 1, 312), notes=(Note(Span("f", 1, 1, 1, 6), "the other"),)
    )
    shown = human.findings([found], {"f": line}).plain
    assert "second\n" in shown
    assert "first" in shown


@given(st.text(max_size=30))
def test_nothing_hidden_reaches_the_terminal(text: str) -> None:
    found = Diagnostic(
        "YAML001",
        text,
        Span(text, 1, 1, 1, 4),
        label=text,
        notes=(Note(Span("y", 1, 1, 1, 2), text),),
        help=(text,),
    )
    shown = human.findings([found], {text: text, "y": text}).plain
    shown += human.verdict(Checked(text, None, (found,)), passes=False)
    hidden = r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
    assert not re.search(hidden, shown)
