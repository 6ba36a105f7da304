"""JSON Schemas for editors, made from the models, in the draft-07 that yaml-language-server understands.

What ranges has definitions of its own, in which values may be ranges or ``{each: [...]}``; so an entry with
a plain name stays as strict as it was. Everywhere a variable, ``${name}``, may stand for a value.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel, TypeAdapter

from swarmctl.field_types import NAME, VARIABLE, X_SELECTION, Selection
from swarmctl.robot_types.any_robot_type import RobotTypeFile
from swarmctl.spec.model import Spec
from swarmctl.units import X_UNIT, with_unit
from swarmctl.yamltext.ranges import EACH, FREE


def with_examples(schema: Mapping[str, Any]) -> dict[str, Any]:
    """Returns a schema of pydantic's in which every key has examples, as far as its words have one."""
    definitions = {name: _keyed(one, schema["$defs"]) for name, one in schema["$defs"].items()}
    return _keyed(schema, schema["$defs"]) | {"$defs": definitions}


def _keyed(node: Mapping[str, Any], definitions: Mapping[str, Any]) -> dict[str, Any]:
    if "properties" not in node:
        return dict(node)
    keys = {
        key: {**one, "examples": found} if (found := _examples(one, definitions)) else one
        for key, one in node["properties"].items()
    }
    return {**node, "properties": keys}


def _examples(node: Mapping[str, Any], definitions: Mapping[str, Any]) -> list[Any]:
    """The node's own examples, else what may stand there anyway, else what its parts make; or none."""
    if "examples" in node:
        return list(node["examples"])
    if "$ref" in node:
        return _examples(definitions[node["$ref"].rsplit("/", 1)[1]], definitions)
    if "const" in node or "enum" in node:
        return [node.get("const", node.get("default", node.get("enum", [None])[0]))]
    if node.get("type") == "boolean":
        return [not node.get("default")]
    if alternatives := node.get("oneOf"):
        return [found for one in alternatives for found in _examples(one, definitions)]
    if alternatives := node.get("anyOf"):
        return _examples(alternatives[0], definitions)
    if node.get("type") == "array":
        parts = node.get("prefixItems", [node["items"]] if "items" in node else [])
        items = [found for part in parts for found in _examples(part, definitions)[:1]]
        return [items] if items else []
    if node.get("type") == "object":
        return _objects(node, definitions)
    return [node["default"]] if node.get("default") not in (None, "") else []


def _objects(node: Mapping[str, Any], definitions: Mapping[str, Any]) -> list[dict[str, Any]]:
    """One mapping: the keys that it needs, or the first it may have; for a mapping by name, one name."""
    keys = node.get("properties")
    if keys is None:
        below = next(iter(node["patternProperties"].values()))
        names = _examples(node.get("propertyNames", {}), definitions)
        return (
            [{name: found for name in names[:1] for found in _examples(below, definitions)[:1]}]
            if names
            else []
        )
    made = {
        key: found
        for key in node.get("required") or list(keys)[:1]
        for found in _examples(keys[key], definitions)[:1]
    }
    return [made] if made else []


_INSIDE = r"\[[0-9][0-9, -]*\]"
_RANGE_OF_NAMES = f"^[a-z][a-z0-9-]*{_INSIDE}[a-z0-9-]*$"
_SCALARS = ("string", "integer", "number", "boolean")
_ANNOTATIONS = ("description", "examples", "default")

_RANGE = {
    "type": "string",
    "pattern": rf"^[^\[\]]*{_INSIDE}[^\[\]]*$",
    "description": "A range: pi-[01-20], pi-[1-6,8], or pi-[1-5,1-5] to use each number twice.",
}
_EACH = {
    "type": "object",
    "properties": {
        EACH: {
            "type": "array",
            "minItems": 1,
            "description": "The items; a range among them is one for each of its elements.",
            "examples": [["10:00:e8:c5:64:37", "10:00:e8:c5:64:38"]],
        }
    },
    "required": [EACH],
    "additionalProperties": False,
    "description": "One item for each entry of the range.",
}

_SELECTION = TypeAdapter(Selection).json_schema()

Schema = Mapping[str, Any]


def with_ranges(schema: Schema) -> dict[str, Any]:
    """Returns a draft-07 schema of a spec in which ranges may stand where they are written out."""
    maker = _Maker(schema["definitions"])
    properties = {
        key: node if key in FREE else maker.outside(node) for key, node in schema["properties"].items()
    }
    made = {**schema, "properties": properties}
    definitions = {
        **schema["definitions"],
        **maker.made,
        "RangeOfNames": _RANGE,
        "Each": _EACH,
        "Selection": _SELECTION,
    }
    needed = _needed(properties, definitions)
    return {**made, "definitions": {name: definitions[name] for name in sorted(needed)}}


