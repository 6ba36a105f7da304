"""Which host may make which call to the master: one row a call."""

from __future__ import annotations

from typing import Any

import pytest
from swarm_onboard.guard import policy
from swarm_onboard.guard.config import parse
from swarm_onboard.guard.policy import MOST_PUBLISHERS, MOST_REGISTRATIONS, Policy, RefusedError

from tests.onboard.guard.facts import EPUCK, K3, LAPTOP, OTHER, parameters

CONFIG = parse(parameters(11311))
TYPE = "std_msgs/String"


def at(host: str, scheme: str = "http") -> str:
    return f"{scheme}://{host}:40000" + ("/" if scheme == "http" else "")


def publish(node: str, topic: str, host: str) -> tuple[Any, ...]:
    return ("registerPublisher", node, topic, TYPE, at(host))


def serve(node: str, service: str, host: str, own: str = "") -> tuple[Any, ...]:
    return ("registerService", node, service, at(host, "rosrpc"), at(own or host))


def refusal(judge: Policy, source: str, call: tuple[Any, ...]) -> str:
    try:
        judge.check(CONFIG.callers[source], call[0], call[1:])
    except RefusedError as error:
        return str(error)
    return ""


PASS = [
    (K3, publish("/k3/driver", "/k3/odom", K3)),
    (K3, publish("/k3/driver", "/k3/odom", "K3-pi")),
    (K3, publish("/k3/driver", "/rosout", K3)),
    (K3, publish("/k3/own", "/k3/cmd_vel", K3)),
    (K3, publish("/slam", "/map", K3)),
    (EPUCK, publish("/k3/follow", "/rosout", EPUCK)),
    (LAPTOP, publish("/k3/driver", "/far/odom", OTHER)),  # by the multimaster
    (LAPTOP, publish("/rosout", "/rosout_agg", "localhost")),
    ("127.0.0.1", ("setParam", "/roslaunch", "/run_id", "1")),
    (LAPTOP, ("setParam", "/x", "/k3/rate", 3)),
    (K3, ("unregisterPublisher", "/k3/driver", "/k3/odom", at(K3))),
    (K3, ("registerSubscriber", "/rviz_12", "/epuck/odom", "*", at(K3))),
    (K3, serve("/k3/driver", "/k3/driver/get_loggers", K3)),
    (EPUCK, serve("/k3/follow", "/k3/follow/get_loggers", EPUCK)),
    (K3, ("unregisterService", "/k3/driver", "/k3/stop", at(K3, "rosrpc"))),
    (K3, ("subscribeParam", "/slam", at(K3), "/epuck/rate")),
    (K3, ("setParam", "/roslaunch", "/k3/rate", 3)),
    (K3, ("setParam", "/roslaunch", "/roslaunch/uris/host_k3", "x")),
    (EPUCK, ("setParam", "/roslaunch", "/k3/follow/gain", 3)),
    (K3, ("setParam", "/gazebo", "/use_sim_time", False)),
    (K3, ("deleteParam", "/roslaunch", "/k3/rate")),
    (K3, ("getParam", "/roslaunch", "/epuck/rate")),
    (OTHER, ("registerSubscriber", "/multimaster_other", "/k3/odom", TYPE, at(OTHER))),
    (OTHER, ("unregisterSubscriber", "/multimaster_other", "/k3/odom", at(OTHER))),
    (OTHER, ("getSystemState", "/multimaster_other")),
    (OTHER, publish("/far/driver", "/far/scan", OTHER)),  # by a relay
]

