"""Examples for every key of a schema: those of the models, and what follows from them for the rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


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
