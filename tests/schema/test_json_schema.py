"""The JSON Schemas: generated, for editors, and of one mind with the models."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_args

import jsonschema
import pytest
from pydantic import BaseModel, create_model

from swarmctl.cli.app import run
from swarmctl.schema.json_schema import DRAFT, MODELS, schema_of, without_ranges
from swarmctl.yamltext.source import parse
from tests import ROOT
from tests.rules.specs import BROKEN, spec, specs_in
from tests.schema.validator import valid

EXAMPLES = sorted(ROOT.glob("examples/*/swarm.yaml"))
TYPES = sorted(ROOT.glob("templates/robots/*.yaml"))
NEW_WORDS = {
    "$defs",
    "prefixItems",
    "unevaluatedProperties",
    "unevaluatedItems",
    "dependentRequired",
    "dependentSchemas",
    "minContains",
    "maxContains",
    "$anchor",
    "$dynamicRef",
    "discriminator",
    "$id",
    "title",
}
NOTES = {"description", "default", "examples"}  # all that may stand beside a reference: it judges nothing


def data_of(file: Path) -> Any:
    """A file as JSON sees it."""
    return json.loads(json.dumps(parse(file.read_text("utf-8"), str(file))[0].data))


def schemas_in(node: Any) -> Iterator[dict[str, Any]]:
    """Every schema below ``node``; what stands under ``properties`` are names, not words."""
    if isinstance(node, list):
        for one in node:
            yield from schemas_in(one)
    elif isinstance(node, dict):
        yield node
        for key, below in node.items():
            if key in ("properties", "patternProperties", "definitions"):
                for one in below.values():
                    yield from schemas_in(one)
            elif key not in ("default", "examples", "enum", "const"):
                yield from schemas_in(below)


@pytest.mark.parametrize("name", MODELS)
def test_the_file_is_what_the_models_make(
    name: str, golden: Callable[[Path, str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["schema", name]) == 0
    golden(ROOT / "schemas" / f"{name}.schema.json", capsys.readouterr().out)


@pytest.mark.parametrize("name", MODELS)
def test_it_is_draft_07_and_claims_no_address(name: str) -> None:
    schema = schema_of(name)
    assert schema["$schema"] == DRAFT
    jsonschema.Draft7Validator.check_schema(schema)
    for one in schemas_in(schema):
        assert not NEW_WORDS & set(one)
        assert "$ref" not in one or set(one) <= {"$ref", *NOTES}
        assert one.get("$ref", "#/definitions/").startswith("#/definitions/")


def keys_of(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every key of a schema as `Definition.key`, and what the schema says of it."""
    for name, one in {"": schema, **schema["definitions"]}.items():
        for key, below in one.get("properties", {}).items():
            yield f"{name}.{key}", below


def models_of(root: type[BaseModel]) -> dict[str, type[BaseModel]]:
    """The models that a root is made of, itself included, by name."""
    met: dict[str, type[BaseModel]] = {}
    waiting: list[Any] = [root]
    while waiting:
        one = waiting.pop()
        if not isinstance(one, type) or not issubclass(one, BaseModel):
            waiting += get_args(one)
        elif one.__name__ not in met:
            met[one.__name__] = one
            waiting += [field.annotation for field in one.model_fields.values()]
    return met


@pytest.mark.parametrize("name", MODELS)
def test_every_key_is_described(name: str) -> None:
    assert [key for key, below in keys_of(schema_of(name)) if not below.get("description")] == []


@pytest.mark.parametrize("name", MODELS)
def test_every_key_has_an_example(name: str) -> None:
    """A new key without one? Give its type `examples`; lists, mappings and choices make theirs of them."""
    assert [key for key, below in keys_of(schema_of(name)) if not below.get("examples")] == []


@pytest.mark.parametrize("name", MODELS)
def test_every_example_and_default_fits_its_key(name: str) -> None:
    schema = schema_of(name)
    for key, below in keys_of(schema):
        judge = jsonschema.Draft7Validator({**below, "definitions": schema["definitions"]})
        for value in [*below["examples"], *([below["default"]] if "default" in below else [])]:
            assert judge.is_valid(value), f"{key}: {value}"


@pytest.mark.parametrize("name", MODELS)
def test_the_models_take_every_example_and_their_defaults_are_named(name: str) -> None:
    schema = without_ranges(name)
    for title, model in models_of(MODELS[name]).items():
        if title not in schema["definitions"] and "properties" not in schema:
            continue  # a file in one of several forms, which are definitions
        keys = (schema if model is MODELS[name] else schema["definitions"][title])["properties"]
        for key, field in model.model_fields.items():
            alone = create_model(title, __config__=model.model_config, **{key: (field.annotation, field)})
            for example in keys[key]["examples"]:
                alone.model_validate_json(json.dumps({key: example}))
            if isinstance(field.default, (bool, int, float, str)) and field.default != "":
                assert keys[key]["default"] == field.default


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.parent.name)
def test_examples_fit(example: Path) -> None:
    assert valid("swarm", data_of(example))


