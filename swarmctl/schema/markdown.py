"""The reference page of a schema: each key, its values and its meaning."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from swarmctl.schema.json_schema import without_ranges
from swarmctl.spec.catalog import Setting, shipped
from swarmctl.units import X_UNIT

_HEADING = {
    "swarm": "What may stand in a swarm's spec.",
    "robot-type": "What may stand in a robot type's file.",
}


_TYPES = "robot-type-reference.md"
#: Definitions that have a page of their own, by the page's schema.
_ELSEWHERE: Mapping[str, Mapping[str, str]] = {
    "swarm": {"RobotType": f"{_TYPES}#robottype", "RosRobotType": f"{_TYPES}#rosrobottype"},
    "robot-type": {},
}


def reference(name: str) -> str:
    """Returns the page of ``swarm`` or ``robot-type`` as Markdown.

    ``docs/`` holds it; a test keeps it current.
    """
    schema = without_ranges(name)
    page = _Page(schema["definitions"], _ELSEWHERE[name])
    title = name.replace("-", " ").capitalize()
    parts = [f"# {title}: every key\n\n{_HEADING[name]} Made by `swarmctl schema {name} --markdown`.\n"]
    if "properties" in schema:
        parts += ["\n".join(page.section("The file", schema))]
    parts += ["\n".join(page.section(one, page.definitions[one])) for one in page.in_order(schema)]
    if name == "swarm":
        parts += ["\n".join(_settings(program, settings)) for program, settings in shipped().items()]
    return "\n".join(parts)


def _settings(program: str, settings: Mapping[str, Setting]) -> Iterator[str]:
    """What `params` of a shipped program may hold."""
    yield f"## {program}\n"
    yield f"The `params` of a program with `use: {program}`.\n"
    yield "| key | value | default | meaning |"
    yield "|---|---|---|---|"
    for key, setting in settings.items():
        default = _code(setting.default) if setting.default != "" else ""
        yield f"| `{key}` | {setting.range} | {default} | {_text(setting.meaning)} |"
    yield ""


@dataclass(frozen=True)
class _Page:
    definitions: Mapping[str, Any]
    elsewhere: Mapping[str, str]

    def in_order(self, schema: Mapping[str, Any]) -> list[str]:
        """Definitions with keys of their own, in the order in which a reader meets them."""
        met: dict[str, None] = {}
        waiting = list(_named(schema.get("properties", schema.get("oneOf"))))
        while waiting:
            name = waiting.pop(0)
            if name not in met and name not in self.elsewhere:
                met[name] = None
                waiting += _named(self.definitions[name])
        return [name for name in met if "properties" in self.definitions[name]]

    def section(self, name: str, schema: Mapping[str, Any]) -> Iterator[str]:
        needed = schema.get("required", [])
        yield f"## {name}\n"
        yield f"{_text(schema.get('description', ''))}\n"
        yield "| key | value | default | meaning |"
        yield "|---|---|---|---|"
        for key, value in schema["properties"].items():
            default = "**required**" if key in needed else _default(value)
            yield f"| `{key}` | {self.value(value)} | {default} | {_text(value.get('description', ''))} |"
        yield ""

    def value(self, value: Mapping[str, Any]) -> str:
        """What may stand there, in a few words."""
        if "$ref" in value:
            return self._referred(value["$ref"].rsplit("/", 1)[1])
        if alternatives := value.get("anyOf") or value.get("oneOf"):
            return " or ".join(dict.fromkeys(self.value(one) for one in alternatives))
        if "enum" in value:
            return ", ".join(_code(one) for one in value["enum"])
        if "const" in value:
            return _code(value["const"])
        if value.get("type") == "array":
            parts = value.get("items", [])
            parts = parts if isinstance(parts, list) else [parts]
            return "list of " + " and ".join(dict.fromkeys(map(self.value, parts))) if parts else "list"
        if named := value.get("patternProperties") or value.get("additionalProperties"):
            inner = next(iter(named.values())) if "patternProperties" in value else named
            return f"name: {self.value(inner)}" if isinstance(inner, Mapping) else "mapping"
        words = {"string": "text", "boolean": "`true`, `false`"}
        return _number(value) if X_UNIT in value else words.get(value.get("type", ""), _number(value))

    def _referred(self, name: str) -> str:
        if name not in self.elsewhere and "properties" not in self.definitions[name]:
            return self.value(self.definitions[name])
        return f"[{name}]({self.elsewhere.get(name, '#' + name.lower())})"


def _named(node: Any) -> Iterator[str]:
    if isinstance(node, Mapping):
        for key, value in node.items():
            if key == "$ref":
                yield value.rsplit("/", 1)[1]
            else:
                yield from _named(value)
    elif isinstance(node, list):
        for one in node:
            yield from _named(one)


def _default(value: Mapping[str, Any]) -> str:
    default = value.get("default")
    return "" if default in (None, [], {}, "") else _code(default)


def _code(value: Any) -> str:
    text = str(value).lower() if isinstance(value, bool) else str(value)
    return f"`{text if text.isprintable() else json.dumps(text)}`"


def _number(value: Mapping[str, Any]) -> str:
    word = "whole number" if "integer" in value.get("type", "") else "number"
    low = value.get("minimum", value.get("exclusiveMinimum"))
    high = value.get("maximum", value.get("exclusiveMaximum"))
    above = "above" if "exclusiveMinimum" in value else "from"
    bounds = [f"{above} {low:g}"] if low is not None else []
    bounds += [f"to {high:g}"] if high is not None else []
    unit = [value[X_UNIT]] if X_UNIT in value else []
    return " ".join([word, *bounds, *unit])


def _text(text: str) -> str:
    """A description on one line of a table."""
    return " ".join(text.split()).replace("|", "\\|")
