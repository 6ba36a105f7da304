"""Programs in ``status``: their unit, node and topics; one skipped on purpose is reported as no problem."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from swarmctl.health.checks import State
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import ExpectedGraph, Release, expected_graph
from swarmctl.health.observations import Answer, MasterSeen, NodeSeen
from swarmctl.health.probe_request import request
from swarmctl.health.root_cause import Finding
from swarmctl.health.swarm_health import status
from swarmctl.render.build_bundle import bundles
from swarmctl.rules.runner import load_swarm
from swarmctl.views.status import table
from tests import ROOT
from tests.health.swarm_values import RUNNING

SPEC = ROOT / "tests/render/programs.yaml"
DECLARED = """\
    publishes: [{topic: scan, type: sensor_msgs/LaserScan}]
    subscribes: [{topic: odom, type: nav_msgs/Odometry}]
"""


@pytest.fixture(scope="module")
def graph(tmp_path_factory: pytest.TempPathFactory) -> ExpectedGraph:
    spec = tmp_path_factory.mktemp("spec") / "swarm.yaml"
    spec.write_text(SPEC.read_text("utf-8").replace("    memory_mb: 100\n", DECLARED), "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    releases = {
        name: Release(one.digest, tuple(unit.name for unit in one.units))
        for name, one in bundles(swarm).items()
    }
    return expected_graph(swarm, releases)


JOYSTICK = NodeSeen(
    True, True, "http://10.0.0.1:4001/", 1, "",
    {"/koala/cmd_vel": "geometry_msgs/Twist", "/k_3/cmd_vel": "geometry_msgs/Twist"}, {}, {}, None,
)  # fmt: skip
WANDER = replace(
    JOYSTICK, uri="http://10.0.0.2:4001/", publishes={"/k_3/laser": "sensor_msgs/LaserScan"},
    subscribes={"/k_3/odom": "nav_msgs/Odometry"},
)  # fmt: skip
MAP = "swarm-prog.map.service"


def about(program: str, graph: ExpectedGraph, *, units: Any = (), **nodes: NodeSeen) -> Finding:
    """What is found of a program when the hosts say so."""
    (finding,) = (one for one in diagnose(graph, answers(graph, dict(units), nodes)).findings
                  if one.program == program)  # fmt: skip
    return finding


def answers(graph: ExpectedGraph, units: dict[str, Any], nodes: dict[str, NodeSeen]) -> dict[str, Any]:
    seen = {"/joystick": nodes.get("joystick", JOYSTICK), "/k_3/wander": nodes.get("wander", WANDER)}
    return {
        host.name: Answer(
            release=host.release.digest,
            units={name: units.get(name, RUNNING) for name in host.release.units},
            master=MasterSeen(True, "", "run-1", 0.001),
            nodes=seen,
        )
        for host in graph.hosts
    }


def test_a_program_whose_unit_node_and_topics_are_there_is_well(graph: ExpectedGraph) -> None:
    for program in ("joystick", "wander", "map"):
        assert about(program, graph).state is State.OK, about(program, graph)


def test_nobody_expects_a_program_that_a_person_starts(graph: ExpectedGraph) -> None:
    assert "keys" not in {one.name for host in graph.hosts for one in host.programs}


def test_the_nodes_of_programs_are_probed(graph: ExpectedGraph) -> None:
    probed = {host.name: [one["name"] for one in request(graph, host, 2.0)["nodes"]] for host in graph.hosts}
    assert "/joystick" in probed["laptop"]
    assert "/k_3/wander" in probed["pi"]
    assert "" not in probed["laptop"]


@pytest.mark.parametrize(
    ("program", "node", "state", "words"),
    [
        ("joystick", replace(JOYSTICK, registered=False), State.BAD, "/joystick is not registered"),
        ("joystick", replace(JOYSTICK, alive=False, error="no answer"), State.BAD, "does not answer"),
        ("joystick", replace(JOYSTICK, uri="http://10.0.0.9:1/"), State.BAD, "10.0.0.9 instead of 10.0.0.1"),
        ("joystick", replace(JOYSTICK, publishes={}), State.BAD, "does not publish /koala/cmd_vel"),
        ("wander", replace(WANDER, publishes={"/k_3/laser": "std_msgs/String"}), State.BAD,
         "has type std_msgs/String instead of sensor_msgs/LaserScan"),
        ("wander", replace(WANDER, subscribes={}), State.WARNING, "does not subscribe to /k_3/odom"),
    ],
)  # fmt: skip
def test_a_problem_of_a_node_is_reported(
    program: str, node: NodeSeen, state: State, words: str, graph: ExpectedGraph
) -> None:
    finding = about(program, graph, **{program: node})
    assert finding.state is state
    assert words in finding.message


def test_a_skipped_optional_program_is_no_trouble(graph: ExpectedGraph) -> None:
    skipped = replace(RUNNING, active="inactive", sub="dead", skipped=True)
    finding = about("map", graph, units={MAP: skipped})
    assert finding.state is State.SKIPPED
    assert finding.message == "is skipped: host laptop lacks one of the ROS packages gmapping, tf"
    assert "ros-noetic-gmapping" in finding.hint


def test_an_optional_program_that_fails_is_a_warning(graph: ExpectedGraph) -> None:
    finding = about("map", graph, units={MAP: replace(RUNNING, active="failed", sub="failed")})
    assert finding.state is State.WARNING


def test_a_failed_program_explains_itself_once(graph: ExpectedGraph) -> None:
    failed = replace(RUNNING, active="failed", sub="failed", result="exit-code")
    found = diagnose(graph, answers(graph, {"swarm-prog.wander.service": failed}, {})).findings
    assert [one.subject for one in found if "exit-code" in one.message] == ["wander"]


def test_each_program_has_a_row_below_the_robots_of_its_host(graph: ExpectedGraph) -> None:
    skipped = replace(RUNNING, active="inactive", sub="dead", skipped=True)
    seen = answers(graph, {MAP: skipped}, {})
    lines = table(status(graph, seen, diagnose(graph, seen)).hosts).plain.splitlines()
    row = {line.split()[0]: line.split() for line in lines}
    assert row["joystick"][1:4] == ["ok", "running", "/joystick"]
    assert row["map"][1:3] == ["skipped", "skipped"]
    assert [line.split()[0] for line in lines[2:5]] == ["koala", "joystick", "map"]
