"""Programs in ``status``: their unit, node and topics; one skipped on purpose is reported as no problem."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.images import Image
from swarm_onboard.agent.observations import EndedSeen, LaunchedSeen, MasterSeen, NodeSeen, TopicSeen
from swarm_onboard.agent.paths import trial_file
from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.collect import request
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import ExpectedGraph, Release, expected_graph
from swarmctl.health.root_cause import Finding
from swarmctl.health.swarm_health import status
from swarmctl.health.verdict import State
from swarmctl.render.build_bundle import bundles
from swarmctl.swarm.resolved import Swarm
from swarmctl.views.status import table
from tests import ROOT
from tests.health.swarm_values import RUNNING
from tests.loading import load_swarm

SPEC = ROOT / "tests/render/programs.yaml"
DECLARED = """\
    publishes: [{topic: scan, type: sensor_msgs/LaserScan, rate: 10}]
    subscribes: [{topic: odom, type: nav_msgs/Odometry}]
    provides: [{name: ~look, type: std_srvs/srv/Trigger}]
"""
MEMORY = "    memory_mb: 300\n"
LAUNCHED = """\
    publishes: [{topic: map, type: nav_msgs/OccupancyGrid, rate: 1}]
    subscribes: [{topic: /tf, type: tf2_msgs/TFMessage}]
    provides: [{name: explore, type: explore_msgs/action/Explore}]
