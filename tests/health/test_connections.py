"""Nodes that cannot connect to nodes of other hosts: which pairs are faults, and which are other checks'."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest
from swarm_onboard.agent.observations import PeerSeen, SenderSeen, UnconnectedSeen
from swarm_onboard.agent.verbs.probe import Answer
from swarm_onboard.host_checks.address import Seen as AddressSeen

from swarmctl.health.collect import request
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedProgram
from swarmctl.health.root_cause import Diagnosis
from tests.health import swarm_values as leader
from tests.health import test_bridge_checks as isles
from tests.health.faults import AWAY, shape
from tests.health.swarm_values import EPUCK_PI, K3_PI, LAPTOP, all_well, graph

ADDRESS = {LAPTOP: "192.168.77.10", K3_PI: "192.168.77.11", EPUCK_PI: "192.168.77.12"}
PILOT = f"/k3/driver on {K3_PI} to /pilot on {LAPTOP}"
COMMANDS = f"connection {PILOT}"
ANNOUNCED = f"connection the master on {LAPTOP} to /k3/driver on {K3_PI}"


def closed(host: str, port: int, *topics: str, slave: int = 40001, why: str = "timed out") -> PeerSeen:
    """A node on ``host`` of which ``port`` lets nothing in."""
    return PeerSeen(f"http://{ADDRESS[host]}:{slave}/", topics, port, f"{ADDRESS[host]}:{port}: {why}")


def seen(
    peers: Mapping[str, Mapping[str, PeerSeen]], listening: Mapping[str, tuple[int, ...]], **of_laptop: Any
) -> dict[str, Any]:
    """The answers of all hosts, with the peers and the ports of some."""
    answers: dict[str, Any] = {
        name: one._replace(peers=peers.get(name, {}), listening=listening.get(name, ()))
        for name, one in all_well().items()
    }
    return {**answers, LAPTOP: answers[LAPTOP]._replace(**of_laptop)}


def found(diagnosis: Diagnosis, key: str) -> tuple[str, str]:
    one = next(one for one in diagnosis.findings if one.key == key)
    return one.message, one.hint


SLAVE, TOPICS = {LAPTOP: (40001,)}, {LAPTOP: (40001, 45123)}
CASES: dict[str, tuple[PeerSeen, dict[str, tuple[int, ...]], list[str]]] = {
    "slave API closed": (closed(LAPTOP, 40001, "/k3/cmd_vel"), SLAVE, [COMMANDS]),
    "port for topics closed": (closed(LAPTOP, 45123, "/k3/cmd_vel"), TOPICS, [COMMANDS]),
    "rejected": (closed(LAPTOP, 40001, "/k3/cmd_vel", why="connection refused"), SLAVE, [COMMANDS]),
    "open": (PeerSeen("http://192.168.77.10:40001/", ("/k3/cmd_vel",)), SLAVE, []),
    "ended, and still registered": (closed(LAPTOP, 40001, "/k3/cmd_vel"), {}, []),
    "publishes nothing for this host": (closed(LAPTOP, 40001, "/other/cmd_vel"), SLAVE, []),
    "on the same host": (closed(K3_PI, 40001, "/k3/cmd_vel"), {K3_PI: (40001,)}, []),
    "on a host outside of the swarm": (
        closed(LAPTOP, 40001, "/k3/cmd_vel")._replace(uri="http://10.9.9.9:40001/"),
        SLAVE,
        [],
    ),
}


@pytest.mark.parametrize(("peer", "listening", "causes"), CASES.values(), ids=CASES.keys())
def test_a_pair_is_a_fault_if_a_process_listens_there(
    peer: PeerSeen, listening: dict[str, tuple[int, ...]], causes: list[str]
) -> None:
    diagnosis = diagnose(graph(), seen({K3_PI: {"/pilot": peer}}, listening))
    assert shape(diagnosis) == {key: ("bad", []) for key in causes}
    assert diagnosis.healthy is not causes


def test_a_pair_has_both_nodes_the_address_and_the_repair() -> None:
    answers = seen({K3_PI: {"/pilot": closed(LAPTOP, 45123, "/k3/cmd_vel")}}, TOPICS)
    message, hint = found(diagnose(graph(), answers), COMMANDS)
    assert message.startswith("cannot connect to 192.168.77.10:45123: timed out; ")
    assert message.endswith("nothing arrives on /k3/cmd_vel")
    rules = "check the firewall on koala-laptop: sudo nft list ruleset"
    assert hint == f"{rules}; all TCP ports must be open to k3-pi"


def test_an_address_that_the_host_does_not_have_is_the_cause() -> None:
    wrong = {"address": (AddressSeen(ADDRESS[LAPTOP], own=False, addresses=["10.0.0.5"]),)}
    answers = seen({K3_PI: {"/pilot": closed(LAPTOP, 40001, "/k3/cmd_vel")}}, SLAVE, checks=wrong)
    assert shape(diagnose(graph(), answers)) == {f"address {LAPTOP}": ("warning", [COMMANDS])}


def test_the_master_connects_to_nodes_of_other_hosts() -> None:
    answers = seen({LAPTOP: {"/k3/driver": closed(K3_PI, 40001)}}, {K3_PI: (40001,)})
    diagnosis = diagnose(graph(), answers)
    assert shape(diagnosis) == {ANNOUNCED: ("bad", [])}
    assert found(diagnosis, ANNOUNCED)[1].startswith("check the firewall on k3-pi: ")


def test_each_host_that_lets_nothing_in_is_one_cause() -> None:
    pilot = closed(LAPTOP, 40001, "/k3/cmd_vel", "/epuck/cmd_vel")
    answers = seen(
        {
            LAPTOP: {"/k3/driver": closed(K3_PI, 40001)},
            K3_PI: {"/pilot": pilot},
            EPUCK_PI: {"/pilot": pilot},
        },
        {**SLAVE, K3_PI: (40001,)},
    )
    assert shape(diagnose(graph(), answers)) == {
        ANNOUNCED: ("bad", []),
        COMMANDS: ("bad", [f"connection /epuck/driver on {EPUCK_PI} to /pilot on {LAPTOP}"]),
    }


def test_a_publisher_that_its_hub_cannot_call_is_a_symptom() -> None:
    """Its host is not the hub: the hub calls it in vain, too."""
    pilot = {"/pilot": closed(EPUCK_PI, 40001, "/k3/cmd_vel")}
    silent = {"/pilot": SenderSeen("192.168.77.12", {}, "no answer within 2 s")}
    commands = {**all_well()[LAPTOP].commanders, "/k3/cmd_vel": ("/pilot",)}
    answers = seen({K3_PI: pilot}, {EPUCK_PI: (40001,)}, senders=silent, commanders=commands)
    key = f"connection /k3/driver on {K3_PI} to /pilot on {EPUCK_PI}"
    assert shape(diagnose(graph(), answers)) == {key: ("bad", ["publisher /k3/cmd_vel"])}


@pytest.mark.parametrize("silent", [["/dead"], ["/dead", "/pilot"]])
def test_a_publisher_that_has_ended_is_its_own_cause(silent: list[str]) -> None:
    dead = {name: SenderSeen("192.168.77.10", {}, "connection refused") for name in silent}
    commands = {**all_well()[LAPTOP].commanders, "/k3/cmd_vel": ("/dead", "/pilot")}
    pilot = {"/pilot": closed(LAPTOP, 40001, "/k3/cmd_vel")}
    answers = seen({K3_PI: pilot}, SLAVE, senders=dead, commanders=commands)
    shown = {COMMANDS: ("bad", []), "publisher /k3/cmd_vel": ("warning", [])}
    assert shape(diagnose(graph(), answers)) == shown


def test_a_node_that_hangs_is_the_fault_of_its_own_check() -> None:
    answers = seen({LAPTOP: {"/k3/driver": closed(K3_PI, 40001)}}, {K3_PI: (40001,)})
    hung = leader.with_node("k3", alive=False, error="no answer within 2 s")
    diagnosis = diagnose(graph(), {**answers, K3_PI: hung(answers[K3_PI])})
    assert "driver k3" in shape(diagnosis)
    assert ANNOUNCED not in shape(diagnosis)


def test_a_host_that_does_not_answer_has_no_pairs() -> None:
    answers = seen({LAPTOP: {"/k3/driver": closed(K3_PI, 40001)}}, {})
    assert list(shape(diagnose(graph(), {**answers, K3_PI: AWAY}))) == ["host k3-pi"]


def with_program(**changes: Any) -> ExpectedGraph:
    """The example, with a program on the laptop that subscribes to the odometry of k3."""
    plain = ExpectedProgram(
        "map", LAPTOP, optional=False, unit="", node="/map", packages=(), install_hint="", publishes=(),
        subscribes=(("/k3/odom", "nav_msgs/Odometry"),), lifecycle="oneshot",
    )  # fmt: skip
    laptop, *others = graph().hosts
    return replace(graph(), hosts=(replace(laptop, programs=(replace(plain, **changes),)), *others))


@pytest.mark.parametrize(("node", "name"), [("/map", "/map"), ("", "a node of map")])
@pytest.mark.parametrize(("port", "causes"), [(40001, 2), (45123, 1)])
def test_a_program_connects_to_what_it_subscribes_to(node: str, name: str, port: int, causes: int) -> None:
    answers = seen({LAPTOP: {"/k3/driver": closed(K3_PI, port, "/k3/odom")}}, {K3_PI: (40001, 45123)})
    diagnosis = diagnose(with_program(node=node), answers)
    pairs = [one for one in diagnosis.findings if one.check == "connection"]
    assert pairs[0].subject == f"{name} on {LAPTOP} to /k3/driver on {K3_PI}"
    assert pairs[0].program == "map"
    assert len(pairs) == causes, "the master needs the slave API only"


def test_a_request_has_what_nodes_of_the_host_connect_to() -> None:
    requests = {host.name: request(with_program(), host, 2.0) for host in with_program().hosts}
    assert requests[LAPTOP].peers == ["/k3/driver", "/epuck/driver"]
    assert requests[LAPTOP].inputs == ["/koala/cmd_vel", "/k3/odom"]
    assert (requests[K3_PI].peers, requests[K3_PI].inputs) == ([], ["/k3/cmd_vel"])


def test_a_master_connects_to_no_node_of_another_island() -> None:
    shown = isles.graph()
    assert [request(shown, host, 2.0).peers for host in shown.hosts] == [[], []]


def test_a_publisher_of_another_island_is_connected_to_directly() -> None:
    teleop = PeerSeen(isles.TELEOP, (isles.COMMANDS,), 4002, "192.168.77.10:4002: timed out")
    answers: dict[str, Answer] = isles.all_well()
    answers["k3-pi"] = answers["k3-pi"]._replace(peers={"/teleop": teleop})
    answers["laptop"] = answers["laptop"]._replace(listening=(4002,))
    causes = shape(diagnose(isles.graph(), answers))
    assert causes["connection /k3/driver on k3-pi to /teleop on laptop"] == ("bad", [])


def test_a_subscriber_of_a_bridged_topic_connects_to_its_driver() -> None:
    assert request(isles.graph(), isles.graph().hosts[0], 2.0).inputs == ["/koala/cmd_vel", isles.ODOM]
    driver = PeerSeen(isles.DRIVER, (isles.ODOM,), 4001, "192.168.77.11:4001: timed out")
    answers: dict[str, Answer] = isles.all_well()
    answers["laptop"] = answers["laptop"]._replace(peers={"/k3/driver": driver})
    answers["k3-pi"] = answers["k3-pi"]._replace(listening=(4001,))
    key = "connection a subscriber on laptop to /k3/driver on k3-pi"
    diagnosis = diagnose(isles.graph(), answers)
    assert shape(diagnosis) == {key: ("bad", [])}
    assert found(diagnosis, key)[0].endswith(f"nothing arrives on {isles.ODOM}")


SUM, OTHER = "9f195f881246fdfa2798d1d3eebca84a", "cd5e73d190d741a2f92e81eda573aca7"
SUBSCRIBED = f"subscription {PILOT}"
TO_PILOT = UnconnectedSeen("/k3/driver", "/pilot", "http://192.168.77.10:40001", "/k3/cmd_vel")


def without_connection(*pairs: UnconnectedSeen, **seen_peers: Any) -> Diagnosis:
    answers = seen(seen_peers.get("peers", {}), TOPICS)
    return diagnose(graph(), {**answers, K3_PI: answers[K3_PI]._replace(unconnected=pairs)})


def test_a_subscriber_without_a_connection_is_a_fault() -> None:
    diagnosis = without_connection(TO_PILOT)
    assert shape(diagnosis) == {SUBSCRIBED: ("bad", [])}
    text, hint = found(diagnosis, SUBSCRIBED)
    assert text == "there is no connection: nothing arrives on /k3/cmd_vel"
    assert hint.startswith(f"on {K3_PI}: sudo systemctl restart {leader.UNIT['k3']}; ")


@pytest.mark.parametrize(
    ("own", "theirs", "named"), [(SUM, OTHER, True), (SUM, SUM, False), ("", OTHER, False), (SUM, "", False)]
)
def test_two_definitions_of_a_type_are_the_reason_if_both_are_known(
    own: str, theirs: str, named: bool
) -> None:
    pair = TO_PILOT._replace(type="geometry_msgs/Twist", md5=own, publisher_md5=theirs)
    text, hint = found(without_connection(pair), SUBSCRIBED)
    assert text.startswith("geometry_msgs/Twist is another message (MD5 sum 9f195f88 here, ") is named
    assert ("the same version of geometry_msgs" in hint) is named


@pytest.mark.parametrize("theirs", ["std_msgs/String", "*", "", "geometry_msgs/Twist"])
def test_two_types_are_the_reason_if_both_are_known(theirs: str) -> None:
    pair = TO_PILOT._replace(type="geometry_msgs/Twist", publisher_type=theirs)
    text = found(without_connection(pair), SUBSCRIBED)[0]
    sent = "it subscribes to geometry_msgs/Twist, and the publisher sends std_msgs/String: nothing arrives on"
    assert text.startswith(sent) is (theirs == "std_msgs/String")


def test_a_wrong_type_of_commands_is_one_cause() -> None:
    pair = TO_PILOT._replace(type="geometry_msgs/Twist", publisher_type="std_msgs/String")
    sender = {"/pilot": SenderSeen("192.168.77.10", {"/k3/cmd_vel": "std_msgs/String"})}
    answers = seen({}, {}, commanders={"/k3/cmd_vel": ("/pilot",)}, senders=sender)
    wrong = diagnose(graph(), {**answers, K3_PI: answers[K3_PI]._replace(unconnected=(pair,))})
    assert shape(wrong) == {"command type k3": ("bad", [SUBSCRIBED])}


def test_a_stranger_need_not_be_connected() -> None:
    stranger = TO_PILOT._replace(uri=f"http://{ADDRESS[EPUCK_PI]}:40001")
    assert shape(without_connection(stranger)) == {}


def test_a_node_of_no_robot_belongs_to_its_host() -> None:
    diagnosis = without_connection(TO_PILOT._replace(node="/rostopic_7"))
    key = f"subscription /rostopic_7 on {K3_PI} to /pilot on {LAPTOP}"
    assert shape(diagnosis) == {key: ("bad", [])}
    assert found(diagnosis, key)[1].startswith("start /rostopic_7 again")


def test_a_closed_port_is_the_reason_where_there_is_one() -> None:
    peers = {K3_PI: {"/pilot": closed(LAPTOP, 45123, "/k3/cmd_vel")}}
    diagnosis = without_connection(TO_PILOT, peers=peers)
    assert shape(diagnosis) == {COMMANDS: ("bad", [SUBSCRIBED])}


def test_a_publisher_outside_of_the_swarm_is_a_matter_of_other_checks() -> None:
    assert shape(without_connection(TO_PILOT._replace(uri="http://10.9.9.9:40001"))) == {}
