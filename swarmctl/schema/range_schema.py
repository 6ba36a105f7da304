"""Where a range may stand, in the JSON Schema for editors: a name, an item, a value of an entry that ranges.

What ranges has definitions of its own, in which values may be ranges or ``{each: [...]}``; so an entry with
a plain name stays as strict as it was.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import TypeAdapter

from swarmctl.field_types import NAME, X_SELECTION, Selection
from swarmctl.yamltext.ranges import EACH, FREE

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
