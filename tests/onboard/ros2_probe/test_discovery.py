"""A look at a graph of ROS 2 goes on until the whole graph was seen: on graphs that grow in time."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from swarm_onboard.agent.observations import LaunchedSeen
from swarm_onboard.ros2_probe import look
from swarm_onboard.ros2_probe.endpoints import Endpoint, Graph

from tests.onboard.ros2_probe.test_endpoints import TWIST, end, request

GATE, ROBOT, UNIT = "/tb/gate/node", "/turtlebot4", "swarm-new.tb.service"
DRIVEN, ODOM = "/tb/gate/cmd_vel", "/tb/odom"
PUBLISHERS = (end(GATE, DRIVEN, TWIST), end(ROBOT, ODOM))
SUBSCRIPTIONS = (end(GATE, "/tb/cmd_vel", TWIST), end(ROBOT, DRIVEN, TWIST))
DOCKS = {ROBOT: {"/tb/dock": "irobot_create_msgs/action/Dock"}}
WANTED = request(
    nodes={GATE: {}},
    launched={UNIT: {ODOM: 0.0}},
    commands=[DRIVEN],
    publishers={},
    provides=["/tb/dock"],
    expected={
        GATE: {"publishes": [DRIVEN], "subscribes": ["/tb/cmd_vel"], "provides": []},
        UNIT: {"publishes": [ODOM], "subscribes": [DRIVEN], "provides": ["/tb/dock"]},
    },
)


def graph(*without: Endpoint, more: int = 0, services: Any = DOCKS) -> Graph:
    """A healthy graph without some endpoints, with ``more`` nodes of others."""
    publishers = [one for one in PUBLISHERS if one not in without]
    subscriptions = [one for one in SUBSCRIPTIONS if one not in without]
    nodes = [GATE, ROBOT, *(f"/other_{number}" for number in range(more))]
    return Graph(nodes, publishers, subscriptions, services=services)


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[dict[str, Any], float]]:
    """What a look at a graph reports, and after how many s of a clock that its turns move."""
    senders = ModuleType("swarm_onboard.ros2.senders")
    vars(senders).update(subscribe_with_sender=None)
    monkeypatch.setitem(sys.modules, senders.__name__, senders)

    def looked(at: Callable[[float], Graph], wanted: Any = WANTED) -> tuple[dict[str, Any], float]:
        now = [0.0]

        def turn() -> None:
            now[0] += 0.05

        monkeypatch.setattr(look, "time", SimpleNamespace(monotonic=lambda: now[0]))
        monkeypatch.setattr(look, "graph_of", lambda _, *, services: at(now[0]))
        return look._looked(wanted, None, turn), now[0]

    return looked


def test_two_probes_with_the_same_pid_have_different_names(monkeypatch: pytest.MonkeyPatch) -> None:
    """The GID of the probe's own host is found by its name."""
    monkeypatch.setattr(look.os, "getpid", lambda: 444)
    assert look._own_name() != look._own_name()


def test_an_action_is_known_by_the_service_of_its_goals() -> None:
    """As rclpy lists the services of an action server, and of parameters."""
    listed = [
        ("/tb/dock/_action/cancel_goal", ["action_msgs/srv/CancelGoal"]),
        ("/tb/dock/_action/get_result", ["irobot_create_msgs/action/Dock_GetResult"]),
        ("/tb/dock/_action/send_goal", ["irobot_create_msgs/action/Dock_SendGoal"]),
        ("/tb/get_parameters", ["rcl_interfaces/srv/GetParameters"]),
    ]
    node = SimpleNamespace(get_service_names_and_types_by_node=lambda name, space: listed)
    seen = dict(look._services(node, "tb", "/"))
    assert seen["/tb/dock"] == "irobot_create_msgs/action/Dock"
    assert seen["/tb/get_parameters"] == "rcl_interfaces/srv/GetParameters"


def test_a_whole_graph_is_not_waited_for(seen: Any) -> None:
    answer, took = seen(lambda _: graph())
    assert not answer["incomplete"]
    assert took == pytest.approx(2.0, abs=0.5)


@pytest.mark.parametrize("late", [*PUBLISHERS, *SUBSCRIPTIONS])
def test_what_is_expected_is_waited_for(seen: Any, late: Endpoint) -> None:
    """Seven seconds in which nothing else appears: announcements were lost twice."""
    answer, took = seen(lambda now: graph() if now > 7 else graph(late))
    [driver] = answer["launched"][UNIT].nodes.values()
    assert (driver.publishes.keys(), driver.subscribes.keys()) == ({ODOM}, {DRIVEN})
    assert answer["receivers"][DRIVEN] == [ROBOT]
    assert answer["nodes"][GATE].subscribes.keys() == {"/tb/cmd_vel"}
    assert not answer["incomplete"]
    assert took == pytest.approx(7.5, abs=0.5)


def test_nodes_on_other_hosts_are_waited_for(seen: Any) -> None:
    wanted = WANTED._replace(nodes={}, launched={}, peers=[GATE])
    answer, _ = seen(lambda now: graph() if now > 7 else graph(*SUBSCRIPTIONS), wanted)
    assert answer["receivers"][DRIVEN] == [ROBOT]


def test_a_graph_that_still_grows_is_looked_at_again(seen: Any) -> None:
    """Nodes that nobody expects appear too: two looks must agree."""
    answer, _ = seen(lambda now: graph(more=int(now * 4) if now < 5 else 20))
    assert answer["seen"] == 22


def test_what_is_still_missing_in_a_quiet_graph_is_reported(seen: Any) -> None:
    answer, took = seen(lambda _: graph(SUBSCRIPTIONS[1]))
    [driver] = answer["launched"][UNIT].nodes.values()
    assert (driver.registered, driver.subscribes, answer["launched"][UNIT].error) == (True, {}, "")
    assert answer["receivers"][DRIVEN] == []
    assert not answer["incomplete"]
    assert took == pytest.approx(10.0, abs=0.5)


def test_a_service_is_waited_for_until_the_graph_is_quiet(seen: Any) -> None:
    answer, took = seen(lambda now: graph(services=DOCKS if now > 3 else {}))
    assert took == pytest.approx(3.5, abs=0.5)
    [driver] = answer["launched"][UNIT].nodes.values()
    assert driver.provides == DOCKS[ROBOT]
    answer, _ = seen(lambda _: graph(services={ROBOT: {"/tb/undock": "irobot_create_msgs/action/Undock"}}))
    [driver] = answer["launched"][UNIT].nodes.values()
    assert (driver.provides, answer["incomplete"]) == ({}, False)


def test_an_expected_node_that_is_dead_is_reported(seen: Any) -> None:
    answer, _ = seen(lambda _: Graph([], [], []))
    assert answer["nodes"][GATE].registered is False
    assert answer["launched"][UNIT] == LaunchedSeen()


def test_what_is_missing_while_the_graph_grows_is_unknown(seen: Any) -> None:
    answer, took = seen(lambda now: graph(SUBSCRIPTIONS[1], more=int(now)))
    assert answer["incomplete"]
    assert "still changed" in answer["launched"][UNIT].error
    assert answer["nodes"][GATE].registered is True
    assert took == pytest.approx(20.0, abs=0.5)
    answer, _ = seen(lambda now: graph(SUBSCRIPTIONS[0], more=int(now)))
    assert answer["nodes"][GATE].registered is None
    assert answer["launched"][UNIT].error == ""