class _Maker:
    """The definitions of one schema, and those that are made of them."""

    def __init__(self, definitions: Schema) -> None:
        self.definitions = definitions
        self.made: dict[str, Any] = {}

    def outside(self, node: Schema) -> dict[str, Any]:
        """A schema whose lists and mappings by name may range."""
        made = dict(node)
        if "$ref" in node:
            self._define(_name(node), _name(node), self.outside)
        if node.get("type") == "array" and "items" in node:
            item = node["items"]
            made["items"] = _or_range(item) if _is_scalar(item) else self.inside(item)
        if NAME in node.get("patternProperties", {}):
            value = node["patternProperties"][NAME]
            made["patternProperties"] = {NAME: self.outside(value), _RANGE_OF_NAMES: self.inside(value)}
        if "properties" in node:
            made["properties"] = {
                key: one if key in FREE else self.outside(one) for key, one in node["properties"].items()
            }
        return made | {word: [self.outside(one) for one in node[word]] for word in _CHOICES if word in node}

    def inside(self, node: Schema) -> dict[str, Any]:
        """A schema of what belongs to an entry that ranges."""
        if "const" in node:  # the kind of a link decides its other keys
            return dict(node)
        if _is_scalar(node) or "enum" in node:
            return _or_range(node, _ref("Each"))
        made = dict(node)
        if "$ref" in node:
            name = _name(node)
            if "enum" in self.definitions[name]:
                return _or_range(node, _ref("Each"))
            self._define(f"{name}Range", name, self.inside)
            made["$ref"] = _ref(f"{name}Range")["$ref"]
        for word in ("items", "additionalProperties"):
            if isinstance(node.get(word), Mapping):
                made[word] = self.inside(node[word])
        for word in ("properties", "patternProperties"):
            if word in node:
                made[word] = {key: self._value(one) for key, one in node[word].items()}
        return made | {word: [self.inside(one) for one in node[word]] for word in _CHOICES if word in node}

    def _value(self, node: Schema) -> dict[str, Any]:
        """What stands behind a key of an entry that ranges; ``each`` may stand in place of anything."""
        made = self.inside(node)
        if "const" in node or _ref("Each") in made.get("anyOf", []):
            return made
        kept = {word: made.pop(word) for word in _ANNOTATIONS if word in made}
        if "$ref" in made and "description" in kept:  # else editors show the definition's own description
            made["description"] = kept["description"]
        return {**kept, "anyOf": [made, _ref("Each")]}

    def _define(self, name: str, original: str, make: Any) -> None:
        if name not in self.made:
            self.made[name] = {}  # for a definition that comes back to itself
            self.made[name] = make(self.definitions[original])


_CHOICES = ("anyOf", "oneOf", "allOf")


def _or_range(node: Schema, *others: Schema) -> dict[str, Any]:
    if X_SELECTION in node:
        node = {word: value for word, value in node.items() if word != X_SELECTION}
        others = (*others, _ref("Selection"))
    kept = {word: node[word] for word in _ANNOTATIONS if word in node}
    plain = {word: value for word, value in node.items() if word not in kept}
    return {**kept, "anyOf": [plain, _ref("RangeOfNames"), *others]}


def _is_scalar(node: Schema) -> bool:
    kinds = node.get("type", [])
    return all(one in _SCALARS for one in kinds) if isinstance(kinds, list) and kinds else kinds in _SCALARS


def _ref(name: str) -> dict[str, Any]:
    return {"$ref": f"#/definitions/{name}"}


def _name(node: Schema) -> str:
    return str(node["$ref"]).rsplit("/", 1)[1]


def _needed(node: Any, definitions: Schema) -> set[str]:
    """The definitions that ``node`` refers to, and those that they refer to."""
    needed: set[str] = set()
    waiting = list(_named(node))
    while waiting:
        name = waiting.pop()
        if name not in needed:
            needed.add(name)
            waiting += _named(definitions[name])
    return needed


def _named(node: Any) -> Iterator[str]:
    if isinstance(node, Mapping):
        for key, value in node.items():
            if key == "$ref":
                yield _name(node)
            else:
                yield from _named(value)
    elif isinstance(node, list):
        for one in node:
            yield from _named(one)


DRAFT = "http://json-schema.org/draft-07/schema#"
MODELS: Mapping[str, type[BaseModel]] = {"swarm": Spec, "robot-type": RobotTypeFile}


def schema_of(name: str) -> dict[str, Any]:
    """Returns the schema of ``swarm`` or ``robot-type``."""
    made = without_ranges(name)
    return _with_included_parts(_with_variables(with_ranges(made))) if name == "swarm" else made


def _with_included_parts(schema: dict[str, Any]) -> dict[str, Any]:
    """The schema of a file whose required keys may stand in the files that it includes."""
    needed = {"required": schema["required"]}
    others = {key: value for key, value in schema.items() if key != "required"}
    return {**others, "if": {"required": ["include"]}, "else": needed}


def _with_variables(node: Any) -> Any:
    """A schema in which a variable may stand for each value, list or part of a text."""
    if isinstance(node, list):
        return [_with_variables(one) for one in node]
    if not isinstance(node, dict):
        return node
    made: dict[str, Any] = {}
    for key, value in node.items():
        if key in _BY_NAME:
            made[key] = {name: _with_variables(one) for name, one in value.items()}
        else:
            made[key] = value if key in _AS_IT_IS else _with_variables(value)
    kinds = made["type"] if isinstance(made.get("type"), list) else [made.get("type")]
    if "enum" in made:
        kept = {word: made.pop(word) for word in _ANNOTATIONS if word in made}
        return {**kept, "anyOf": [made, {"type": "string", "pattern": _VARIABLE}]}
    if "string" in kinds and "pattern" in made:
        made["pattern"] += f"|{_VARIABLE}"
    elif set(kinds) & {*_SCALARS, "array"} and not {"string", "object"} & set(kinds) and "const" not in made:
        made |= {"type": [*kinds, "string"], "pattern": f"^{_VARIABLE}$"}
    return made


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


_VARIABLE = rf"\$\{{{VARIABLE[1:-1]}\}}"
_BY_NAME = ("properties", "definitions", "patternProperties")
_AS_IT_IS = ("default", "examples", "enum", "const", "required", "propertyNames")
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
