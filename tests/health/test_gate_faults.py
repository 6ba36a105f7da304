"""Status of robots with a gate in front of a vendor's driver, and of one without."""

from __future__ import annotations

import pytest
from swarm_onboard.agent.observations import ConflictSeen, MasterSeen, NodeSeen, Report, SenderSeen, TopicSeen
from swarm_onboard.agent.stop_latches import Latch
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedRobot, Release, expected_graph
from swarmctl.health.root_cause import Finding
from swarmctl.health.swarm_health import status
from swarmctl.health.verdict import State
from swarmctl.render.build_bundle import bundles
from swarmctl.swarm.command_topics import COMMAND_TYPE
from swarmctl.swarm.topics import DIAGNOSTICS
from tests.health.swarm_values import RUNNING
from tests.loading import load_swarm

SPEC = """\
version: 1
name: lab
mode: single-minded
leader: laptop
hosts:
  laptop: {address: 192.168.77.10}
types:
  vendor:
    title: a vendor's robot
    driver: {package: vendor_driver, executable: node}
    kinematics: {kind: differential, linear_max: 0.22, angular_max: 2.84}
  copter:
    title: a copter
    driver: {package: copter_driver, executable: node, ungated: true, reason: it takes setpoints}
    kinematics: {kind: aerial, linear_max: 2.0, angular_max: 1.0}
robots:
  tb: {type: vendor, host: laptop}
  uav: {type: copter, host: laptop}
control: [{by: laptop, of: [tb, uav]}]
"""
GATE, DRIVER, OUTPUT, COMMAND = "/tb/gate", "/tb/driver", "/tb/gate/cmd_vel", "/tb/cmd_vel"
UNIT = "swarm-lab.tb.gate.service"
STRANGER = SenderSeen("192.168.77.99", {COMMAND: COMMAND_TYPE, "/uav/cmd_vel": COMMAND_TYPE})
REFUSING = Report(1, "refuses /x", "nobody", ("/x",))


@pytest.fixture(scope="module")
def graph(tmp_path_factory: pytest.TempPathFactory) -> ExpectedGraph:
    spec = tmp_path_factory.mktemp("spec") / "swarm.yaml"
    spec.write_text(SPEC)
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    units = tuple(one.name for one in bundles(swarm)["laptop"].units)
    return expected_graph(swarm, {"laptop": Release("a" * 16, units)})


def well(graph: ExpectedGraph) -> Answer:
    (host,) = graph.hosts
    nodes = {robot.node: node(subscribes={robot.takes[0]: robot.takes[1]}) for robot in host.robots}
    gate = node(
        subscribes={COMMAND: COMMAND_TYPE},
        publishes={OUTPUT: COMMAND_TYPE, DIAGNOSTICS: "diagnostic_msgs/DiagnosticArray"},
        report=Report(0, "standing still: no accepted command yet", "laptop (/teleop)"),
        topics={DIAGNOSTICS: TopicSeen(3, 1.0, 3.0, "diagnostic_msgs/DiagnosticArray", "")},
    )
    return Answer(
        release="a" * 16,
        units=dict.fromkeys(host.release.units, RUNNING),
        master=MasterSeen(True, "", "run-1", 0.001),
        nodes={**nodes, GATE: gate},
        commanders={COMMAND: (), OUTPUT: (GATE,), "/uav/cmd_vel": ()},
        receivers={COMMAND: (GATE, "/recorder"), OUTPUT: (DRIVER,), "/uav/cmd_vel": ("/uav/driver",)},
        clock_ahead=0.1,
        boot_id="1",
    )


def node(**changes: object) -> NodeSeen:
    seen = NodeSeen(
        registered=True, alive=True, uri="http://192.168.77.10:40001/", pid=42, error="", publishes={},
        subscribes={}, topics={}, report=None,
    )  # fmt: skip
    return seen._replace(**changes)  # type: ignore[arg-type]


def findings(graph: ExpectedGraph, answer: Answer) -> dict[str, Finding]:
    """What is not ok."""
    found = diagnose(graph, {"laptop": answer}).findings
    return {one.key: one for one in found if one.state not in (State.OK, State.SKIPPED)}


def robot(graph: ExpectedGraph, name: str) -> ExpectedRobot:
    return next(one for one in graph.robots if one.name == name)


def test_a_healthy_gate_raises_no_finding(graph: ExpectedGraph) -> None:
    assert findings(graph, well(graph)) == {}


def test_status_shows_whom_the_gate_obeys(graph: ExpectedGraph) -> None:
    answers = {"laptop": well(graph)}
    (host,) = status(graph, answers, diagnose(graph, answers)).hosts
    assert host.robots[0].commander == "laptop (/teleop)"