REFUSED = [
    (K3, ("shutdown", "/x", "bye"), "no call for others"),
    (LAPTOP, ("shutdown", "/x", "bye"), "no call for others"),
    (LAPTOP, ("__class__", "/x"), "no call for others"),
    (K3, ("system.multicall", []), "no call for others"),  # within another
    (K3, publish("/k3/driver", "/k3/odom", EPUCK), f"`http://{EPUCK}:40000/` is not on this host"),
    (K3, publish("/k3/driver", "/k3/odom", "localhost"), "`http://localhost:40000/` is not on this host"),
    (K3, publish("/x", "/y", f"{K3}@{EPUCK}"), f"`http://{K3}@{EPUCK}:40000/` is no URI of a node"),
    (K3, serve("/k3/driver", "/k3/stop", EPUCK, own=K3), f"`rosrpc://{EPUCK}:40000` is not on this host"),
    (LAPTOP, publish("/x", "/y", "203.0.113.9"), "`http://203.0.113.9:40000/` is not on this host"),
    (EPUCK, publish("/k3/driver", "/x", EPUCK), "/k3/driver belongs to k3-pi"),
    (K3, publish("/epuck/own", "/x", K3), "/epuck/own belongs to epuck-pi"),
    (K3, publish("/k3/follow", "/x", K3), "/k3/follow belongs to epuck-pi"),
    (K3, publish("/rosout", "/rosout_agg", K3), "/rosout belongs to laptop"),
    (K3, publish("//k3/driver", "/x", K3), "`//k3/driver` is no global name"),
    (EPUCK, publish("/k3/follow", "/k3//odom", EPUCK), "`/k3//odom` is no global name"),
    (EPUCK, publish("/k3/follow", "odom", EPUCK), "`odom` is no global name"),
    (EPUCK, ("registerSubscriber", "/k3/driver", "/x", TYPE, at(EPUCK)), "/k3/driver belongs to k3-pi"),
    (EPUCK, ("unregisterPublisher", "/k3/driver", "/k3/odom", at(EPUCK)), "/k3/driver belongs to k3-pi"),
    (EPUCK, ("unregisterPublisher", "/k3/follow", "/x", at(K3)), f"`http://{K3}:40000/` is not on this host"),
    (EPUCK, publish("/k3/follow", "/k3/odom", EPUCK), "k3-pi may publish /k3/odom"),
    (EPUCK, publish("/x", "/k3/cmd_vel", EPUCK), "k3-pi, laptop may publish /k3/cmd_vel"),
    (K3, publish("/x", "/far/odom", K3), "no host of this island may publish /far/odom"),
    (K3, serve("/x", "/epuck/stop", K3), "/epuck/stop belongs to epuck-pi"),
    (EPUCK, ("unregisterService", "/k3/driver", "/s", at(EPUCK, "rosrpc")), "/k3/driver belongs to k3-pi"),
    (K3, ("subscribeParam", "/slam", at(EPUCK), "/k"), f"`http://{EPUCK}:40000/` is not on this host"),
    (K3, ("setParam", "/x", "/run_id", "1"), "/run_id is set by the master's host"),
    (K3, ("setParam", "/x", "//run_id/", "1"), "/run_id is set by the master's host"),
    (K3, ("setParam", "/x", "/run_id/y", "1"), "/run_id is set by the master's host"),
    (K3, ("deleteParam", "/x", "/run_id"), "/run_id is set by the master's host"),
    (K3, ("setParam", "/x", "/use_sim_time", True), "/use_sim_time is set by the master's host"),
    (K3, ("setParam", "/x", "/use_sim_time", 0), "/use_sim_time is set by the master's host"),
    (K3, ("setParam", "/x", "/", {}), "/run_id is set by the master's host"),
    (K3, ("setParam", "/x", "run_id", "1"), "`run_id` is no global name"),
    (K3, ("setParam", "/x", "/epuck/rate", 3), "/epuck/rate belongs to epuck-pi"),
    (K3, ("setParam", "/x", "/k3", {}), "/k3/follow in it belongs to epuck-pi"),
    (K3, ("deleteParam", "/x", "/k3"), "/k3/follow in it belongs to epuck-pi"),
    (K3, ("setParam", "/x", 3, 3), "invalid arguments"),
    (K3, ("registerPublisher", "/x", "/y", TYPE, 3), "invalid arguments"),
    (K3, ("unregisterPublisher", "/x", "/y", 3), "invalid arguments"),
    (K3, ("getParam", "/x"), "invalid arguments"),
    (K3, ("getParam", "/x", "/" + "y" * policy.LONGEST), "invalid arguments"),
    (OTHER, publish("/x", "/k3/odom", OTHER), "nothing brings /k3/odom from its island"),
    (OTHER, publish("/k3/driver", "/far/scan", OTHER), "/k3/driver belongs to k3-pi"),
    (OTHER, ("subscribeParam", "/x", at(OTHER), "/y"), "hosts of other islands only subscribe and publish"),
    (OTHER, ("registerSubscriber", "/x", "/y", "*", at(OTHER)), "nothing brings /y to its island"),
    (OTHER, serve("/x", "/y", OTHER), "hosts of other islands only subscribe and publish"),
    (OTHER, ("setParam", "/x", "/y", 1), "hosts of other islands set no parameters"),
    (OTHER, ("setParam", "/x", "/rosversion", 1), "hosts of other islands set no parameters"),
]  # fmt: skip


