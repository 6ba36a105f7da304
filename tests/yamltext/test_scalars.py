"""Unquoted scalars: ours are those of YAML 1.2."""

from __future__ import annotations

import math
from typing import Any

import pytest

from swarmctl.rulebook import Severity
from swarmctl.spec.catalog import Catalog
from swarmctl.spec.load import load_text
from swarmctl.yamltext.files import MAX_NUMBER
from swarmctl.yamltext.scalars import WORDS, number_or_text
from swarmctl.yamltext.source import parse


def ours(text: str) -> Any:
    return WORDS[text] if text in WORDS else number_or_text(text)


def same(one: Any, other: Any) -> bool:
    both_nan = isinstance(one, float) and isinstance(other, float) and math.isnan(one) and math.isnan(other)
    return both_nan or (type(one) is type(other) and one == other)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("10:00:52:14:33:11", "10:00:52:14:33:11"),
        ("12:30", "12:30"),
        ("no", "no"),
        ("ON", "ON"),
        ("012", 12),
        ("-012", -12),
        ("089", 89),
        ("0o17", 15),
        ("0x1F", 31),
        ("1_000", "1_000"),
        ("0b101", "0b101"),
        ("2026-02-01", "2026-02-01"),
        ("1e3", 1000.0),
        ("-2.5e3", -2500.0),
        (".5", 0.5),
        ("10.0.0.1", "10.0.0.1"),
        ("+", "+"),
        (".", "."),
    ],
)
def test_unquoted_scalars_follow_yaml_1_2(text: str, value: Any) -> None:
    assert same(ours(text), value)
    source, found = parse(f"a: {text}\n", "x")
    assert same(source.data["a"], value)
    assert found == []


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
    _, found = load_text("version: 1\nname:\nmode: leader\n", "swarm.yaml", Catalog())
    assert [one.code for one in found if one.span and one.span.line == 2] == ["SPEC003"]
