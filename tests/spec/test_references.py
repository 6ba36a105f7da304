"""A name is changed together with everything that mentions it, in every place that may hold such a name."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from swarmctl.field_types import ComputerName, HostName, IslandName, RobotName, RobotTypeName
from swarmctl.spec.model import Spec
from swarmctl.spec.references import _FROM_ROOT, _PLACES, _RELATIVE, KEY, mentions, rename
from swarmctl.yamltext.edits import apply
from swarmctl.yamltext.source import parse

TEXT = """\
leader: a
hub: a
time: {root: a}
hosts:
  a: {via: b, computer: board}
  b: {via: a}
robots:
  k3: {type: own, host: a}
  a: {type: own, host: b}
types: {own: {}}
computers: {board: {}}
links:
- {hosts: [a, b]}
- {host: a, robot: a}
programs:
  stick: {host: a, robot: a}
islands:
  west: {hosts: [b, a], leader: a, hub: a}
control:
- {by: a, of: [k3, a]}
- {by: stick, of: [k3]}
multimaster:
  robot_hosts: {a: [b], b: [a]}
  sync_hosts: [a]
  ignore_hosts: [a]
  topics:
  - {to: [west, a]}
ignore:
- {about: a}
"""


def renamed(kind: str, old: str, new: str) -> str:
    source, _ = parse(TEXT, "swarm.yaml")
    return apply(TEXT, rename(source, kind, old, new))


def test_a_host_is_renamed_and_no_robot_of_that_name() -> None:
    assert renamed("hosts", "a", "new").splitlines() == [
        "leader: new",
        "hub: new",
        "time: {root: new}",
        "hosts:",
        "  new: {via: b, computer: board}",
        "  b: {via: new}",
        "robots:",
        "  k3: {type: own, host: new}",
        "  a: {type: own, host: b}",
        "types: {own: {}}",
        "computers: {board: {}}",
        "links:",
        "- {hosts: [new, b]}",
        "- {host: new, robot: a}",
        "programs:",
        "  stick: {host: new, robot: a}",
        "islands:",
        "  west: {hosts: [b, new], leader: new, hub: new}",
        "control:",
        "- {by: a, of: [k3, a]}",
        "- {by: stick, of: [k3]}",
        "multimaster:",
        "  robot_hosts: {new: [b], b: [new]}",
        "  sync_hosts: [new]",
        "  ignore_hosts: [new]",
        "  topics:",
        "  - {to: [west, new]}",
        "ignore:",
        "- {about: a}",
    ]


@pytest.mark.parametrize(
    ("kind", "old", "lines"),
    [
        ("robots", "a", ["  new: {t", "a, robot: new}\np", "robot: new}\ni", "by: new", "3, new]", "t: new"]),
        ("programs", "stick", ["  new: {host", "- {by: new"]),
        ("islands", "west", ["  new: {hosts", "{to: [new, a]}"]),
        ("types", "own", ["k3: {type: new", "a: {type: new", "types: {new: {}}"]),
        ("computers", "board", ["computer: new}", "{new: {}}"]),
    ],
)  # fmt: skip
def test_other_names_are_renamed_too(kind: str, old: str, lines: list[str]) -> None:
    text = renamed(kind, old, "new")
    assert text.count("new") == len(lines)
    for line in lines:
        assert line in text


def test_a_name_that_is_taken_is_not_given_again() -> None:
    assert renamed("hosts", "a", "b") == TEXT


NAMES = {
    "hosts": HostName, "robots": RobotName, "types": RobotTypeName,
    "computers": ComputerName, "islands": IslandName,
}  # fmt: skip
EXAMPLES = {name.__metadata__[-1].examples[0]: kind for kind, name in NAMES.items()}


def test_every_place_that_holds_a_name_is_known() -> None:
    """Keys that hold names are recognised by their examples, in the JSON Schema as in the models."""
    schema = Spec.model_json_schema()
    held = {
        place: EXAMPLES[example]
        for place, text in _texts(schema, schema, ())
        for example in text.get("examples", ())
        if example in EXAMPLES and "types" not in place.split(".")
    }
    defined = {f"{kind}.{KEY}" for kind in NAMES}
    assert {place for place in held if place not in defined} <= set(_PLACES)
    for place, kind in held.items():
        assert place in defined or kind in _PLACES[place]


def test_every_place_that_holds_a_ros_name_is_known() -> None:
    schema = Spec.model_json_schema()
    held = {place for place, text in _texts(schema, schema, ()) if "A-Za-z~/" in text.get("pattern", "")}
    words = {"experiments.*.record.*", "programs.*.namespace"}  # which are matched in another way
    words |= {f"{owner}.remap.{KEY}" for owner in ("programs.*", "robots.*.driver")}
    assert {one for one in held if "types" not in one.split(".")} == {*_FROM_ROOT, *_RELATIVE} - words


def _texts(schema: Any, part: Any, place: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    """The places that hold text, each with its schema."""
    if "$ref" in part:
        yield from _texts(schema, schema["$defs"][part["$ref"].rpartition("/")[2]], place)
        return
    if part.get("type") == "string":
        yield ".".join(place), part
    for one in (*part.get("anyOf", ()), *part.get("oneOf", ())):
        yield from _texts(schema, one, place)
    for key, one in part.get("properties", {}).items():
        yield from _texts(schema, one, (*place, key))
    if isinstance(part.get("items"), dict):
        yield from _texts(schema, part["items"], (*place, "*"))
    if "propertyNames" in part:
        yield from _texts(schema, {"type": "string", **part["propertyNames"]}, (*place, KEY))
    for one in (part.get("additionalProperties"), *part.get("patternProperties", {}).values()):
        if isinstance(one, dict):
            yield from _texts(schema, one, (*place, "*"))


def test_what_is_mentioned_is_found_in_data_of_any_shape() -> None:
    for data in (
        None,
        (),
        {"hosts": None},
        {"hosts": {"a": 1}, "links": {"x": ({"host": "a"},)}, "control": 3},
    ):
        assert list(mentions(data, "hosts", "a")) == []
