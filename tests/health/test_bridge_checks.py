"""Bridges between islands: which topics must arrive, which must not, and the causes when one is missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import pytest
from swarm_onboard.agent.observations import ForeignNode, GraphSeen, MasterSeen, NodeSeen, Report
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.collect import request
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import ExpectedGraph, Release, expected_graph
from swarmctl.health.root_cause import Diagnosis
from swarmctl.health.swarm_health import status
from swarmctl.health.verdict import State
from swarmctl.remote.transport import HostError, Kind
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from swarmctl.swarm.resolve import resolve
from swarmctl.views import status as view
from tests.health.swarm_values import well

SPEC = """\
version: 1
name: isles
mode: standalone
hosts:
  laptop: {address: 192.168.77.10}
  k3-pi: {address: 192.168.77.11}
robots:
  koala: {type: koala, host: laptop}
  k3: {type: khepera3, host: k3-pi}
links:
  - {kind: wlan, name: lab, hosts: [laptop, k3-pi]}
  - {kind: serial, host: laptop, robot: koala, usb: {serial: A600dXyz}}
  - {kind: serial, host: k3-pi, robot: k3, usb: {serial: FTDI1234}}
control:
  - {by: laptop, of: [k3]}
multimaster: {provider: static, topics: [{topic: /k3/odom, to: [laptop]}]}
"""
ODOM, COMMANDS = "/k3/odom", "/k3/cmd_vel"
ODOM_BRIDGE = f"bridge {ODOM} from k3-pi to laptop"
COMMAND_BRIDGE = f"bridge {COMMANDS} from laptop to k3-pi"
SYNC_LAPTOP = "multimaster /multimaster_laptop on laptop"
MULTIMASTER = "swarm-isles.multimaster.service"
DRIVER = "http://192.168.77.11:4001/"
TELEOP = "http://192.168.77.10:4002/"
AWAY = HostError(Kind.UNREACHABLE, "connect timed out", "is it on?")


@cache
def graph(*hosts: str) -> ExpectedGraph:
    """The expected graph of ``hosts``, of all by default."""
    document, found = load_text(SPEC, "swarm.yaml", load_catalog())
    assert document is not None, found
    swarm = resolve(document)
    joined = ("swarm-isles.master.service", MULTIMASTER)
    releases = {
        name: Release(
            "a" * 16, (*joined, *(f"swarm-isles.{one.name}.service" for one in swarm.robots_on(name)))
        )
        for name in hosts or swarm.hosts
    }
    return expected_graph(swarm, releases)


def seen(publishers: Mapping[str, Mapping[str, str]], *strangers: ForeignNode) -> GraphSeen:
    kinds = {ODOM: "nav_msgs/Odometry", COMMANDS: "geometry_msgs/Twist"}
    return GraphSeen(publishers, {topic: kinds[topic] for topic in publishers}, strangers)


K3_SYNC = ForeignNode("/multimaster_k3_pi", "http://192.168.77.11:4009/", (), (COMMANDS,))
LAPTOP_SYNC = ForeignNode("/multimaster_laptop", "http://192.168.77.10:4009/", (), (ODOM,))
TELEOP_AWAY = ForeignNode("/teleop", TELEOP, (COMMANDS,), ())
DRIVER_AWAY = ForeignNode("/k3/driver", DRIVER, (ODOM,), ())
BOTH = {ODOM: {"/k3/driver": DRIVER}, COMMANDS: {"/teleop": TELEOP}}


def all_well() -> dict[str, Any]:
    """A person's teleop on the laptop commands k3, whose odometry the laptop receives."""
    answers = {
        host.name: joined(well(host), f"/multimaster_{host.name.replace('-', '_')}") for host in graph().hosts
    }
    answers["laptop"] = answers["laptop"]._replace(graph=seen(BOTH, K3_SYNC, DRIVER_AWAY))
    answers["k3-pi"] = answers["k3-pi"]._replace(graph=seen(BOTH, LAPTOP_SYNC, TELEOP_AWAY))
    return answers


def joined(answer: Answer, node: str, **changes: Any) -> Answer:
    sync = NodeSeen(True, True, "", 42, "", {}, {}, {}, Report(0, "1 of 1 peers connected"))
    return answer._replace(nodes={**answer.nodes, node: sync._replace(**changes)})


def shape(found: Diagnosis) -> dict[str, tuple[str, list[str]]]:
    return {
        cause.key: (cause.state.value, [one.key for one in symptoms]) for cause, symptoms in found.explained()
    }


