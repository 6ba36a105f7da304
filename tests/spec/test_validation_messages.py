"""Error messages of validation are ours: no regular expression of a model, no English of pydantic."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field, create_model

from swarmctl.diagnostics import Diagnostic
from swarmctl.field_types import Model
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec.model import Computers, Spec
from swarmctl.spec.model_lookup import PLACES
from swarmctl.spec.validation import validated
from swarmctl.text_patterns import words_of
from swarmctl.yamltext.source import Source, parse

MODELS = (Spec, RobotType, Computers)


def patterns_in(schema: Any) -> Iterator[str]:
    """Every regular expression of a JSON Schema, those of keys included."""
    if isinstance(schema, dict):
        if isinstance(schema.get("pattern"), str):
            yield schema["pattern"]
        yield from schema.get("patternProperties", {})
        for below in schema.values():
            yield from patterns_in(below)
    elif isinstance(schema, list):
        for below in schema:
            yield from patterns_in(below)


PATTERNS = sorted({one for model in MODELS for one in patterns_in(model.model_json_schema())})


def printed(annotation: Any, source: Source) -> str:
    """All texts of the one error that ``source`` has where its ``value`` should be of a type."""
    _, found = validated(create_model("Tried", __base__=Model, value=(annotation, ...)), source)
    assert len(found) == 1
    return "\n".join((found[0].message, found[0].label, *found[0].help))


def test_the_models_have_patterns() -> None:
    assert len(PATTERNS) >= 20
    assert all(map(words_of, PATTERNS))


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("value", ['{value: " \\t "}', '{value: ""}', "{value: ÄÖ}"])
def test_no_message_shows_a_regular_expression(pattern: str, value: str) -> None:
    source, _ = parse(value, "swarm.yaml")
    if validated(create_model("Tried", value=(Annotated[str, Field(pattern=pattern)], ...)), source)[1]:
        text = printed(Annotated[str, Field(pattern=pattern)], source)
        assert pattern not in text
        assert not any(sign in text for sign in ("^[", "]*", "]{", ")+", "\\x"))
        assert words_of(pattern) in text


@pytest.mark.parametrize(
    ("annotation", "text"),
    [
        (Annotated[str, Field(min_length=3)], "needs 3 or more characters"),
        (Annotated[str, Field(max_length=1)], "must have 1 characters or fewer"),
        (Annotated[float, Field(multiple_of=2)], "must be a number"),
        (bytes, "cannot be `ab`"),
    ],
)
def test_no_message_is_pydantics_own(annotation: Any, text: str) -> None:
    found = printed(annotation, parse("value: ab", "swarm.yaml")[0])
    assert text in found
    assert "should" not in found


def only_finding(annotation: Any, text: str) -> Diagnostic:
    source, _ = parse(text, "swarm.yaml")
    _, (found,) = validated(create_model("Tried", __base__=Model, value=(annotation, ...)), source)
    return found


@pytest.mark.parametrize("text", ["{value: \\n}", "{value: '\\n'}"])
def test_an_escape_outside_double_quotes_has_a_fix(text: str) -> None:
    found = only_finding(Literal["\r", "\n"], text)
    assert 'write "\\n" in double quotes' in found.help[0]
    assert found.fix is not None
    assert [edit.text for edit in found.fix.edits] == ['"\\n"']


@pytest.mark.parametrize(
    ("text", "name", "fixed"),
    [
        ("{value: ab\u00a0}", "its character 3 is U+00A0 (no-break space)", "ab"),
        ("{value: \u00a0cd}", "its character 1 is U+00A0 (no-break space)", "cd"),
        ("{value: c\u200bd}", "its character 2 is U+200B (zero width space)", "cd"),
        ("{value: ab, c:\u00a0d: b}", "its character 3 is U+00A0 (no-break space)", None),
    ],
)
def test_characters_that_nobody_sees_are_named(text: str, name: str, fixed: str | None) -> None:
    found = only_finding(Literal["ab", "cd"], text)
    assert name in found.help[0]
    assert (found.fix.edits[0].text if found.fix else None) == fixed


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [("a:\n\u00a0\u00a0b: 1\n  c: 2\n", 2, 1), ("a: 1\nb:\u00a02\nc: 3\n", 2, 3)],
)
def test_they_are_shown_beside_a_syntax_error(text: str, line: int, column: int) -> None:
    _, (found,) = parse(text, "swarm.yaml")
    note = found.notes[-1]
    assert (note.span.line, note.span.column, note.text) == (
        line,
        column,
        "the character U+00A0 (no-break space)",
    )
    assert "write a blank" in found.help[0]


BASE = {
    "hosts": "hosts: {pi: {address: 192.168.77.10, %s: x}}",
    "robots": "hosts: {}\nrobots: {k3: {type: khepera3, host: pi, %s: x}}",
    "programs": "hosts: {}\nprograms: {joy: {host: pi, package: joy, executable: joy_node, %s: x}}",
    "": "hosts: {}\n%s: x",
}
KEYS = [(section, key) for section, places in PLACES.items() for key in places]


@pytest.mark.parametrize(("section", "key"), KEYS)
def test_a_key_of_another_place_is_an_error_with_that_place(section: str, key: str) -> None:
    """None of them is a key of the spec there, or so like one that it is fixed as a slip."""
    source, _ = parse(f"version: 1\nname: s\nmode: central\nhub: pi\n{BASE[section] % key}\n", "swarm.yaml")
    _, diagnostics = validated(Spec, source)
    (found,) = (one for one in diagnostics if one.code == "SPEC001")
    assert f"unknown key `{key}`" in found.message
    assert found.help == (PLACES[section][key],)
    assert found.fix is None
