"""Status of a robot whose driver is a launch file: its nodes are known only once they run."""

from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent.observations import LaunchedSeen, NodeSeen, TopicSeen
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.checks import driver, topic
from swarmctl.health.collect import request
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, Release, expected_graph
from swarmctl.health.launched_nodes import publisher
from swarmctl.health.root_cause import Diagnosis
from swarmctl.health.swarm_health import status
from swarmctl.health.verdict import State
from swarmctl.views.status import table
from tests.loading import load_swarm

SPEC = """
version: 1
name: lab
mode: central
hub: tb3-01
hosts: {tb3-01: {address: 192.168.77.21}}
robots: {tb3-01: {type: turtlebot3-burger, host: tb3-01}}
"""
CORE = "/tb3_01/turtlebot3_core"


@pytest.fixture
def host(tmp_path: Path) -> ExpectedHost:
    (tmp_path / "swarm.yaml").write_text(SPEC, "utf-8")
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None, found
    graph = expected_graph(swarm, {"tb3-01": Release("a" * 16, ())})
    wanted = request(graph, graph.hosts[0], 2.0)
    assert list(wanted.nodes) == ["/tb3_01/gate"]
    assert wanted.launched["swarm-lab.tb3-01.service"]["/tb3_01/imu"] == 0.0
    assert wanted.devices == []
    return graph.hosts[0]


def launched(command: str = "/tb3_01/gate/cmd_vel", **topics: str) -> LaunchedSeen:
    published = {f"/tb3_01/{name}": kind for name, kind in topics.items()}
    node = NodeSeen(
        True, True, "http://192.168.77.21:4000/", 7, "", published, {command: "geometry_msgs/Twist"}, {}, None
    )
    return LaunchedSeen({CORE: node}, {CORE: 1}, {}, "")


def test_its_nodes_are_named(host: ExpectedHost) -> None:
    verdict = driver.launched(host.robots[0], host, launched())
    assert (verdict.state, verdict.message) == (State.OK, f"{CORE} runs")


def test_a_launch_file_whose_nodes_are_not_known_runs(host: ExpectedHost) -> None:
    verdict = driver.launched(host.robots[0], host, launched()._replace(starts={}))
    assert (verdict.state, verdict.message) == (State.OK, "its launch file runs")


def test_a_driver_that_takes_commands_beside_its_gate_is_named(host: ExpectedHost) -> None:
    verdict = driver.launched(host.robots[0], host, launched(command="/tb3_01/cmd_vel"))
    text = "none of its nodes subscribes to /tb3_01/gate/cmd_vel"
    assert (verdict.state, verdict.message) == (State.WARNING, text)


def test_a_topic_without_a_rate_is_only_looked_for(host: ExpectedHost) -> None:
    imu = next(one for one in host.robots[0].topics if one.name == "/tb3_01/imu")
    right, none, wrong = (
        topic.verdict(imu, publisher(imu.name, seen))
        for seen in (launched(imu="sensor_msgs/Imu"), launched(), launched(imu="std_msgs/String"))
    )
    assert right.state is State.OK
    assert none.message == "is not published"
    assert (wrong.state, wrong.message) == (State.BAD, "has type std_msgs/String instead of sensor_msgs/Imu")


def test_its_measured_rates_are_in_its_row(host: ExpectedHost) -> None:
    odom, seen = "/tb3_01/odom", launched(odom="nav_msgs/Odometry")
    topics = {odom: TopicSeen(59, 29.6, 2.0, "nav_msgs/Odometry", "", 0.1)}
    measured = seen.nodes[CORE]._replace(topics=topics)
    answer = Answer(launched={host.robots[0].unit: seen._replace(nodes={CORE: measured})})
    graph = ExpectedGraph("lab", (host,))
    hosts = status(graph, {host.name: answer}, Diagnosis(())).hosts
    (row,) = hosts[0].robots
    assert next(one.rate for one in row.topics if one.name == odom) == 29.6
    assert "odom 29.6  imu -  battery_state -" in table(hosts).plain