def reported(found: Diagnosis, key: str) -> tuple[State, str]:
    one = next(one for one in found.findings if one.key == key)
    return one.state, one.message


def on(host: str, **changes: Any) -> dict[str, Any]:
    answers = all_well()
    return {**answers, host: answers[host]._replace(**changes)}


def test_what_crosses_as_it_should_is_healthy() -> None:
    found = diagnose(graph(), all_well())
    assert found.healthy
    assert shape(found) == {}
    assert reported(found, ODOM_BRIDGE) == (State.OK, "/k3/driver received")


def test_where_nobody_commands_by_hand_nothing_is_missing() -> None:
    answers = all_well()
    here = {ODOM: BOTH[ODOM], COMMANDS: {}}
    answers["laptop"] = answers["laptop"]._replace(graph=seen(here, K3_SYNC, DRIVER_AWAY))
    answers["k3-pi"] = answers["k3-pi"]._replace(graph=seen(here, LAPTOP_SYNC))
    found = diagnose(graph(), answers)
    assert found.healthy
    assert reported(found, COMMAND_BRIDGE) == (State.SKIPPED, "no publisher on laptop at the moment")


CASES: dict[str, tuple[dict[str, Mapping[str, str]], str]] = {
    "not received": ({ODOM: {}}, "laptop does not receive /k3/driver"),
    "gone, and not forgotten": (
        {ODOM: {"/k3/driver": DRIVER, "/old": "http://192.168.77.11:9/"}},
        "laptop still lists /old, which left k3-pi",
    ),
    "at an old address": (
        {ODOM: {"/k3/driver": "http://192.168.77.11:9/"}},
        f"laptop lists /k3/driver at http://192.168.77.11:9/ instead of {DRIVER}",
    ),
    "published by a node of this island as well": (
        {ODOM: {"/k3/driver": DRIVER, "/fake": "http://192.168.77.10:9/"}},
        "/fake of laptop publishes it as well at laptop: subscribers there receive both",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_two_masters_that_differ_are_reported(case: str) -> None:
    publishers, message = CASES[case]
    found = diagnose(graph(), on("laptop", graph=seen({**BOTH, **publishers}, K3_SYNC)))
    assert shape(found) == {ODOM_BRIDGE: ("bad", [])}
    assert reported(found, ODOM_BRIDGE)[1] == message


def test_another_type_under_the_same_name_is_bad() -> None:
    strange = GraphSeen(BOTH, {ODOM: "std_msgs/String"}, (K3_SYNC, DRIVER_AWAY))
    found = diagnose(graph(), on("laptop", graph=strange))
    assert reported(found, ODOM_BRIDGE) == (
        State.BAD, "has type std_msgs/String instead of nav_msgs/Odometry at laptop",
    )  # fmt: skip


def test_a_second_publisher_of_another_type_is_named() -> None:
    second = {**BOTH, ODOM: {"/k3/driver": DRIVER, "/fake": "http://192.168.77.10:9/"}}
    found = diagnose(graph(), on("laptop", graph=seen(second)._replace(types={ODOM: "std_msgs/String"})))
    assert reported(found, ODOM_BRIDGE)[1] == (
        "/fake of laptop publishes it as well at laptop, where it has type std_msgs/String "
        "instead of nav_msgs/Odometry"
    )


def test_a_peer_that_is_away_explains_what_does_not_cross() -> None:
    answers = {**all_well(), "k3-pi": AWAY}
    waiting = Report(1, "0 of 1 peers connected")
    answers["laptop"] = joined(answers["laptop"], "/multimaster_laptop", report=waiting)
    found = diagnose(graph(), answers)
    assert shape(found) == {
        "host k3-pi": (
            "bad",
            ["multimaster /multimaster_laptop on laptop", ODOM_BRIDGE, COMMAND_BRIDGE, "robot k3"],
        )
    }


def test_a_master_that_is_away_explains_its_lost_peers() -> None:
    answers = all_well()
    silent = MasterSeen(error="no answer within 2 s")
    answers["k3-pi"] = answers["k3-pi"]._replace(master=silent, nodes={}, graph=None)
    lost = Report(1, "0 of 1 peers connected; k3-pi: no answer within 2 s")
    answers["laptop"] = joined(answers["laptop"], "/multimaster_laptop", report=lost)
    causes = shape(diagnose(graph(), answers))
    assert list(causes) == ["master k3-pi"]
    assert SYNC_LAPTOP in causes["master k3-pi"][1]


def test_a_dead_multimaster_explains_its_topics_and_no_others() -> None:
    answers = all_well()
    unit = f"unit {MULTIMASTER} on laptop"
    dead = answers["laptop"].units[MULTIMASTER]._replace(active="failed", sub="failed", result="signal")
    lost = joined(answers["laptop"], "/multimaster_laptop", registered=False)
    answers["laptop"] = lost._replace(
        units={**lost.units, MULTIMASTER: dead}, graph=seen({**BOTH, ODOM: {}}, K3_SYNC)
    )
    assert shape(diagnose(graph(), answers)) == {unit: ("bad", [SYNC_LAPTOP, ODOM_BRIDGE])}


def test_a_dead_driver_explains_its_missing_publisher() -> None:
    answers = all_well()
    k3 = answers["k3-pi"].nodes["/k3/driver"]._replace(registered=False)
    answers["k3-pi"] = answers["k3-pi"]._replace(
        nodes={**answers["k3-pi"].nodes, "/k3/driver": k3},
        graph=seen({**BOTH, ODOM: {}}, LAPTOP_SYNC, TELEOP_AWAY),
    )
    answers["laptop"] = answers["laptop"]._replace(graph=seen({**BOTH, ODOM: {}}, K3_SYNC))
    assert shape(diagnose(graph(), answers)) == {"driver k3": ("bad", [ODOM_BRIDGE])}


@pytest.mark.parametrize(
    ("stranger", "did"),
    [
        (ForeignNode("/k3/driver", DRIVER, (ODOM, "/k3/proximity"), ()), "publishes /k3/proximity"),
        (ForeignNode("/spy", "http://K3-Pi:9/", (), ("/koala/cmd_vel",)), "subscribes to /koala/cmd_vel"),
        (
            ForeignNode("/odd", DRIVER, (COMMANDS,), (ODOM,)),
            "publishes /k3/cmd_vel and subscribes to /k3/odom",
        ),
    ],
)
def test_who_is_not_to_be_there_is_named(stranger: ForeignNode, did: str) -> None:
    """A bridge has one direction: k3's own nodes do not subscribe to its odometry on the laptop."""
    found = diagnose(graph(), on("laptop", graph=seen(BOTH, K3_SYNC, stranger)))
    key = f"leak {stranger.node} at laptop"
    assert shape(found) == {key: ("bad", [])}
    assert reported(found, key)[1] == (
        f"runs on island k3-pi ({stranger.uri}) and {did} here: no such bridge is declared"
    )


def test_a_machine_of_no_island_is_no_leak() -> None:
    desk = ForeignNode("/rostopic_7", "http://192.168.77.99:4001/", (), ("/koala/odom",))
    assert diagnose(graph(), on("laptop", graph=seen(BOTH, K3_SYNC, DRIVER_AWAY, desk))).healthy


def test_a_part_of_the_swarm_is_judged_by_itself() -> None:
    """Bridges to or from islands without an answer are not judged."""
    found = diagnose(graph("laptop"), {"laptop": all_well()["laptop"]})
    assert found.healthy


def test_hubs_are_probed_for_bridged_topics_and_own_addresses() -> None:
    laptop = graph().hosts[0]
    probe = request(graph(), laptop, 2.0)
    assert probe.graph
    assert (probe.bridged, probe.own) == ([COMMANDS, ODOM], ["192.168.77.10", "laptop"])
    assert probe.nodes["/multimaster_laptop"] == {"/diagnostics": 2.5}


def test_the_table_shows_what_each_hub_receives() -> None:
    answers = on("laptop", graph=seen({**BOTH, ODOM: {}}, K3_SYNC))
    found = status(graph(), answers, diagnose(graph(), answers))
    rows = {line.split()[0]: line for line in view.status(found).plain.splitlines() if line.strip()}
    assert rows["laptop"].endswith("receives 0/1 topic of k3-pi, not /k3/odom")
    assert rows["k3-pi"].endswith("receives 1/1 topic of laptop")
    [row] = found.to_json()["hosts"][0]["bridges"]
    assert (row["topic"], row["origin"], row["state"]) == (ODOM, "k3-pi", State.BAD)


def test_a_clock_that_differs_between_islands_is_named() -> None:
    found = diagnose(graph(), on("k3-pi", clock_ahead=61.0))
    assert shape(found) == {"clock k3-pi": ("warning", [])}
    assert "is 60.9 s ahead of laptop's clock" in reported(found, "clock k3-pi")[1]


def test_clocks_of_islands_that_exchange_nothing_are_not_compared() -> None:
    found = diagnose(replace(graph(), bridges=()), on("k3-pi", clock_ahead=61.0))
    assert reported(found, "clock k3-pi")[0] is State.OK
