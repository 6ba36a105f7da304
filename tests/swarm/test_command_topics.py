"""Where robots take commands: teleop, bridges, loads and checks use that topic and its message type."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from swarmctl.analysis.diagram import diagram
from swarmctl.analysis.host_load import host_budgets
from swarmctl.analysis.network_load import network_budgets
from swarmctl.linter.runner import lint
from swarmctl.render.build_bundle import bundles
from swarmctl.spec.load import load
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolve import resolve
from swarmctl.swarm.resolved import Swarm
from tests.swarm.documents import read

SPEC = """
version: 1
name: lab
mode: standalone
hosts:
  base: {address: 192.168.77.10, computer: raspberry-pi-4b}
  far: {address: 192.168.77.11, computer: raspberry-pi-4b}
types:
  stamped:
    title: Takes stamped velocities
    driver:
      package: vendor
      executable: node
      command: ~move
      command_type: geometry_msgs/TwistStamped
      remap: {~move: base/move}
      ungated: true
      reason: it has a mux of its own
    kinematics: {kind: holonomic, linear_max: 1.0, angular_max: 1.0}
  camera:
    title: Camera on a tripod
    driver: {package: cameras, executable: node}
    kinematics: {kind: none}
robots:
  s-1: {type: stamped, host: far}
  tb3: {type: turtlebot3-burger, host: far}
  eye: {type: camera, host: far}
links:
  - {kind: wlan, name: lab, hosts: [base, far]}
programs:
  keys: {use: teleop-joy, host: base, params: {device: /dev/input/js0}}
control:
  - {by: keys, of: [s-1, tb3]}
time: {root: base}
"""


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> SwarmIndex:
    return SwarmIndex(read(tmp_path_factory.mktemp("swarm"), SPEC))


@pytest.fixture(scope="module")
def swarm(index: SwarmIndex) -> Swarm:
    return resolve(index.document)


def test_an_ungated_driver_keeps_its_own_command_topic(index: SwarmIndex) -> None:
    found = {robot: (one.topic, one.type) for robot, one in index.command_topics.items()}
    assert found == {
        "s-1": ("/s_1/base/move", "geometry_msgs/TwistStamped"),
        "tb3": ("/tb3/cmd_vel", "geometry_msgs/Twist"),
    }


def test_teleop_publishes_what_each_driver_takes(swarm: Swarm) -> None:
    bundle = bundles(swarm)["base"]
    params = next(one.content for one in bundle.files if one.path == "params/keys.yaml")
    assert yaml.safe_load(params)["targets"] == [
        {"robot": "s-1", "topic": "/s_1/base/move", "stamped": True},
        {"robot": "tb3", "topic": "/tb3/cmd_vel"},
    ]


def test_commands_of_other_islands_are_bridged_by_name(swarm: Swarm) -> None:
    found = {(one.topic, one.type, one.origin, one.to) for one in swarm.bridges if one.cause == "control[0]"}
    assert found == {
        ("/s_1/base/move", "geometry_msgs/TwistStamped", "base", ("far",)),
        ("/tb3/cmd_vel", "geometry_msgs/Twist", "base", ("far",)),
    }


def test_the_network_carries_the_real_command_topics(index: SwarmIndex) -> None:
    (budget,) = network_budgets(index)
    flows = {one.topic: one.bytes_per_second for one in budget.flows}
    assert flows["/s_1/base/move"] > flows["/tb3/cmd_vel"] > 0  # its header


def test_the_graph_shows_the_command_topic(index: SwarmIndex) -> None:
    labels = {one.end: one.label for one in diagram(index).edges if one.kind == "commands"}
    assert labels == {"robot:s-1": "base/move", "robot:tb3": "cmd_vel"}


def test_only_robots_with_a_gate_need_memory_for_it(index: SwarmIndex) -> None:
    (far,) = (one for one in host_budgets(index, ()) if one.host == "far")
    assert dict(far.parts)["1 gate"] == 40
    assert far.served == 4  # three drivers and the gate of tb3


def test_a_robot_that_takes_no_commands_has_no_gate(swarm: Swarm) -> None:
    units = {one.name for one in bundles(swarm)["far"].units}
    assert "swarm-lab.tb3.gate.service" in units
    assert not {"swarm-lab.eye.gate.service", "swarm-lab.s-1.gate.service"} & units
    assert swarm.robots["eye"].command is None


@pytest.mark.parametrize(
    ("published", "code", "help_"),
    [
        ("/s_1/base/move, type: geometry_msgs/TwistStamped", "AUTH004", "add to `control`"),
        ("/s_1/cmd_vel, type: geometry_msgs/Twist", "TOPIC005", "takes geometry_msgs/TwistStamped on"),
        ("/eye/cmd_vel, type: geometry_msgs/Twist", "TOPIC005", "takes no commands"),
        ("/s_1/base/move, type: geometry_msgs/Twist", "TOPIC001", "write the type"),
    ],
)
def test_wrong_commands_are_found(tmp_path: Path, published: str, code: str, help_: str) -> None:
    wander = (
        "programs:\n  wander: {host: base, package: wander, executable: wander, "
        f"publishes: [{{topic: {published}}}]}}\n"
    )
    document = read(tmp_path, SPEC.replace("programs:\n", wander))
    found = {one.code: one for one in lint(document)}
    assert code in found, found
    assert any(help_ in line for line in found[code].help), found[code].help


@pytest.mark.parametrize(
    ("driver", "problem"),
    [
        ("{package: a, executable: b, command_type: a_msgs/Hover}", "the gate sends"),
        ('{package: a, launch: b.launch, command: "~go", ungated: true, reason: why}', "is private to"),
    ],
)
def test_drivers_without_usable_commands_are_errors(tmp_path: Path, driver: str, problem: str) -> None:
    path = tmp_path / "swarm.yaml"
    path.write_text(SPEC.replace("{package: cameras, executable: node}", driver), "utf-8")
    document, found = load([path])
    assert document is None
    assert any(problem in one.message for one in found), found
