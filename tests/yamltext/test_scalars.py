"""Unquoted scalars: ours are those of YAML 1.2, and whoever reads them otherwise is named."""

from __future__ import annotations

import math
from typing import Any

import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from swarmctl.diagnostics import Severity
from swarmctl.spec.catalog import Catalog
from swarmctl.spec.load import load_text
from swarmctl.yamltext.limits import MAX_NUMBER
from swarmctl.yamltext.scalars import WORDS, number_or_text, trap
from swarmctl.yamltext.source import parse


def ours(text: str) -> Any:
    return WORDS[text] if text in WORDS else number_or_text(text)


def same(one: Any, other: Any) -> bool:
    both_nan = isinstance(one, float) and isinstance(other, float) and math.isnan(one) and math.isnan(other)
    return both_nan or (type(one) is type(other) and one == other)


@pytest.mark.parametrize(
    ("text", "value", "reads", "better"),
    [
        ("10:00:52:14:33:11", "10:00:52:14:33:11", "the number 7787284391", '"10:00:52:14:33:11"'),
        ("12:30", "12:30", "the number 750", '"12:30"'),
        ("no", "no", "`false`", '"no"'),
        ("ON", "ON", "`true`", '"ON"'),
        ("012", 12, "the number 10", "12"),
        ("-012", -12, "the number -10", "-12"),
        ("089", 89, "text", "89"),
        ("0o17", 15, "text", "15"),
        ("1_000", "1_000", "a number", '"1_000"'),
        ("0b101", "0b101", "a number", '"0b101"'),
        ("2026-02-01", "2026-02-01", "a date", '"2026-02-01"'),
        ("1e3", 1000.0, "text", "1.0e+3"),
        ("-2.5e3", -2500.0, "text", "-2.5e+3"),
    ],
)
def test_what_other_programs_misread(text: str, value: Any, reads: str, better: str) -> None:
    assert same(ours(text), value)
    found = trap(text, value)
    assert found is not None
    assert (found.reads, found.better) == (reads, better)


@pytest.mark.parametrize(
    "text",
    ["10:00:e8:c5:64:37", "00:1b:dc:0f:11:22", "10.0.0.1", "07", "0", "12", "0x1F", "1.5", "1.0e-3", "k3-pi",
     "9600", "192.168.77.0/24", "-0.010", "noon", "2026", "1-2", ".5", "+", "-", "."],
)  # fmt: skip
def test_what_everybody_reads_alike(text: str) -> None:
    assert trap(text, ours(text)) is None


@settings(max_examples=1000)
@given(st.text("0123456789:._-+eExXoObBaf", min_size=1, max_size=12))
@example("1:2.5")
@example("-.5")
def test_no_trap_is_overlooked(text: str) -> None:
    """PyYAML reads YAML 1.1: where it reads a number that we do not, or another one, a trap is reported."""
    try:
        (theirs,) = yaml.safe_load(f"[{text}]")
    except (yaml.YAMLError, ValueError):  # no scalar, or a number that PyYAML itself trips over
        return
    if theirs != text and not isinstance(theirs, (dict, list)) and trap(text, ours(text)) is None:
        assert same(ours(text), theirs)


@settings(max_examples=1000)
@given(st.text("0123456789:._-+eExob", min_size=1, max_size=12))
def test_what_is_advised_is_read_alike_by_everybody(text: str) -> None:
    found = trap(text, ours(text))
    if found is not None:
        source, left = parse(found.better, "x")
        assert left == []
        assert same(source.data, ours(text))
        assert same(yaml.safe_load(found.better), ours(text))


def test_numbers_end_where_no_quantity_reaches() -> None:
    assert ours("1" * 5_000) == "1" * 5_000
    assert ours("0." + "1" * 5_000) == "0." + "1" * 5_000
    assert ours("1e999") == math.inf
    assert ours("9" * 18) == 10**18 - 1
    assert ours("9" * (MAX_NUMBER + 1)) == "9" * (MAX_NUMBER + 1)


@pytest.mark.parametrize("written", ['"012"', "'012'", "!!str 012", "|-\n  012"])
def test_what_is_quoted_as_text_is_text(written: str) -> None:
    source, found = parse(f"a: {written}\n", "x")
    assert (source.data, found) == ({"a": "012"}, [])


@pytest.mark.parametrize("written", ["!!int 12", "!robot {a: b}", "!!set {a: }", "!!binary aGk=", "![a]"])
def test_tags_are_refused(written: str) -> None:
    _, found = parse(f"a: {written}\n", "x")
    assert [one.code for one in found if one.severity is Severity.ERROR] in (["YAML007"], ["YAML001"])


def test_an_error_at_a_place_silences_the_warning_there() -> None:
    _, found = load_text("version: 1_000\nname: no\n", "swarm.yaml", Catalog())
    assert [one.code for one in found if one.span and one.span.line == 1 and one.span.column > 1] == [
        "SPEC003"
    ]
    assert [one.code for one in found if one.span and one.span.line == 2] == ["YAML010"]
