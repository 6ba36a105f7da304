"""The flat form of a spec: the same swarm, every value with its origin."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.effective_spec import Flat, flat
from swarmctl.spec.load import Document, load, load_text
from swarmctl.swarm.resolve import resolve
from swarmctl.views.effective_spec import json_of, yaml_of
from tests.rules.specs import BROKEN, spec
from tests.timing import work_at_most

HERE = Path(__file__).parent
LAYERS = HERE / "effective_spec"
EXAMPLES = sorted((HERE.parents[1] / "examples").glob("*/swarm.yaml"))
CATALOG = load_catalog()


def loaded(*files: Path) -> Document:
    document, _ = load(files)
    assert document is not None
    return document


def again(document: Document) -> Document:
    """The document that the flat form of a document makes."""
    text = yaml_of(flat(document), origins=True)
    made, found = load_text(text, "flat.yaml", document.catalog)
    assert found == ()
    assert made is not None
    return made


@pytest.mark.parametrize("origins", [(), ("--origins",)], ids=["plain", "origins"])
def test_the_whole_text(
    origins: tuple[str, ...],
    golden: Callable[[Path, str], None],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(LAYERS)
    assert run(["spec", "swarm.yaml", "-f", "field.yaml", "--expanded", *origins]) == exit_codes.OK
    golden(LAYERS / f"{'origins' if origins else 'plain'}.txt", capsys.readouterr().out)


@pytest.mark.parametrize("files", [*[(one,) for one in EXAMPLES], (LAYERS / "swarm.yaml",),
                                   (LAYERS / "swarm.yaml", LAYERS / "field.yaml")])  # fmt: skip
def test_the_flat_form_is_the_same_swarm(files: tuple[Path, ...]) -> None:
    document = loaded(*files)
    # A text alone has no folder for packages and files.
    made = replace(again(document), packages=document.packages, files=document.files)
    assert resolve(made) == resolve(document)
    assert made.spec.programs == document.spec.programs
    assert made.spec.control == document.spec.control


rates = st.fixed_dictionaries({}, optional={
    "odom": st.sampled_from([0.0, 5.0, 10.0]), "proximity": st.just(0.0),
    "diagnostics": st.sampled_from([0.5, 2.0]),
})  # fmt: skip
robot_settings = st.fixed_dictionaries({}, optional={
    "command_timeout": st.sampled_from([0.1, 0.5, 1e-1, 2.0]),
    "rates": rates,
    "limits": st.fixed_dictionaries({}, optional={"linear": st.just(0.05), "angular": st.just(1.5)}),
    "calibration": st.fixed_dictionaries({}, optional={"distance_scale": st.just(1.02)}),
})  # fmt: skip
host_defaults = st.fixed_dictionaries({}, optional={
    "user": st.just("pi"), "port": st.just(2222), "computer": st.just("laptop")
})  # fmt: skip
words = st.text(st.characters(categories=("L", "N", "P", "S", "Zs")), max_size=12)
values = words | st.integers(-9, 9) | st.booleans() | st.floats(-9, 9)
kinds = st.sampled_from(["koala", "khepera3"])
MACS = "10:00:00:00:00:0[1-3]"


@st.composite
def specs(draw: st.DrawFn) -> dict[str, Any]:
    """A spec with something in every layer, with ranges, and with text that YAML may misread."""
    return {
        "version": 1,
        "name": draw(st.sampled_from(["a", "no", "y", "e1", "on"])),
        "mode": "central",
        "hub": "pi-1",
        "defaults": {"host": draw(host_defaults), "robot": draw(robot_settings)},
        "hosts": {
            "pi-[1-3]": {"address": "10.0.0.[1-3]", **draw(host_defaults)},
            "other": {"address": "10.0.0.9", **draw(host_defaults)},
        },
        "robots": {
            "e-[1-3]": {"type": "epuck", "host": "pi-[1-3]", "settings": draw(robot_settings)},
            "k": {"type": draw(kinds), "host": "other", "settings": draw(robot_settings)},
        },
        "links": [
            {"kind": "bluetooth", "host": "pi-[1-3]", "robot": "e-[1-3]", "mac": MACS, "adapter": "hci0"},
            {"kind": "serial", "host": "other", "robot": "k", "device": "/dev/ttyS0"},
        ],
        "programs": {
            "p": {
                "host": "other",
                "package": "joy",
                "executable": "joy_node",
                "params": draw(st.dictionaries(words, values)),
                "environment": draw(st.dictionaries(st.sampled_from(["A", "NO"]), words)),
            }
        },
    }  # fmt: skip


@settings(max_examples=150)
@given(specs())
def test_any_flat_form_is_the_same_swarm(spec: dict[str, Any]) -> None:
    with work_at_most(50):
        document, found = load_text(json.dumps(spec, ensure_ascii=False), "swarm.yaml", CATALOG)
        assert document is not None, found
        made = again(document)
    assert resolve(made) == resolve(document)
    assert made.spec.programs == document.spec.programs
    assert yaml_of(flat(made)) == yaml_of(flat(document))


def leaves(node: Flat) -> Iterator[Flat]:
    if isinstance(node.value, Mapping):
        for below in node.value.values():
            yield from leaves(below)
    else:
        yield node


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.parent.name)
def test_a_value_stands_where_its_origin_says(example: Path) -> None:
    lines = {str(file): file.read_text("utf-8").splitlines() for file in example.parent.glob("*.yaml")}
    for leaf in leaves(flat(loaded(example))):
        if isinstance(leaf.value, list):
            continue
        if leaf.origin.span is not None:
            line = lines[leaf.origin.span.file][leaf.origin.span.line - 1]
            shown = str(leaf.value).lower() if isinstance(leaf.value, bool) else str(leaf.value)
            shown = shown.removesuffix(".0")  # 60 is a float where the model has it so
            assert shown in line or "-[" in line  # counted by a range
        shipped = leaf.origin.layer == "swarmctl" or leaf.origin.layer.startswith("type ")
        assert leaf.origin.span is not None or shipped


def test_the_data_and_the_origin_of_each_value_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        run(["spec", str(LAYERS / "swarm.yaml"), "-f", str(LAYERS / "field.yaml"), "--json"]) == exit_codes.OK
    )
    printed = json.loads(capsys.readouterr().out)
    robot = printed["spec"]["robots"]["epuck-3"]
    assert robot["settings"]["limits"] == {"linear": 0.05}
    layers = {
        key: printed["origins"][f"/robots/epuck-3/{key}"]["layer"]
        for key in (
            "host",
            "optional",
            "settings/command_timeout",
            "settings/limits/linear",
            "settings/rates/odom",
        )
    }
    assert layers == {
        "host": "spec",
        "optional": "swarmctl",
        "settings/command_timeout": "defaults",
        "settings/limits/linear": "overlay",
        "settings/rates/odom": "type slow-epuck",
    }
    assert printed["origins"]["/robots/epuck-3/host"]["line"] == 32
    assert printed == {"v": 1, **json_of(flat(loaded(LAYERS / "swarm.yaml", LAYERS / "field.yaml"),
                                           [str(LAYERS / "field.yaml")]))}  # fmt: skip


def test_a_wrong_spec_has_no_flat_form(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["spec", str(spec(BROKEN, "unknown-type")), "--expanded"]) == exit_codes.ERROR
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "REF001" in printed.err