def test_only_a_file_that_includes_others_may_lack_parts() -> None:
    alone = {"version": 1, "name": "newswarm", "mode": "standalone"}
    assert not valid("swarm", alone)
    assert valid("swarm", alone | {"include": ["hosts.yaml", "robots.yaml"]})


@pytest.mark.parametrize("file", TYPES, ids=lambda path: path.stem)
def test_robot_types_fit(file: Path) -> None:
    assert valid("robot-type", data_of(file))


@pytest.mark.parametrize(
    "place", [(), ("hosts", "k3-pi"), ("robots", "k3"), ("links", 0), ("links", 1), ("links", 1, "usb")]
)
def test_a_misspelt_key_does_not_fit(place: tuple[str | int, ...], leader_spec: Path) -> None:
    data = copy.deepcopy(data_of(leader_spec))
    inner = data
    for part in place:
        inner = inner[part]
    inner["mispelt"] = 1
    assert not valid("swarm", data)


@pytest.mark.parametrize("spec", specs_in(BROKEN), ids=lambda path: path.stem)
def test_what_the_schema_refuses_the_models_refuse(spec: Path) -> None:
    """An editor underlines nothing that ``validate`` accepts."""
    message = spec.with_suffix(".txt").read_text("utf-8")
    if any(family in message for family in ("[YAML", "[FILE", "[RANGE", "[VAR")):
        return
    if not valid("swarm", data_of(spec)):
        assert "[SPEC" in message


UNDERLINED = [
    *("unknown-key-top", "unknown-key-host", "unknown-key-link", "bluetooth-baud"),
    *(
        "missing-mac",
        "wrong-type-list",
        "quoted-number",
        "param-of-wrong-type",
        "pin-in-plain-text",
        "out-of-range",
    ),
    *("bad-name", "bad-host-name", "bad-mode", "bad-version", "bad-user", "link-kind-unknown"),
]


@pytest.mark.parametrize("name", UNDERLINED)
def test_an_editor_underlines_these_too(name: str) -> None:
    assert not valid("swarm", data_of(spec(BROKEN, name)))


RANGING = {
    "hosts": {"pi-[1-5]": {"address": "10.0.0.[11-15]", "port": {"each": [22, 23, 24, 25, 26]}}},
    "robots": {
        "e-[01-20]": {
            "type": "epuck",
            "host": "pi-[1-5,1-5,1-5,1-5]",
            "settings": {"rates": {"odom": {"each": [1]}}},
        }
    },
    "links": [
        {"kind": "wlan", "name": "lab", "hosts": ["laptop", "pi-[1-5]"]},
        {
            "kind": "bluetooth",
            "host": "pi-[1-5,1-5,1-5,1-5]",
            "robot": "e-[01-20]",
            "mac": {"each": ["a"]},
            "channel": {"each": [1]},
        },
    ],
    "programs": {
        "p-[1-2]": {"robot": "e-[01-02]", "use": "teleop-joy", "params": {"device": "/dev/input/js[0-1]"}}
    },
    "control": [{"by": "p-[1-2]", "of": ["e-[01-02]"]}],
}


def ranging(*place: str | int, value: Any = None) -> dict[str, Any]:
    """A spec with ranges in which ``value`` stands at ``place``."""
    data: dict[str, Any] = copy.deepcopy({"version": 1, "name": "a", "mode": "leader", **RANGING})
    inner: Any = data
    for part in place[:-1]:
        inner = inner.setdefault(part, {}) if isinstance(inner, dict) else inner[part]
    if place:
        inner[place[-1]] = value
    return data


def test_ranges_fit_where_they_are_written_out() -> None:
    assert valid("swarm", ranging())


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("leader",), {"each": ["a", "b"]}),
        (("leader",), "pi-[1-5]"),
        (("hosts", "laptop"), {"address": "10.0.0.9", "port": {"each": [1, 2]}}),
        (("hosts", "laptop"), {"address": "10.0.0.9", "user": "pi-[1-5]"}),
        (("hosts", "pi-[1-5]", "mispelt"), 1),
        (("hosts", "pi-[a-c]"), {"address": "10.0.0.9"}),
        (("hosts", "pi-[1-2]-[1-2]"), {"address": "10.0.0.9"}),
        (("robots", "e-[01-20]", "settings", "mispelt"), 1),
        (("robots", "e-[01-20]", "settings", "rates", "odom"), "fast"),
        (("defaults", "host", "port"), {"each": [1, 2]}),
        (("links", 1, "kind"), {"each": ["serial", "bluetooth"]}),
        (("links", 1, "mispelt"), 1),
        (("types", "e-[1-2]"), {}),
    ],
)
def test_a_range_fits_nowhere_else(place: tuple[str | int, ...], value: Any) -> None:
    assert not valid("swarm", ranging(*place, value=value))