def test_a_stopped_robot_is_named_and_is_no_fault(graph: ExpectedGraph) -> None:
    answer = well(graph)._replace(latches={"tb": Latch("me@desk (1)", 1_700_000_000.0)})
    found = findings(graph, answer)
    assert list(found) == ["stop tb"]
    assert found["stop tb"].state is State.WARNING
    assert found["stop tb"].message.startswith("stopped by me@desk (1) since 2023-11-1")
    assert found["stop tb"].hint == "`swarmctl start SPEC tb` lets it obey again"
    assert diagnose(graph, {"laptop": answer}).healthy


def test_what_a_gate_cannot_publish_is_a_warning_of_status(graph: ExpectedGraph) -> None:
    answer = well(graph)
    lost = Report(1, "standing still; no transform from map to tb/odom: this host lacks tf2_msgs", "")
    gate = answer.nodes[GATE]._replace(report=lost)
    found = findings(graph, answer._replace(nodes={**answer.nodes, GATE: gate}))
    assert {key: (one.state, one.message) for key, one in found.items()} == {
        "gate report tb": (State.WARNING, lost.message)
    }


def test_a_dead_gate_means_that_no_command_arrives(graph: ExpectedGraph) -> None:
    answer = well(graph)
    dead = node(registered=False, alive=None)
    found = findings(graph, answer._replace(nodes={**answer.nodes, GATE: dead}))
    assert found["gate tb"].state is State.BAD
    assert "commands do not reach the driver" in found["gate tb"].message


def test_a_gate_whose_unit_failed_is_a_symptom_of_that(graph: ExpectedGraph) -> None:
    answer = well(graph)
    failed = RUNNING._replace(active="failed", sub="failed", result="exit-code", pid=0)
    gone = node(registered=False, alive=None)
    spoilt = answer._replace(
        units={**answer.units, UNIT: failed},
        nodes={**answer.nodes, GATE: gone},
        commanders={**answer.commanders, OUTPUT: ()},
    )
    found = findings(graph, spoilt)
    assert found["gate tb"].cause == f"unit {UNIT} on laptop"


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"commanders": {OUTPUT: (GATE, "/x")}}, "/x on /tb/gate/cmd_vel: the driver obeys it past the gate"),
        (
            {"receivers": {COMMAND: (GATE, "/tb/core"), OUTPUT: (DRIVER,)}},
            "/tb/core subscribes to /tb/cmd_vel: it receives commands past the gate",
        ),
        ({"receivers": {COMMAND: (GATE,), OUTPUT: ()}}, "no node subscribes to /tb/gate/cmd_vel"),
    ],
)
def test_commands_beside_the_gate_are_bad_and_named(graph: ExpectedGraph, changes: dict, text: str) -> None:
    found = findings(graph, well(graph)._replace(**changes))
    assert found["wiring tb"].state is State.BAD
    assert text in found["wiring tb"].message


@pytest.mark.parametrize(("topic", "written"), [("/cmd_vel", "/cmd_vel"), (f"{DRIVER}/cmd_vel", "~cmd_vel")])
def test_a_driver_that_takes_commands_elsewhere_is_named(
    graph: ExpectedGraph, topic: str, written: str
) -> None:
    answer = well(graph)._replace(receivers={COMMAND: (GATE,), OUTPUT: (), topic: (DRIVER, "/recorder")})
    past = node(subscribes={topic: COMMAND_TYPE})
    found = findings(graph, answer._replace(nodes={**answer.nodes, DRIVER: past}))["wiring tb"]
    assert (found.state, found.cause) == (State.BAD, None)
    assert found.message.startswith(f"{DRIVER} takes commands on {topic} instead of {OUTPUT}")
    assert f"write `command: {written}`" in found.hint


@pytest.mark.parametrize(
    ("topic", "publishes", "state"),
    [
        ("/tb/cmd_vel_unstamped", True, State.BAD),
        ("/tb/speed_estimate", True, State.WARNING),
        ("/tb/cmd_vel_unstamped", False, None),
    ],
)
def test_a_second_input_of_the_driver_counts_once_it_is_used(
    graph: ExpectedGraph, topic: str, publishes: bool, state: State | None
) -> None:
    """MAVROS, for one, takes velocities on two topics."""
    answer = well(graph)
    answer = answer._replace(
        commanders={**answer.commanders, topic: ("/x", DRIVER)},
        receivers={**answer.receivers, topic: (DRIVER,)},
        senders={"/x": SenderSeen("192.168.77.99", {topic: COMMAND_TYPE} if publishes else {})},
    )
    found = findings(graph, answer).get("wiring tb")
    assert (found.state if found else None) is state
    assert found is None or found.message.startswith(f"/x on {topic}, to which {DRIVER} subscribes")


