"""What status makes of a swarm whose nodes find each other: faults of servers, nodes and topics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.observations import NodeSeen, PeerSeen, Report, SenderSeen, TopicSeen, UnmatchedSeen
from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.collect import request
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, Release, expected_graph
from swarmctl.health.root_cause import Diagnosis
from swarmctl.health.verdict import State
from swarmctl.remote.transport import HostError, Kind
from swarmctl.render.build_bundle import bundles
from tests.loading import load_swarm

SPEC = """\
version: 1
name: tiny
mode: central
hub: alpha
ros: {distro: kilted, discovery: METHOD}
hosts: {alpha: {address: 10.0.0.1}, beta: {address: 10.0.0.2}}
robots: {koala: {type: koala, host: alpha}, k3: {type: khepera3, host: beta}}
links:
  - {kind: wlan, name: air, hosts: [alpha, beta], multicast: true}
  - {kind: serial, host: alpha, robot: koala, usb: {serial: KOALA1}}
  - {kind: serial, host: beta, robot: k3, usb: {serial: FTDI1234}}
"""
#: With a gate in front of the driver of k3.
GATED = SPEC.replace("khepera3", "cart").replace(
    "  - {kind: serial, host: beta, robot: k3, usb: {serial: FTDI1234}}\n",
    """\
types:
  cart:
    title: Cart of a vendor
    driver: {package: cart_driver, executable: cart_node, publishes: [{topic: odom, type: nav_msgs/Odometry}]}
    kinematics: {kind: differential, linear_max: 0.5, angular_max: 2.0, wheel_separation: 0.3}