@pytest.mark.parametrize(("source", "call"), PASS, ids=str)
def test_passes(source: str, call: tuple[Any, ...]) -> None:
    assert not refusal(Policy(CONFIG), source, call)


@pytest.mark.parametrize(("source", "call", "reason"), REFUSED, ids=str)
def test_is_refused(source: str, call: tuple[Any, ...], reason: str) -> None:
    assert refusal(Policy(CONFIG), source, call) == reason


def test_a_name_that_nobody_owns_belongs_to_the_host_on_which_it_runs() -> None:
    """The master would shut the first node down."""
    judge = Policy(CONFIG)
    assert not refusal(judge, K3, publish("/slam", "/map", K3))
    assert refusal(judge, EPUCK, publish("/slam", "/map", EPUCK)) == "a node of that name runs on k3-pi"
    assert not refusal(judge, K3, ("unregisterPublisher", "/slam", "/map", at(K3)))
    assert not refusal(judge, EPUCK, publish("/slam", "/map", EPUCK))


def test_a_node_that_has_ended_watches_nothing() -> None:
    """One of rospy unregisters what it publishes, and not the parameters that it watches."""
    judge = Policy(CONFIG)
    assert not refusal(judge, K3, publish("/slam", "/map", K3))
    assert not refusal(judge, K3, ("subscribeParam", "/slam", at(K3), "/rate"))
    assert not refusal(judge, K3, ("unregisterPublisher", "/slam", "/map", at(K3)))
    assert not refusal(judge, EPUCK, publish("/slam", "/map", EPUCK))


def test_a_declared_node_may_move_between_its_hosts() -> None:
    judge = Policy(CONFIG)
    assert not refusal(judge, K3, publish("/k3/own", "/x", K3))
    assert not refusal(judge, EPUCK, publish("/k3/own", "/x", EPUCK))


def test_the_versions_of_ros_are_those_of_the_masters_host() -> None:
    """Every roslaunch sets them, and ends if it may not."""
    judge, call = Policy(CONFIG), ("/roslaunch", "/rosversion", "1.15.14")
    answer = judge.answer(CONFIG.callers[K3], "setParam", call)
    assert answer is not None
    assert answer[0] == 1
    assert judge.answer(CONFIG.callers[LAPTOP], "setParam", call) is None


def test_the_uri_of_the_master_is_that_of_the_guard() -> None:
    assert Policy(CONFIG).answer(CONFIG.callers[K3], "getUri", ("/x",)) == [1, "", CONFIG.uri]


def test_registrations_are_bounded_for_each_host() -> None:
    judge = Policy(CONFIG)
    for number in range(MOST_REGISTRATIONS):
        assert not refusal(judge, K3, publish("/x", f"/t{number}", K3))
    assert refusal(judge, K3, publish("/x", "/more", K3)) == "this host has 2000 registrations"
    assert not refusal(judge, K3, publish("/x", "/t0", K3))
    assert not refusal(judge, EPUCK, publish("/y", "/more", EPUCK))
    assert not refusal(judge, K3, ("unregisterPublisher", "/x", "/t0", at(K3)))
    assert not refusal(judge, K3, publish("/x", "/more", K3))


def test_a_node_that_starts_again_counts_once() -> None:
    judge = Policy(CONFIG)
    for port in range(1, 2 * MOST_REGISTRATIONS):
        assert not refusal(judge, K3, ("registerPublisher", "/x", "/t", TYPE, f"http://{K3}:{port}/"))


def test_unregistering_at_another_uri_lowers_no_count() -> None:
    judge = Policy(CONFIG)
    for number in range(MOST_REGISTRATIONS):
        assert not refusal(judge, K3, serve("/x", f"/s{number}", K3))
    assert not refusal(judge, K3, ("unregisterService", "/x", "/s0", f"rosrpc://{K3}:1"))
    assert refusal(judge, K3, serve("/x", "/more", K3))


def test_publishers_of_a_topic_on_a_host_are_bounded() -> None:
    judge = Policy(CONFIG)
    for number in range(MOST_PUBLISHERS):
        assert not refusal(judge, K3, publish(f"/n{number}", "/t", K3))
    assert refusal(judge, K3, publish("/more", "/t", K3)) == "64 nodes of this host publish /t"
    assert not refusal(judge, EPUCK, publish("/more", "/t", EPUCK))