def test_a_killed_rival_that_the_master_lists_is_a_warning(graph: ExpectedGraph) -> None:
    """SIGKILL leaves its entry at the master: the driver receives nothing from it."""
    listed = well(graph)._replace(commanders={**well(graph).commanders, OUTPUT: (GATE, "/x")})
    killed = listed._replace(senders={"/x": SenderSeen("192.168.77.99", {})})
    found = findings(graph, killed)["wiring tb"]
    assert found.state is State.WARNING
    assert found.message.startswith("/x on /tb/gate/cmd_vel: listed by the master, but not answering")
    alive = listed._replace(senders={"/x": SenderSeen("192.168.77.99", {OUTPUT: COMMAND_TYPE})})
    assert findings(graph, alive)["wiring tb"].state is State.BAD


def test_a_driver_that_is_not_remapped_is_bad(graph: ExpectedGraph) -> None:
    answer = well(graph)
    past = node(subscribes={COMMAND: COMMAND_TYPE})
    found = findings(graph, answer._replace(nodes={**answer.nodes, DRIVER: past}))
    assert (
        found["driver tb"].message == "/tb/driver does not subscribe to /tb/gate/cmd_vel: "
        "no command that passes the gate reaches it"
    )


@pytest.mark.parametrize(
    ("report", "effect"),
    [
        (REFUSING, "; rejected by the gate"),
        (REFUSING._replace(refused=("/x2", "/y/x")), "; the gate has received no command of it"),
        (
            REFUSING._replace(refused=("/x2",), refused_all=False),
            "; the gate does not report whether it rejects it",
        ),
        (REFUSING._replace(refused=()), "; the gate has received no command of it"),
        (None, "; the gate does not report whether it rejects it"),
    ],
)
def test_only_what_the_gate_reports_is_called_rejected(
    graph: ExpectedGraph, report: Report | None, effect: str
) -> None:
    answer = well(graph)
    gate = answer.nodes[GATE]._replace(report=report)
    spoilt = answer._replace(
        nodes={**answer.nodes, GATE: gate},
        commanders={**answer.commanders, COMMAND: ("/x",)},
        senders={"/x": STRANGER},
    )
    found = findings(graph, spoilt)["authority tb"]
    assert found.state is State.WARNING
    assert found.message.endswith(effect)


def test_each_stranger_is_rejected_by_its_whole_name(graph: ExpectedGraph) -> None:
    answer = well(graph)
    spoilt = answer._replace(
        nodes={**answer.nodes, GATE: answer.nodes[GATE]._replace(report=REFUSING._replace(refused=("/x2",)))},
        commanders={**answer.commanders, COMMAND: ("/x", "/x2")},
        senders={"/x": STRANGER, "/x2": STRANGER},
    )
    message = findings(graph, spoilt)["authority tb"].message
    assert message.endswith("; /x2 rejected by the gate, the gate has received no command of /x")


def test_two_gates_of_one_name_are_the_cause(graph: ExpectedGraph) -> None:
    """At each look the one that was just ended is away, and the other is there."""
    answer = well(graph)
    away = RUNNING._replace(active="activating", sub="auto-restart", exit="exit code 75", pid=0)
    for unit, seen in ((RUNNING, answer.nodes[GATE]), (away, node(uri="http://192.168.77.12:4001/"))):
        spoilt = answer._replace(
            units={**answer.units, UNIT: unit._replace(restarts=9, recent=9)},
            nodes={**answer.nodes, GATE: seen},
            conflicts={UNIT: {GATE: ConflictSeen(9, 1.0)}},
        )
        found = findings(graph, spoilt)
        assert found[f"unit {UNIT} on laptop"].cause == f"node name {GATE}"
        assert f"called {GATE}" in found[f"node name {GATE}"].message
    cause = found[f"node name {GATE}"]
    assert cause.state is State.BAD
    assert f"two nodes are called {GATE}, on hosts laptop and 192.168.77.12" in cause.message


def test_an_ungated_robot_obeys_anybody_and_status_says_why(graph: ExpectedGraph) -> None:
    answer = well(graph)._replace(senders={"/x": STRANGER})
    quiet = {one.key: one for one in diagnose(graph, {"laptop": answer}).findings}
    why = "the driver obeys any publisher, as it is ungated: it takes setpoints"
    assert quiet["authority uav"].message == why
    spoilt = answer._replace(commanders={**answer.commanders, "/uav/cmd_vel": ("/x",)})
    found = findings(graph, spoilt)["authority uav"]
    assert (found.state, "rejected" in found.message, why in found.message) == (State.BAD, False, True)
