"""JSON Schemas for editors, made from the models, in the draft-07 that yaml-language-server understands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from swarmctl.robot_types.any_robot_type import RobotTypeFile
from swarmctl.schema.examples import with_examples
from swarmctl.schema.range_schema import with_ranges
from swarmctl.spec.model import Spec
from swarmctl.units import X_UNIT, with_unit

DRAFT = "http://json-schema.org/draft-07/schema#"
MODELS: Mapping[str, type[BaseModel]] = {"swarm": Spec, "robot-type": RobotTypeFile}


def schema_of(name: str) -> dict[str, Any]:
    """Returns the schema of ``swarm`` or ``robot-type``."""
    made = without_ranges(name)
    return _with_included_parts(with_ranges(made)) if name == "swarm" else made


def _with_included_parts(schema: dict[str, Any]) -> dict[str, Any]:
    """The schema of a file whose required keys may stand in the files that it includes."""
    needed = {"required": schema["required"]}
    others = {key: value for key, value in schema.items() if key != "required"}
    return {**others, "if": {"required": ["include"]}, "else": needed}


def without_ranges(name: str) -> dict[str, Any]:
    """Returns the schema of a file without ranges, for reference pages."""
    made = MODELS[name].model_json_schema(mode="validation")
    return {"$schema": DRAFT, **_draft7(with_examples(made))}


def _draft7(node: Any) -> Any:
    """A 2020-12 schema of pydantic's with the words of draft-07, and without what only repeats."""
    if isinstance(node, list):
        return [_draft7(one) for one in node]
    if not isinstance(node, dict):
        return node
    made: dict[str, Any] = {
        _WORDS.get(key, key): _below(key, value) for key, value in node.items() if not _idle(key, value)
    }
    made = _without_null(made)
    if X_UNIT in made:
        made = with_unit(made)
    if "patternProperties" in made:  # pydantic leaves names open that fit no pattern; a spec does not
        made |= {"additionalProperties": False}
        made.pop("propertyNames", None)
    return made


_WORDS: Mapping[str, str] = {"$defs": "definitions", "prefixItems": "items"}
_NAMED = (
    "properties",
    "$defs",
    "patternProperties",
)  # here the keys are names of the user's, not words of a schema


def _below(key: str, value: Any) -> Any:
    if key in _NAMED:
        return {name: _draft7(one) for name, one in value.items()}
    if key == "$ref":
        return value.replace("#/$defs/", "#/definitions/")
    return value if key in ("default", "examples", "enum", "const", "required") else _draft7(value)


def _idle(key: str, value: Any) -> bool:
    """Titles repeat the key, a discriminator is OpenAPI's, and no file holds a default of nothing."""
    return (
        (key == "title" and isinstance(value, str))
        or key == "discriminator"
        or (key == "default" and value in (None, [], ""))
    )


def _without_null(made: dict[str, Any]) -> dict[str, Any]:
    """What is left out in a file is not written as null: an optional value is simply a value."""
    choices = made.get("anyOf", [])
    kept = [one for one in choices if one != {"type": "null"}]
    if len(kept) == len(choices):
        return made
    rest = {key: value for key, value in made.items() if key != "anyOf"}
    return {**kept[0], **rest} if len(kept) == 1 else {**rest, "anyOf": kept}
