"""A robot whose board speaks rosserial: what is expected of its driver, ours or rosserial_python."""

from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent.observations import NodeSeen
from swarm_onboard.agent.systemd import UnitState

from swarmctl.health.checks import driver
from swarmctl.health.expected_graph import ExpectedHost, ExpectedRobot, Release, expected_graph
from swarmctl.swarm.command_topics import COMMAND_TYPE
from tests import ROOT
from tests.loading import load_swarm

EXAMPLE = ROOT / "examples/arduino-rover/swarm.yaml"
ADDRESS = "192.168.77.30"


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    """The example, with rosserial_python."""
    text = EXAMPLE.read_text("utf-8")
    foreign = text.replace("{type: arduino-rover}", "{type: arduino-rover, driver: rosserial_python}")
    assert foreign != text
    (tmp_path / "swarm.yaml").write_text(foreign, "utf-8")
    return tmp_path / "swarm.yaml"


def rover(spec: Path) -> ExpectedRobot:
    [robot] = rover_pi(spec).robots
    return robot


def rover_pi(spec: Path) -> ExpectedHost:
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    [host] = expected_graph(swarm, {"rover-pi": Release("a" * 16, ())}).hosts
    return host


def test_our_driver_rejects_unauthorised_nodes_and_has_odometry() -> None:
    robot = rover(EXAMPLE)
    assert robot.guarded
    assert [(one.name, one.type, one.rate) for one in robot.topics] == [
        ("/rover/lwheel", "std_msgs/Int32", 10.0),
        ("/rover/rwheel", "std_msgs/Int32", 10.0),
        ("/rover/odom", "nav_msgs/Odometry", 10.0),
        ("/diagnostics", "diagnostic_msgs/DiagnosticArray", 1.0),
    ]


def test_its_node_command_and_sketch_topics_are_expected(spec: Path) -> None:
    robot = rover(spec)
    assert (robot.unit, robot.node, robot.device) == (
        "swarm-rover.rover.service",
        "/rover/driver",
        "/dev/swarm/rover",
    )
    assert robot.command == "/rover/cmd_vel"
    assert robot.takes == ("/rover/gate/cmd_vel", COMMAND_TYPE)
    assert [(one.name, one.type, one.rate) for one in robot.topics] == [
        ("/rover/lwheel", "std_msgs/Int32", 10.0),
        ("/rover/rwheel", "std_msgs/Int32", 10.0),
    ]


def test_its_node_is_a_child_of_its_unit_and_no_second_driver(spec: Path) -> None:
    robot = rover(spec)
    unit = UnitState("loaded", "active", "running", "success", "", 42, 0, 0, False)
    node = NodeSeen(
        registered=True,
        alive=True,
        uri=f"http://{ADDRESS}:40001/",
        pid=57,
        error="",
        publishes={topic.name: topic.type for topic in robot.topics},
        subscribes={robot.takes[0]: robot.takes[1]},
        topics={},
        report=None,
    )
    assert driver.verdict(robot, rover_pi(spec), unit, node).fine
