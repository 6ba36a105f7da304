"""Selections in a spec: lists become plain names, and positions lead back to the selection."""

from __future__ import annotations

import pytest

from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import Document, load_text
from swarmctl.spec.references import rename
from swarmctl.spec.selection_expansion import below, entries, expand
from swarmctl.yamltext.compose import compose
from swarmctl.yamltext.edits import remove, replace_value
from swarmctl.yamltext.files import MAX_NODES, LoadBudget

SPEC = """\
version: 1
name: lab
mode: leader
leader: laptop
hosts:
  laptop: {address: 192.168.77.10}
  pi-[1-3]: {address: "192.168.77.[11-13]", labels: [shelf]}
robots:
  k3-[1-3]: {type: khepera3, host: "pi-[1-3]"}
groups:
  some: ["k3-[1-3]&!k3-[2-2]", "pi-2&laptop"]
links:
  - {kind: wlan, name: lab, hosts: [laptop, "@shelf"]}
  - {kind: serial, host: "pi-[1-3]", robot: "k3-[1-3]", usb: {serial: "FT-[1-3]"}}
programs:
  camera: {robots: ["@some", "!k3-1"], package: usb_cam, executable: usb_cam_node, params: {rate: 5}}
  beacon: {hosts: [pi-1, laptop], package: beacon, executable: beacon}
control:
  - {by: laptop, of: ["@some", k3-2]}
"""


def loaded(text: str = SPEC) -> Document:
    document, found = load_text(text, "swarm.yaml", load_catalog())
    assert document is not None, found
    return document


def test_lists_have_plain_names_afterwards() -> None:
    spec = loaded().spec
    assert getattr(spec.links[0], "hosts", ()) == ("laptop", "pi-1", "pi-2", "pi-3")
    assert spec.control[0].of == ("k3-1", "k3-3", "k3-2")
    assert spec.groups == {"some": ("k3-[1-3]&!k3-[2-2]", "pi-2&laptop")}


def test_a_program_for_several_robots_is_one_for_each() -> None:
    programs = loaded().spec.programs
    assert {name: (one.robot, one.host, one.params) for name, one in programs.items()} == {
        "camera-k3-3": ("k3-3", None, {"rate": 5}),
        "beacon-pi-1": (None, "pi-1", {}),
        "beacon-laptop": (None, "laptop", {}),
    }


def test_a_name_has_the_position_of_its_selection() -> None:
    document = loaded()
    span = document.span("control", 0, "of", 1)
    assert SPEC.splitlines()[span.line - 1][span.column - 1 : span.end_column - 1] == '"@some"'


def test_no_fix_replaces_a_selection_that_means_one_name() -> None:
    document = loaded(SPEC.replace('"@some", k3-2', '"@some", "!k3-1"'))
    assert document.spec.control[0].of == ("k3-3",)
    assert replace_value(document.source, ("control", 0, "of", 0), "k3-2") == ()
    assert remove(document.source, ("control", 0, "of", 0)) == ()


@pytest.mark.parametrize(("kind", "name"), [("robots", "k3-1"), ("hosts", "pi-2"), ("hosts", "laptop")])
def test_nothing_is_renamed_that_a_selection_may_mean(kind: str, name: str) -> None:
    assert rename(loaded().source, kind, name, "another") == ()


def test_what_no_selection_means_can_be_renamed() -> None:
    text = SPEC.replace("pi-2&laptop", "pi-2&@shelf").replace("[pi-1, laptop]", "[pi-1]")
    assert rename(loaded(text).source, "hosts", "laptop", "another")


def test_programs_for_every_robot_of_a_large_swarm_are_bounded() -> None:
    robots = "".join(f"  r{number}: {{}}\n" for number in range(900))
    programs = "".join(f'  p{number}: {{robots: ["*"], package: a}}\n' for number in range(80))
    root, _ = compose(f"robots:\n{robots}programs:\n{programs}", "swarm.yaml", LoadBudget())
    assert root is not None
    made, found = expand(root)
    assert [(one.code, one.message) for one in found] == [
        ("RANGE003", f"selections make more than {MAX_NODES} values here")
    ]
    assert 80 < len(entries(below(made, "programs"))) < MAX_NODES / 5
