"""A kind of link from outside, which this file alone knows: its spec, drivers, views, swap and conversion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar, Literal

import pytest
import yaml

from swarmctl.analysis.command_paths import command_path
from swarmctl.analysis.diagram import Diagram, diagram
from swarmctl.analysis.serial_load import serial_budgets
from swarmctl.links.link_base import Delay, Device, Line
from swarmctl.links.serial_link import FixedLine
from swarmctl.linter.runner import lint
from swarmctl.mode_conversion.convert import converted
from swarmctl.plugins import LINK_KINDS
from swarmctl.render.driver_config import parameters
from swarmctl.scaffold.starting_files import starting_spec
from swarmctl.schema.json_schema import schema_of
from swarmctl.spec.load import load
from swarmctl.spec.model import Mode
from swarmctl.spec.swap import swap
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolve import resolve
from swarmctl.swarm.resolved import ForeignDriver, SwarmctlDriver
from swarmctl.views.graph import dot, mermaid
from swarmctl.views.graph.overview import overview
from swarmctl.yamltext.edits import apply
from tests import ROOT
from tests.swarm.documents import read


class Can(Line):
    """A CAN bus between a host and a robot."""

    wired: ClassVar[bool] = True
    device_keys: ClassVar[tuple[str, ...]] = ("node",)
    title: ClassVar[str] = "CAN"
    placeholders: ClassVar[Mapping[str, str]] = {
        "device": "the device of its {} link",
        "node": "its CAN node",
    }
    example: ClassVar[str] = "interface: can0, node: ..."
    delays: ClassVar[Mapping[str, Delay]] = {"can": Delay(0.001, 0.0005)}
    unknown_end: ClassVar[Mapping[str, Any]] = {"node": 1}

    kind: Literal["can"]
    interface: str
    node: int

    @classmethod
    def first_value(cls, number: int, robot: str, dongle: int) -> str:
        return str(number)

    def label(self, adapter: str | None, port: int | None) -> str:
        return f"{self.interface} node {self.node}"

    def values(self, ends: Any) -> dict[str, str | int]:
        return {"device": ends.device, "node": self.node}

    def device_of(self, number: int, channel: int, adapter: str) -> Device:
        return FixedLine(self.interface)


HEAD = """version: 1
name: yard
mode: central
hub: desk
hosts:
  desk: {address: 10.0.0.2}
  pi-[1-2]: {address: "10.0.0.[11-12]"}
"""
ROBOTS = """robots:
  a: {type: hauler, host: pi-1}
  b: {type: hauler, host: pi-2}
  arm: {type: lifter, host: pi-1}
"""
LINKS = """links:
  - {kind: wlan, name: air, hosts: [desk, pi-1, pi-2]}
  - {kind: can, host: pi-1, robot: a, interface: can0, node: 4}
  - {kind: can, host: pi-2, robot: b, interface: can1, node: 7}
"""
ARM = "  - {kind: can, host: pi-1, robot: arm, interface: can2, node: 9}\n"
CONTROL = "control:\n  - {by: desk, of: [a, b, arm]}\n"
SPEC = HEAD + ROBOTS + LINKS + ARM + CONTROL
LIFTER = """title: Lifter
link: {kinds: [can]}
driver: {package: lifter, executable: lift, params: {bus: "{device}", id: "{node}"}}
kinematics: {kind: differential, linear_max: 0.2, angular_max: 1.0}
"""


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    LINK_KINDS.register("can", Can)
    yield
    LINK_KINDS.unregister("can")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with two robot types: one of swarmctl's driver, one of a ROS package."""
    (tmp_path / "robots").mkdir()
    koala = (ROOT / "templates/robots/koala.yaml").read_text("utf-8")
    (tmp_path / "robots/hauler.yaml").write_text(koala.replace("[serial, bluetooth]", "[can]"), "utf-8")
    (tmp_path / "robots/lifter.yaml").write_text(LIFTER, "utf-8")
    return tmp_path


def messages(folder: Path, text: str) -> list[str]:
    """The findings of a spec that does not fit its model."""
    (folder / "swarm.yaml").write_text(text, "utf-8")
    document, found = load([folder / "swarm.yaml"])
    assert document is None
    return [one.message for one in found]


