"""Whatever stands in a file: no exception, soon an answer, and places that are the places."""

from __future__ import annotations

import random
import subprocess
import sys

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.linter.runner import lint
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from swarmctl.views.escape import printable
from swarmctl.views.findings import human
from swarmctl.yamltext.files import MAX_DEPTH
from swarmctl.yamltext.source import parse
from tests import ROOT
from tests.timing import work_at_most

EXAMPLE = (ROOT / "examples/paper-leader/swarm.yaml").read_text("utf-8")
CATALOG = load_catalog()
WORDS = [
    "koala",
    "hosts",
    "kind: serial",
    "null",
    "1e999",
    "-0",
    "0x",
    "99999999999999999999",
    "é",
    "\x1b",
    "\u202e",
]
WORDS += [
    "{",
    "}",
    "[",
    "]",
    ":",
    ": ",
    "- ",
    "\n",
    "  ",
    '"',
    "'",
    "&a ",
    "*a",
    "<<: ",
    "!x ",
    "#",
    "|",
    ">",
    "\t",
]


def findings(text: str) -> tuple[Diagnostic, ...]:
    document, found = load_text(text, "swarm.yaml", CATALOG)
    return found if document is None else lint(document)


def assert_sound(text: str) -> None:
    """Every finding can be shown, and nothing it shows reaches the terminal raw."""
    for found in findings(text):
        shown = human.findings([found], {"swarm.yaml": text}).plain
        assert shown.replace("\n", "") == printable(shown.replace("\n", ""))
        assert found.span is not None
        assert 1 <= found.span.line <= len(text.splitlines()) + 1


@settings(max_examples=300)
@given(st.text(max_size=200))
@example("a: \ud800")
@example("&a [*a]")
@example("? {a: b}\n: c")
@example("'\\")
@example("%YAML 9.9\n---\n")
def test_any_text_gets_an_answer(text: str) -> None:
    with work_at_most(100):
        assert_sound(text)


@settings(max_examples=300)
@given(
    st.lists(
        st.tuples(st.integers(0, len(EXAMPLE)), st.integers(0, 12), st.sampled_from(WORDS)),
        min_size=1,
        max_size=4,
    )
)
def test_any_mutation_of_a_spec_gets_an_answer(cuts: list[tuple[int, int, str]]) -> None:
    text = EXAMPLE
    for place, length, word in cuts:
        text = text[:place] + word + text[place + length :]
    with work_at_most(100):
        assert_sound(text)


def test_any_line_may_be_missing() -> None:
    lines = EXAMPLE.splitlines(keepends=True)
    for gone in range(len(lines)):
        assert_sound("".join(lines[:gone] + lines[gone + 1 :]))


@pytest.mark.parametrize("piece", ["[", "{a: ", "- ", "? ", "[\n", '["]",'])
@pytest.mark.parametrize("times", [MAX_DEPTH + 1, 1_000, 100_000])
def test_deep_nesting_is_reported_and_ends_no_process(piece: str, times: int) -> None:
    code = "import sys; from swarmctl.yamltext.source import parse; "
    code += "print(parse(sys.stdin.read(), 'x')[1][0].code)"
    ran = subprocess.run(
        [sys.executable, "-c", code], input=piece * times, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0
    assert ran.stdout.strip() in ("YAML001", "YAML004", "YAML006")


def test_a_pyramid_of_aliases_ends_soon() -> None:
    layers = "".join(
        f"{chr(98 + i)}: &{chr(98 + i)} [{', '.join('*' + chr(97 + i) for _ in range(9))}]\n"
        for i in range(20)
    )
    with work_at_most(5):
        (found,) = findings("a: &a [x, x]\n" + layers)
    assert found.code == "YAML008"


def test_an_alias_or_two_is_fine() -> None:
    text = EXAMPLE.replace("user: robot, computer: laptop", "user: &who robot, computer: laptop").replace(
        "user: robot,", "user: *who,"
    )
    assert findings(text) == ()


keys = st.text("abcdefghij-_", min_size=1, max_size=8)
scalars = st.one_of(
    st.booleans().map(lambda one: ("true" if one else "false", one)),
    st.integers(-(10**12), 10**12).map(lambda one: (str(one), one)),
    st.floats(allow_nan=False, allow_infinity=False, width=32).map(
        lambda one: (repr(float(one)), float(one))
    ),
    st.text("abcxyzäöü日本 .-", max_size=12).map(lambda one: ('"' + one + '"', one)),
    st.from_regex(r"[a-z][a-z0-9/.:]{0,10}[a-z]", fullmatch=True)
    .filter(lambda one: one not in ("true", "false", "null"))
    .map(lambda one: (one, one)),
)


@given(
    st.dictionaries(keys, st.dictionaries(keys, scalars, min_size=1, max_size=5), min_size=1, max_size=5),
    st.booleans(),
    st.randoms(),
)
def test_the_span_of_a_value_cut_from_the_text_is_that_value(
    data: dict[str, dict[str, tuple[str, object]]], flow: bool, chance: random.Random
) -> None:
    lines = []
    for outer, inner in data.items():
        if flow:
            lines.append(f"{outer}:  {{{', '.join(f'{key}: {text}' for key, (text, _) in inner.items())}}}")
        else:
            indent = " " * chance.randint(1, 6)
            lines += [
                f"{outer}: # a note",
                *(f"{indent}{key}:   {text}  # ä note" for key, (text, _) in inner.items()),
            ]
    text = "\n".join(lines) + "\n"
    source, found = parse(text, "x")
    assert found == []
    rows = text.split("\n")
    for outer, inner in data.items():
        assert cut(rows, source.span((outer,), key=True)) == outer
        for key, (written, value) in inner.items():
            assert source.data[outer][key] == value
            assert cut(rows, source.span((outer, key))) == written
            assert cut(rows, source.span((outer, key), key=True)) == key
            assert cut(rows, source.span((outer, key, "missing"))) == written


def cut(rows: list[str], span: Span) -> str:
    assert span.line == span.end_line
    return rows[span.line - 1][span.column - 1 : span.end_column - 1]


def test_a_file_of_another_program_is_reported_in_one_line() -> None:
    entry = ", ".join(f"k{number}: 1" for number in range(40))
    section = "".join(f"  a{number}: {{{entry}}}\n" for number in range(40))
    (found,) = findings(f"hosts:\n{section}robots:\n{section}")
    assert found.code == "SPEC005"
