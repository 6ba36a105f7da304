"""A robot whose board speaks rosserial: what is expected of its driver, ours or rosserial_python."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.health import checks, command_sources
from swarmctl.health.checks import State
from swarmctl.health.expected_graph import ExpectedHost, ExpectedRobot, Release, expected_graph
from swarmctl.health.observations import Answer, NodeSeen, SenderSeen, UnitSeen
from swarmctl.rules.runner import load_swarm
from swarmctl.swarm.topics import COMMAND_TYPE
from tests import ROOT

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
    assert [(one.name, one.type, one.rate) for one in robot.topics] == [
        ("/rover/lwheel", "std_msgs/Int32", 10.0),
        ("/rover/rwheel", "std_msgs/Int32", 10.0),
    ]


def test_an_unauthorised_publisher_that_is_obeyed_is_bad(spec: Path) -> None:
    robot = rover(spec)
    stranger = SenderSeen("192.168.77.99", {robot.command: COMMAND_TYPE})
    hub = Answer(commanders={robot.command: ("/rostopic_7",)}, senders={"/rostopic_7": stranger})
    verdict = command_sources.unauthorised(robot, hub)
    assert verdict.state is State.BAD
    assert "/rostopic_7 on 192.168.77.99" in verdict.message
    assert "obeys any publisher" in verdict.message
    assert "allowed now: keys" in verdict.hint


def test_its_node_is_a_child_of_its_unit_and_no_second_driver(spec: Path) -> None:
    robot = rover(spec)
    unit = UnitSeen("loaded", "active", "running", "success", "", 42, 0, 0, False)
    node = NodeSeen(
        registered=True,
        alive=True,
        uri=f"http://{ADDRESS}:40001/",
        pid=57,
        error="",
        publishes={topic.name: topic.type for topic in robot.topics},
        subscribes={robot.command: COMMAND_TYPE},
        topics={},
        report=None,
    )
    assert checks.driver(robot, rover_pi(spec), unit, node).fine