""",
)
SERVER = "swarm-tiny.discovery.service"
RUNS = UnitState("loaded", "active", "running", "success", "", 42, 0)
TWIST, ODOMETRY = "geometry_msgs/msg/Twist", "nav_msgs/msg/Odometry"


def graph_of(folder: Path, method: str = "server", spec: str = SPEC) -> ExpectedGraph:
    (folder / "swarm.yaml").write_text(spec.replace("METHOD", method))
    swarm, found = load_swarm(folder / "swarm.yaml")
    assert swarm is not None, found
    made = bundles(swarm)
    return expected_graph(
        swarm,
        {name: Release(one.digest, tuple(unit.name for unit in one.units)) for name, one in made.items()},
    )


@pytest.fixture
def graph(tmp_path: Path) -> ExpectedGraph:
    return graph_of(tmp_path)


def node(robot: Any) -> NodeSeen:
    return NodeSeen(
        registered=True,
        alive=True,
        publishes={one.name: one.type for one in robot.topics},
        subscribes={robot.command: robot.command_type},
        topics={one.name: TopicSeen(20, one.rate, 2.0, one.type) for one in robot.topics},
    )


def well(graph: ExpectedGraph) -> dict[str, Answer]:
    """What the probe of each host finds when nothing is wrong."""

    def answer(host: ExpectedHost) -> Answer:
        hub = host.is_hub
        return Answer(
            release=host.release.digest,
            units=dict.fromkeys(host.release.units, RUNS),
            nodes={robot.node: node(robot) for robot in host.robots},
            seen=2,
            listening_udp=(11811,) if hub else (),
            commanders={one.command: () for one in graph.robots} if hub else {},
            peers={"/k3/driver": PeerSeen("")} if hub else {},
        )

    return {host.name: answer(host) for host in graph.hosts}


ABSENT = NodeSeen(registered=False, alive=False)
BLIND: dict[str, Any] = {"seen": 0, "peers": {}}


def spoilt(graph: ExpectedGraph, changes: Mapping[str, Mapping[str, Any]]) -> Diagnosis:
    answers: dict[str, Any] = {
        name: one._replace(**changes.get(name, {})) for name, one in well(graph).items()
    }
    return diagnose(graph, answers)


def wrong(found: Diagnosis) -> dict[str, tuple[str, str | None]]:
    """What is not well, with its state and its cause; no robot is plugged into these hosts."""
    return {
        one.key: (one.state.value, one.cause)
        for one in found.findings
        if one.state not in (State.OK, State.SKIPPED) and one.check != "device"
    }


def pair(**changes: str) -> UnmatchedSeen:
    return UnmatchedSeen("/k3/odom", "/k3/driver", "/koala/driver", ODOMETRY, ODOMETRY, "")._replace(
        **changes
    )


def test_a_healthy_swarm_has_nothing_of_a_master(graph: ExpectedGraph) -> None:
    found = spoilt(graph, {})
    assert wrong(found) == {}
    assert not [one for one in found.findings if "master" in f"{one.key} {one.message} {one.hint}"]


def test_the_hub_is_asked_for_the_whole_island(graph: ExpectedGraph) -> None:
    hub, other = (request(graph, host, 2.0) for host in graph.hosts)
    assert hub.homes == {"/koala/driver": "10.0.0.1", "/k3/driver": "10.0.0.2"}
    assert (hub.master, hub.clock, other.homes) == ("", None, {})


@pytest.mark.parametrize(
    ("changes", "found", "message"),
    [
        pytest.param(
            {"alpha": {"listening_udp": ()}},
            {"discovery alpha": ("bad", None)},
            "no process has port 11811/udp: nodes do not find each other",
            id="the server has no port",
        ),
        pytest.param(
            {"alpha": {"listening_udp": (), "troubles": {"ports": "no /proc"}}},
            {"probe alpha ports": ("unknown", None)},
            "no /proc",
            id="the ports are unknown",
        ),
        pytest.param(
            {"beta": {**BLIND, "nodes": {"/k3/driver": ABSENT}}},
            {"discovery beta": ("bad", None), "driver k3": ("bad", "discovery beta")},
            "it sees no node in the graph, though a unit with a node runs",
            id="a host is cut off",
        ),
        pytest.param(
            {"alpha": {"peers": {}}},
            {"discovery alpha to beta": ("bad", None)},
            "alpha does not see /k3/driver of beta: what it publishes does not arrive there",
            id="the hub misses a host",
        ),
        pytest.param(
            {"beta": {"nodes": {"/k3/driver": ABSENT}}, "alpha": {"peers": {}}},
            {"driver k3": ("bad", None)},
            "/k3/driver is not in the graph although its unit runs",
            id="a node is nowhere",
        ),
        pytest.param(
            {"alpha": {"unmatched": (pair(policies="Best effort publisher and reliable subscription"),)}},
            {"qos /k3/odom of /k3/driver to /koala/driver": ("bad", None)},
            "/koala/driver receives nothing of /k3/driver on /k3/odom: Best effort publisher and reliable",
            id="QoS of two nodes of the spec",
        ),
        pytest.param(
            {"alpha": {"unmatched": (pair(subscriber="/rviz", policies="Deadline"),)}},
            {"qos /k3/odom of /k3/driver to /rviz": ("warning", None)},
            "let the subscriber ask for no more than the publisher offers",
            id="QoS of another node",
        ),
        pytest.param(
            {"alpha": {"unmatched": (pair(type=TWIST),)}},
            {"type /k3/odom of /k3/driver to /koala/driver": ("bad", None)},
            f"it subscribes to {TWIST}, and the publisher sends {ODOMETRY}",
            id="two types",
        ),
        pytest.param(
            {"alpha": {"unmatched": (pair(),)}},
            {"type /k3/odom of /k3/driver to /koala/driver": ("bad", None)},
            "install or build the same version of nav_msgs for both",
            id="two definitions of a type",
        ),
        pytest.param(
            {"alpha": {"doubles": {"/k3/driver": ("10.0.0.1", "10.0.0.2")}}},
            {"node name /k3/driver": ("bad", None)},
            "several nodes are called /k3/driver, on hosts alpha and beta",
            id="two nodes of one name",
        ),
        pytest.param(
            {"alpha": {"doubles": {"/rviz": ("", "")}}},
            {"node name /rviz": ("warning", None)},
            "several nodes are called /rviz: who asks",
            id="two nodes that the spec does not name",
        ),
    ],
)
def test_a_fault_is_found(
    graph: ExpectedGraph, changes: Any, found: Mapping[str, tuple[str, str | None]], message: str
) -> None:
    diagnosis = spoilt(graph, changes)
    assert wrong(diagnosis) == found
    assert any(message in f"{one.message} {one.hint}" for one in diagnosis.findings)


def test_what_an_incomplete_look_has_not_seen_is_no_fault(graph: ExpectedGraph) -> None:
    unseen = NodeSeen(registered=None, alive=None, error="the graph still changed")
    beta = {"nodes": {"/k3/driver": unseen}, "incomplete": True}
    found = wrong(spoilt(graph, {"alpha": {"peers": {}, "incomplete": True}, "beta": beta}))
    cause = "discovery alpha"
    assert found.pop(cause) == ("unknown", None)
    assert found == dict.fromkeys(("discovery beta", "driver k3"), ("unknown", cause))


def test_what_an_incomplete_hub_misses_of_a_host_is_no_fault(graph: ExpectedGraph) -> None:
    """The host itself sees its driver."""
    found = wrong(spoilt(graph, {"alpha": {"peers": {}, "incomplete": True}}))
    assert {state for state, _ in found.values()} == {"unknown"}


def test_a_hub_that_misses_a_receiver_which_the_gate_sees_is_no_fault(tmp_path: Path) -> None:
    graph = graph_of(tmp_path, spec=GATED)
    robot = next(robot for robot in graph.robots if robot.gate is not None)
    assert robot.gate is not None
    gate = NodeSeen(True, True, subscribes={robot.command: TWIST}, publishes={robot.gate.output: TWIST})
    hub = {"commanders": {robot.gate.output: (robot.gate.node,)}, "receivers": {robot.gate.output: ()}}
    for level, state in ((0, State.UNKNOWN), (1, State.BAD)):
        nodes = {robot.gate.node: gate._replace(report=Report(level, "driving"))}
        seen = spoilt(graph, {"alpha": hub, "beta": {"nodes": nodes}})
        assert next(one.state for one in seen.findings if one.check == "wiring") is state


def test_what_is_certain_is_waited_for(graph: ExpectedGraph) -> None:
    hub, other = (request(graph, host, 2.0).expected for host in graph.hosts)
    k3 = next(robot for robot in graph.robots if robot.name == "k3")
    topics = [one.name for one in k3.topics]
    assert other == {k3.node: {"publishes": topics, "subscribes": ["/k3/cmd_vel"], "provides": []}}
    assert hub.keys() == {"/koala/driver", "/k3/driver"}
    assert hub["/k3/driver"] == other["/k3/driver"]
    optional = replace(graph.hosts[1], robots=(replace(k3, optional=True),))
    assert request(graph, optional, 2.0).expected == {}


@pytest.mark.parametrize(("host", "found"), [("10.0.0.1", "warning"), ("10.0.0.2", "ok"), ("", "ok")])
def test_a_sender_is_unauthorised_where_its_host_is_known(
    graph: ExpectedGraph, host: str, found: str
) -> None:
    """Programs of its own host may command a robot; not every middleware shows where a node is."""
    sender = {"/other": SenderSeen(host, {"/k3/cmd_vel": TWIST})}
    seen = spoilt(graph, {"alpha": {"commanders": {"/k3/cmd_vel": ("/other",)}, "senders": sender}})
    [authority] = [one for one in seen.findings if one.key == "authority k3"]
    assert authority.state.value == found


def test_a_server_that_does_not_run_is_the_cause_of_all(graph: ExpectedGraph) -> None:
    stopped = RUNS._replace(active="inactive", sub="dead")
    units = {**well(graph)["alpha"].units, SERVER: stopped}
    nodes = {"alpha": {"/koala/driver": ABSENT}, "beta": {"/k3/driver": ABSENT}}
    changes = {name: {**BLIND, "nodes": nodes[name], "listening_udp": ()} for name in nodes}
    found = wrong(spoilt(graph, {**changes, "alpha": {**changes["alpha"], "units": units}}))
    server = f"unit {SERVER} on alpha"
    assert found.pop(server) == ("bad", None)
    assert set(found.values()) == {("bad", server)}
    assert found.keys() == {"discovery alpha", "discovery beta", "driver koala", "driver k3"}


def test_a_server_on_a_host_that_is_away_explains_the_others(graph: ExpectedGraph) -> None:
    answers: dict[str, Any] = well(graph)
    answers["alpha"] = HostError(Kind.UNREACHABLE, "timed out")
    answers["beta"] = answers["beta"]._replace(nodes={"/k3/driver": ABSENT}, **BLIND)
    found = wrong(diagnose(graph, answers))
    assert found["discovery beta"] == found["driver k3"] == ("bad", "host alpha")


def test_a_node_that_was_just_started_again_has_no_double(graph: ExpectedGraph) -> None:
    """The graph keeps the one that was killed for 20 s."""
    beta = well(graph)["beta"].units
    unit = next(robot.unit for robot in graph.robots if robot.name == "k3")
    again = {**beta, unit: RUNS._replace(restarts=1, running=5.0)}
    twice = {"alpha": {"doubles": {"/k3/driver": ("10.0.0.2", "10.0.0.2")}}}
    assert wrong(spoilt(graph, {**twice, "beta": {"units": again}})) == {}
    later = {**beta, unit: RUNS._replace(restarts=1, running=500.0)}
    assert "node name /k3/driver" in wrong(spoilt(graph, {**twice, "beta": {"units": later}}))


def test_without_servers_the_hint_is_multicast(tmp_path: Path) -> None:
    found = spoilt(graph_of(tmp_path, "multicast"), {"alpha": {"peers": {}, "listening_udp": ()}})
    [one] = [one for one in found.findings if one.key == "discovery alpha to beta"]
    assert one.hint.startswith("check the firewalls of beta and alpha; a network that drops multicast needs")
    assert wrong(found).keys() == {one.key}