def drawn(folder: Path) -> Diagram:
    return diagram(SwarmIndex(read(folder, SPEC)))


def test_a_spec_with_it_has_no_findings(folder: Path) -> None:
    document = read(folder, SPEC)
    assert lint(document) == ()
    assert document.spec.model_dump(mode="json")["links"][1]["node"] == 4


def test_its_keys_are_checked(folder: Path) -> None:
    assert messages(folder, SPEC.replace("node: 4", "node: x"))[0] == "`node` must be a whole number, not `x`"
    assert "`nod`" in messages(folder, SPEC.replace("node: 4", "nod: 4"))[0]


def test_the_finding_of_a_robot_without_it_shows_how_to_write_it(folder: Path) -> None:
    (finding,) = (one for one in lint(read(folder, SPEC.replace(ARM, ""))) if one.code == "LINK001")
    assert finding.help == (
        "add to `links`: {kind: can, host: pi-1, robot: arm, interface: can0, node: ...}",
    )


def test_a_type_that_does_not_take_it_is_a_finding(folder: Path) -> None:
    found = lint(read(folder, SPEC.replace("{type: lifter,", "{type: tello,")))
    assert "LINK007" in [one.code for one in found]


def test_the_driver_opens_its_device(folder: Path) -> None:
    robot = resolve(read(folder, SPEC)).robots["b"]
    assert isinstance(robot.driver, SwarmctlDriver)
    assert yaml.safe_load(parameters(robot, robot.driver)[0])["port"] == "can1"


def test_a_ros_package_gets_its_placeholders(folder: Path) -> None:
    driver = resolve(read(folder, SPEC)).robots["arm"].driver
    assert isinstance(driver, ForeignDriver)
    assert driver.ros.params == {"bus": "can2", "id": 9}


def test_its_delay_counts_for_the_load_of_the_line(folder: Path) -> None:
    load = next(budget.load for _, budget in serial_budgets(SwarmIndex(read(folder, SPEC))))
    assert (load.kind, load.delay) == ("can", Can.delays["can"])


def test_views_draw_it(folder: Path) -> None:
    assert '"host:pi-1" -> "robot:a" [label="can0 node 4", dir=none, penwidth=2];' in dot.graph(drawn(folder))
    assert '===|"can0 node 4"| ' in mermaid.graph(drawn(folder))
    assert "robot a  hauler by can can0 node 4; commanded by desk" in overview(drawn(folder)).plain
    hops = command_path(SwarmIndex(read(folder, SPEC)), "desk", "a").hops
    assert ("line", "can") in [(one.kind, one.detail) for one in hops]


def test_a_swap_moves_what_belongs_to_the_robot(folder: Path) -> None:
    made = swap(read(folder, SPEC), "a", "b")
    assert set(made.moved) == {"host", "node"}
    text = apply(SPEC, made.edits[str(folder / "swarm.yaml")])
    assert "{kind: can, host: pi-2, robot: a, interface: can0, node: 7}" in text


def test_a_conversion_moves_it_to_another_host(folder: Path) -> None:
    made = converted(read(folder, SPEC), Mode.SINGLE_MINDED)
    assert "{kind: can, host: desk, robot: a, interface: can0, node: 4}" in made.text
    assert "plug the line of `a` into `desk` instead of `pi-1`" in made.by_hand


def test_the_schema_has_it() -> None:
    assert "node" in schema_of("swarm")["definitions"]["CanRange"]["properties"]


def test_a_new_spec_names_its_kind(folder: Path) -> None:
    types = read(folder, SPEC).types
    assert "type: hauler" in starting_spec("yard", Mode.CENTRAL, {"a": "hauler"}, types)


def test_a_kind_without_a_value_or_a_device_has_none(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(Can, "first_value")
    monkeypatch.delattr(Can, "device_of")
    document = read(folder, SPEC)
    assert "type: hauler" in starting_spec("yard", Mode.CENTRAL, {"a": "hauler"}, document.types)
    found = [(one.code, one.message) for one in lint(document)]
    assert ("LINK004", "the CAN link of `a` has no device") in found
