"""The scorecard names tests that exist, and says what is missing where it names none."""

from __future__ import annotations

import pytest

from tests.scorecard import ROOT, ROWS, Row, _state


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.case)
def test_a_row_has_tests_or_says_what_is_missing(row: Row) -> None:
    assert row.tests or row.note
    for test in row.tests:
        file, _, name = test.partition("::")
        assert f"def {name}(" in (ROOT / file).read_text("utf-8"), test


def test_the_cases_are_complete_and_in_order() -> None:
    assert [row.case for row in ROWS] == [f"R{number:02}" for number in range(1, 63) if number != 50]


def test_a_row_is_green_only_if_its_tests_passed() -> None:
    row = Row("R1", "a fault", ("a", "b"))
    assert _state(row, {"a": ("passed", 1.0), "b": ("passed", 2.0)}) == ("green", 3.0)
    assert _state(row, {"a": ("passed", 1.0), "b": ("failure", 2.0)}) == ("red", 3.0)
    assert _state(row, {"a": ("passed", 1.0), "b": ("skipped", 0.0)}) == ("skipped", 1.0)
    assert _state(row, {"a": ("passed", 1.0)}) == ("skipped", 1.0)
    assert _state(row, {}) == ("skipped", 0)
    assert _state(Row("R2", "a fault"), {}) == ("open", 0.0)