"""


@pytest.fixture(scope="module")
def graph(tmp_path_factory: pytest.TempPathFactory) -> ExpectedGraph:
    spec = tmp_path_factory.mktemp("spec") / "swarm.yaml"
    spec.write_text(
        SPEC.read_text("utf-8").replace("    memory_mb: 100\n", DECLARED).replace(MEMORY, LAUNCHED), "utf-8"
    )
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return expected(swarm)


def expected(swarm: Swarm) -> ExpectedGraph:
    releases = {
        name: Release(one.digest, tuple(unit.name for unit in one.units))
        for name, one in bundles(swarm).items()
    }
    return expected_graph(swarm, releases)


JOYSTICK = NodeSeen(
    True, True, "http://10.0.0.1:4001/", 1, "",
    {"/koala/cmd_vel": "geometry_msgs/Twist", "/k_3/cmd_vel": "geometry_msgs/Twist"}, {}, {}, None,
)  # fmt: skip
SCAN, GRID, TF = "sensor_msgs/LaserScan", "nav_msgs/OccupancyGrid", "tf2_msgs/TFMessage"
EXPLORE = "explore_msgs/action/Explore"
MEASURED = TopicSeen(20, 10.0, 2.0, SCAN, "", 0.1)
WANDER = JOYSTICK._replace(uri="http://10.0.0.2:4001/", publishes={"/k_3/laser": "sensor_msgs/LaserScan"},
    subscribes={"/k_3/odom": "nav_msgs/Odometry"}, topics={"/k_3/laser": MEASURED},
    provides={"/k_3/wander/look": ""},
)  # fmt: skip
GMAPPING = JOYSTICK._replace(publishes={"/map": GRID}, subscribes={"/tf": TF},
    topics={"/map": TopicSeen(3, 1.0, 2.5, GRID, "", 0.5)}, provides={"/explore": EXPLORE},
)  # fmt: skip
MAPPING = LaunchedSeen({"/slam": GMAPPING}, {"/slam": 1}, {}, "")
MAP = "swarm-prog.map.service"
NO_NODES = LaunchedSeen({}, (), {}, "")


def about(
    program: str, graph: ExpectedGraph, *, units: Any = (), launched: LaunchedSeen = MAPPING,
    check: str = "program", **nodes: NodeSeen,
) -> Finding:  # fmt: skip
    """What is found of a program when the hosts say so."""
    found = diagnose(graph, answers(graph, dict(units), nodes, launched)).findings
    (finding,) = (one for one in found if (one.program, one.check) == (program, check))
    return finding


def answers(
    graph: ExpectedGraph, units: dict[str, Any], nodes: dict[str, NodeSeen], launched: LaunchedSeen = MAPPING
) -> dict[str, Any]:
    seen = {"/joystick": nodes.get("joystick", JOYSTICK), "/k_3/wander": nodes.get("wander", WANDER)}
    return {
        host.name: Answer(
            release=host.release.digest,
            units={name: units.get(name, RUNNING) for name in host.release.units},
            master=MasterSeen(True, "", "run-1", 0.001),
            nodes=seen,
            launched={MAP: launched},
        )
        for host in graph.hosts
    }


def test_a_program_whose_unit_node_and_topics_are_there_is_well(graph: ExpectedGraph) -> None:
    for program in ("joystick", "wander", "map"):
        assert about(program, graph).state is State.OK, about(program, graph)


def test_nobody_expects_a_program_that_a_person_starts(graph: ExpectedGraph) -> None:
    assert "keys" not in {one.name for host in graph.hosts for one in host.programs}


def test_the_nodes_of_programs_are_probed(graph: ExpectedGraph) -> None:
    probed = {host.name: list(request(graph, host, 2.0).nodes) for host in graph.hosts}
    assert "/joystick" in probed["laptop"]
    assert "/k_3/wander" in probed["pi"]
    assert "" not in probed["laptop"]
    units = {host.name: request(graph, host, 2.0).skippable for host in graph.hosts}
    assert units["laptop"]["/joystick"] in graph.hosts[0].release.units
    assert all(units[name].keys() <= set(nodes) and "" not in units[name] for name, nodes in probed.items())


def test_topics_with_a_rate_are_measured(graph: ExpectedGraph) -> None:
    laptop, pi = (request(graph, host, 2.0) for host in graph.hosts)
    assert pi.nodes["/k_3/wander"] == {"/k_3/laser": 2.0}
    assert laptop.launched[MAP] == {"/map": 2.5, "/tf": 0.0, "/explore": 0.0}
    assert (laptop.provides, pi.provides) == (["/explore"], ["/k_3/wander/look"])


@pytest.mark.parametrize(
    ("program", "node", "state", "words"),
    [
        ("joystick", JOYSTICK._replace(registered=False), State.BAD, "/joystick is not registered"),
        ("joystick", JOYSTICK._replace(alive=False, error="no answer"), State.BAD, "does not answer"),
        ("joystick", JOYSTICK._replace(uri="http://10.0.0.9:1/"), State.BAD, "10.0.0.9 instead of 10.0.0.1"),
        ("joystick", JOYSTICK._replace(publishes={}), State.BAD, "does not publish /koala/cmd_vel"),
        ("wander", WANDER._replace(publishes={"/k_3/laser": "std_msgs/String"}), State.BAD,
         "has type std_msgs/String instead of sensor_msgs/LaserScan"),
        ("wander", WANDER._replace(subscribes={}), State.WARNING, "does not subscribe to /k_3/odom"),
        ("wander", WANDER._replace(provides={}), State.BAD, "does not provide /k_3/wander/look"),
        ("wander", WANDER._replace(provides={"/k_3/wander/look": "std_srvs/srv/Empty"}), State.BAD,
         "has type std_srvs/srv/Empty instead of std_srvs/srv/Trigger"),
    ],
)  # fmt: skip
def test_a_problem_of_a_node_is_reported(
    program: str, node: NodeSeen, state: State, words: str, graph: ExpectedGraph
) -> None:
    finding = about(program, graph, **{program: node})
    assert finding.state is state
    assert words in finding.message


def test_the_ros_variables_of_a_program_explain_its_node(graph: ExpectedGraph) -> None:
    program = next(one for host in graph.hosts for one in host.programs if one.name == "joystick")
    wrong = JOYSTICK._replace(alive=False, error="network is unreachable", uri="http://10.9.9.9:4001/")
    seen = answers(graph, {}, {"joystick": wrong})
    differs = {program.unit: ("ROS_IP is 10.9.9.9 instead of 10.0.0.1",)}
    seen[program.host] = seen[program.host]._replace(environments=differs)
    found = {one.key: one for one in diagnose(graph, seen).findings}
    assert found["environment joystick"].message.startswith("ROS_IP is 10.9.9.9 instead of 10.0.0.1: ")
    assert found["program joystick"].cause == "environment joystick"


def test_a_skipped_optional_program_is_no_trouble(graph: ExpectedGraph) -> None:
    skipped = RUNNING._replace(active="inactive", sub="dead", skipped=True)
    finding = about("map", graph, units={MAP: skipped})
    assert finding.state is State.SKIPPED
    assert finding.message == "is skipped: host laptop lacks one of the ROS packages gmapping, tf"
    assert "ros-noetic-gmapping" in finding.hint


def test_an_optional_program_that_fails_is_a_warning(graph: ExpectedGraph) -> None:
    finding = about("map", graph, units={MAP: RUNNING._replace(active="failed", sub="failed")})
    assert finding.state is State.WARNING


@pytest.mark.parametrize(
    ("active", "sub", "result", "state", "words"),
    [
        ("active", "exited", "success", State.OK, "ended with exit code 0"),
        ("active", "running", "success", State.OK, "runs"),
        ("failed", "failed", "exit-code", State.BAD, "exit-code"),
    ],
)
def test_status_checks_the_exit_code_of_a_oneshot(
    active: str, sub: str, result: str, *, state: State, words: str, graph: ExpectedGraph
) -> None:
    seen = RUNNING._replace(active=active, sub=sub, result=result)
    finding = about("calibrate", graph, units={"swarm-prog.calibrate.service": seen})
    assert (finding.state, words in finding.message) == (state, True)


CALIBRATE = "swarm-prog.calibrate.service"
IN_NO_TRIAL = UnitState(
    "loaded", "inactive", "dead", "success", "", 0, 0, skipped=True,
    unmet=(f"ConditionPathExists={trial_file(CALIBRATE)}",),
)  # fmt: skip


@pytest.mark.parametrize(
    ("seen", "state", "words"),
    [
        (IN_NO_TRIAL, State.OK, "waits for a trial"),
        (IN_NO_TRIAL._replace(unmet=(*IN_NO_TRIAL.unmet, "ConditionPathExists=/x")), State.SKIPPED, "/x"),
        (UnitState("loaded", "inactive", "dead", "success", "", 0, 0), State.OK, "has ended"),
        (UnitState("loaded", "deactivating", "stop-sigterm", "success", "", 9, 0), State.OK, "has ended"),
        (UnitState("loaded", "deactivating", "stop-sigkill", "timeout", "", 9, 0), State.BAD, "does not run"),
        (UnitState("masked", "inactive", "dead", "success", "", 0, 0), State.BAD, "does not run"),
        (
            UnitState("loaded", "failed", "failed", "exit-code", "", 0, 0),
            State.WARNING,
            "in its last trial it",
        ),
        (UnitState("loaded", "active", "running", "success", "", 9, 0), State.OK, "runs"),
        (UnitState("not-found", "inactive", "dead", "success", "", 0, 0), State.BAD, "does not exist"),
    ],
)
def test_a_program_that_runs_in_trials_alone_need_not_run(
    tmp_path: Path, seen: UnitState, state: State, words: str
) -> None:
    spec = tmp_path / "swarm.yaml"
    once = "executable: calibrate.py, publishes: [{topic: turns, type: std_msgs/Int32, rate: 10}]"
    text = SPEC.read_text("utf-8").replace("lifecycle: oneshot, package", "lifecycle: trial, package")
    spec.write_text(text.replace("executable: calibrate.py", once), "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    finding = about("calibrate", expected(swarm), units={CALIBRATE: seen})
    assert (finding.state, words in finding.message) == (state, True), finding


def test_a_program_that_waits_is_a_warning_with_its_reason(graph: ExpectedGraph) -> None:
    absent = "waits for the joystick: /dev/input/js0: it is not plugged in"
    unit, waits = "swarm-prog.joystick.service", RUNNING._replace(text=absent)
    seen = answers(graph, {unit: waits}, {})
    found = diagnose(graph, seen)
    finding = about("joystick", graph, units={unit: waits})
    assert (finding.state, finding.message) == (State.WARNING, absent)
    lines = table(status(graph, seen, found).hosts).plain.splitlines()
    (row,) = (line for line in lines if line.strip().startswith("joystick"))
    assert row.split()[:3] == ["joystick", "warning", "running"]
    assert row.endswith(f'program  "{absent}"')
    ready = RUNNING._replace(text="ready: hold the dead-man button to drive")
    assert about("joystick", graph, units={unit: ready}).state is State.OK
    gone = JOYSTICK._replace(registered=False)
    assert about("joystick", graph, units={unit: waits}, joystick=gone).state is State.BAD


def test_a_failed_program_explains_itself_once(graph: ExpectedGraph) -> None:
    failed = RUNNING._replace(active="failed", sub="failed", result="exit-code")
    found = diagnose(graph, answers(graph, {"swarm-prog.wander.service": failed}, {})).findings
    assert [one.subject for one in found if "exit-code" in one.message] == ["wander"]


def test_each_program_has_a_row_below_the_robots_of_its_host(graph: ExpectedGraph) -> None:
    skipped = RUNNING._replace(active="inactive", sub="dead", skipped=True)
    seen = answers(graph, {MAP: skipped}, {})
    lines = table(status(graph, seen, diagnose(graph, seen)).hosts).plain.splitlines()
    row = {line.split()[0]: line.split() for line in lines}
    assert row["joystick"][1:4] == ["ok", "running", "/joystick"]
    assert row["map"][1:3] == ["skipped", "skipped"]
    assert row["wander"][3:] == ["/k_3/wander", "program", "laser", "10.0"]
    assert [line.split()[0] for line in lines[2:5]] == ["koala", "joystick", "map"]


@pytest.mark.parametrize(
    ("seen", "state", "words"),
    [
        (TopicSeen(8, 3.9, 2.0, SCAN, "", 0.1), State.BAD, "measured 3.9 Hz of 10"),
        (TopicSeen(8, 3.9, 2.0, SCAN, "", 1.2), State.BAD, "of 10, the last message 1.2 s ago"),
        (TopicSeen(0, None, 2.0, SCAN, ""), State.BAD, "no message in 2 s, 10 Hz expected"),
        (TopicSeen(0, None, 2.0, SCAN, "connection refused"), State.BAD, "cannot be received"),
        (MEASURED, State.OK, "measured 10.0 Hz of 10"),
    ],
)
def test_a_topic_is_judged_as_that_of_a_robot(
    seen: TopicSeen, state: State, words: str, graph: ExpectedGraph
) -> None:
    finding = about("wander", graph, check="topic", wander=WANDER._replace(topics={"/k_3/laser": seen}))
    assert finding.state is state
    assert words in finding.message


def test_the_topic_of_a_launch_file_is_measured(graph: ExpectedGraph) -> None:
    slow = GMAPPING._replace(topics={"/map": TopicSeen(2, 0.4, 5.0, GRID, "", 2.0)})
    optional = about("map", graph, check="topic", launched=MAPPING._replace(nodes={"/slam": slow}))
    assert optional.state is State.WARNING
    assert "measured 0.4 Hz of 1" in optional.message


@pytest.mark.parametrize(
    ("launched", "state", "words"),
    [
        (MAPPING._replace(ended={"/once": EndedSeen("exit code 0", 4.0)}), State.OK, "runs"),
        (MAPPING._replace(ended={"/gone": EndedSeen("exit code 0", 900.0)}), State.BAD,
         "node /gone has ended (exit code 0) and is not started again"),
        (MAPPING._replace(ended={"/gone": EndedSeen("exit code -9", 4.0)}), State.BAD,
         "node /gone has ended (exit code -9)"),
        (MAPPING._replace(ended={"/gone": EndedSeen("", None)}), State.WARNING, "node /gone has ended and"),
        (MAPPING._replace(nodes={"/slam": GMAPPING._replace(alive=False, error="no answer")}), State.BAD,
         "/slam is registered, but does not answer (no answer)"),
        (MAPPING._replace(nodes={"/slam": GMAPPING._replace(uri="http://10.0.0.2:1/")}), State.BAD,
         "/slam advertises 10.0.0.2 instead of 10.0.0.1"),
        (MAPPING._replace(nodes={"/slam": GMAPPING._replace(publishes={})}), State.BAD,
         "none of its nodes publishes /map"),
        (MAPPING._replace(nodes={"/slam": GMAPPING._replace(publishes={"/map": TF})}), State.BAD,
         "/map has type tf2_msgs/TFMessage instead of nav_msgs/OccupancyGrid"),
        (MAPPING._replace(nodes={"/slam": GMAPPING._replace(subscribes={})}), State.WARNING,
         "none of its nodes subscribes to /tf"),
        (MAPPING._replace(nodes={"/slam": GMAPPING._replace(provides={})}), State.BAD,
         "none of its nodes provides /explore"),
        (MAPPING._replace(error="no answer within 2 s"), State.UNKNOWN, "were not found: no answer"),
        (MAPPING._replace(starts={"/slam": 1, "/a_script": 1}), State.OK, "runs"),
    ],
)  # fmt: skip
def test_a_problem_of_a_launched_node_is_reported(
    launched: LaunchedSeen, state: State, words: str, graph: ExpectedGraph
) -> None:
    (program,) = (one for one in graph.hosts[0].programs if one.name == "map")
    needed = replace(graph.hosts[0], programs=(replace(program, optional=False),))
    finding = about("map", replace(graph, hosts=(needed, graph.hosts[1])), launched=launched)
    assert finding.state is state
    assert words in finding.message


SEEING = "swarm-prog.seeing.service"
IMAGE = "docker.io/library/seeing@sha256:" + "1" * 64
LOOPS = RUNNING._replace(active="activating", sub="auto-restart", restarts=2, exit="exit code 1")


def seeing(graph: ExpectedGraph, image: Image, unit: UnitState = RUNNING) -> Finding:
    """What is found of a container when its image and its unit are so."""
    seen = answers(graph, {SEEING: unit}, {})
    seen["laptop"] = seen["laptop"]._replace(
        images={SEEING: image}, launched={MAP: MAPPING, SEEING: NO_NODES}
    )
    (finding,) = (one for one in diagnose(graph, seen).findings if one.program == "seeing")
    return finding


def test_the_images_of_containers_are_probed(graph: ExpectedGraph) -> None:
    laptop, pi = (request(graph, host, 2.0).images for host in graph.hosts)
    assert laptop == {SEEING: ("podman", IMAGE)}
    assert pi == {}


def test_a_container_without_its_image_is_never_well(graph: ExpectedGraph) -> None:
    """Its unit runs for minutes while the engine pulls the image, or tries to."""
    for unit in (RUNNING, LOOPS):
        finding = seeing(graph, Image(False, "", "x86_64", ""), unit)
        assert finding.state is State.BAD
        assert finding.message == f"its image is not on host laptop: {IMAGE}"
        assert f"on laptop: sudo podman pull {IMAGE}" in finding.hint


@pytest.mark.parametrize(
    ("built_for", "machine", "unit", "words"),
    [
        ("amd64", "x86_64", RUNNING, "runs"),
        ("arm64", "x86_64", RUNNING, "runs"),  # an emulator runs it
        ("amd64", "x86_64", LOOPS, "crash loop: restarted 2 times, last result exit code 1"),
        ("arm64", "x86_64", LOOPS, "its image is built for arm64, and host laptop is x86_64: crash loop"),
        ("amd64", "armv7l", LOOPS, "its image is built for amd64, and host laptop is armv7l: crash loop"),
        ("arm", "aarch64", LOOPS, "crash loop"),
        ("riscv64", "riscv64", LOOPS, "crash loop"),
    ],
)
def test_an_image_for_another_machine_is_named_where_it_fails(
    built_for: str, machine: str, unit: UnitState, words: str, graph: ExpectedGraph
) -> None:
    finding = seeing(graph, Image(True, built_for, machine, ""), unit)
    assert finding.message.startswith(words)
    assert (finding.state is State.OK) == (unit is RUNNING)


def test_an_engine_that_does_not_answer_is_no_fault_while_it_runs(graph: ExpectedGraph) -> None:
    silent = Image(False, "", "x86_64", "podman did not answer within 10 s")
    assert seeing(graph, silent).state is State.OK
    assert seeing(graph, silent, LOOPS).message.endswith("; podman did not answer within 10 s")
