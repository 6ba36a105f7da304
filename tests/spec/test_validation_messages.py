"""Error messages of validation are ours: no regular expression of a model, no English of pydantic."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

import pytest
from pydantic import Field, create_model

from swarmctl.field_types import Model
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec.model import Computers, Spec
from swarmctl.spec.pattern_texts import PATTERN_TEXTS
from swarmctl.spec.validation import validated
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
    assert set(PATTERN_TEXTS) == set(PATTERNS)


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("value", ['{value: " \\t "}', '{value: ""}', "{value: ÄÖ}"])
def test_no_message_shows_a_regular_expression(pattern: str, value: str) -> None:
    source, _ = parse(value, "swarm.yaml")
    if validated(create_model("Tried", value=(Annotated[str, Field(pattern=pattern)], ...)), source)[1]:
        text = printed(Annotated[str, Field(pattern=pattern)], source)
        assert pattern not in text
        assert not any(sign in text for sign in ("^[", "]*", "]{", ")+", "\\x"))
        assert PATTERN_TEXTS[pattern] in text


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
