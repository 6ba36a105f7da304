"""The parameter file of the relay: what swarmctl writes is read; what loops or cannot be is refused."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import pytest
from swarm_onboard.domain_relay.config import Config, Crossing, Ros1Peer, parse

DATA: dict[str, Any] = {
    "island": "k3-pi",
    "node": "/multimaster_k3_pi",
    "domain": 12,
    "peers": [
        {
            "island": "koala-laptop",
            "domain": 11,
            "receives": [
                {"topic": "/k3/cmd_vel", "type": "geometry_msgs/Twist", "command": True},
                {"topic": "/map", "type": "nav_msgs/OccupancyGrid"},
            ],
        }
    ],
}


ROS_1: dict[str, Any] = {
    "island": "koala",
    "master": "http://192.168.77.10:11311",
    "hosts": ["192.168.77.10", "Koala-Laptop"],
    "receives": [{"topic": "/koala/odom", "type": "nav_msgs/Odometry"}],
    "sends": [{"topic": "/koala/cmd_vel", "type": "geometry_msgs/Twist", "command": True}],
}


def with_ros_1(change: Callable[[Any], Any] = lambda _data: None) -> Config:
    """The parameters of a relay with a peer of ROS 1 as well, after a change."""
    data = copy.deepcopy({**DATA, "address": "192.168.77.20"})
    data["peers"].append(copy.deepcopy(ROS_1))
    change(data)
    return parse(data)


def test_a_peer_of_ros_1_is_read() -> None:
    assert with_ros_1().ros1_peers == (
        Ros1Peer(
            "koala",
            "http://192.168.77.10:11311",
            frozenset({"192.168.77.10", "koala-laptop"}),
            (Crossing("/koala/odom", "nav_msgs/Odometry", command=False),),
            (Crossing("/koala/cmd_vel", "geometry_msgs/Twist", command=True),),
        ),
    )


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda data: data.update(address="192.168.77.10"), "two islands have one host: 192.168.77.10"),
        (lambda data: data.pop("address"), "`address` is not an address or a name"),
        (lambda data: data["peers"].append(ROS_1), "two islands have one master"),
        (lambda data: data["peers"][1].update(master="192.168.77.10"), "is not an address"),
        (lambda data: data["peers"][1].update(hosts=[]), "has no hosts"),
    ],
)
def test_a_peer_of_ros_1_that_cannot_be_is_refused(change: Callable[[Any], None], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        with_ros_1(change)


def test_what_is_written_is_read() -> None:
    (peer,) = parse(DATA).peers
    assert peer.receives == (
        Crossing("/k3/cmd_vel", "geometry_msgs/Twist", command=True),
        Crossing("/map", "nav_msgs/OccupancyGrid", command=False),
    )


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda data: data["peers"][0].update(domain=12), "two islands have one domain"),
        (lambda data: data["peers"].append(data["peers"][0]), "two islands have one domain"),
        (lambda data: data.update(domain=233), "not a number from 0 to 232"),
        (lambda data: data.update(domain="12"), "not a number from 0 to 232"),
        (lambda data: data.update(node="multimaster"), "not a valid ROS name"),
        (lambda data: data["peers"][0]["receives"][0].update(type="os"), "not a valid ROS name or type"),
    ],
)
def test_a_wrong_file_is_refused(change: Callable[[Any], None], complaint: str) -> None:
    data = copy.deepcopy(DATA)
    change(data)
    with pytest.raises(ValueError, match=complaint):
        parse(data)


def test_another_island_may_have_a_discovery_server_of_its_own() -> None:
    servers = {"ROS_DISCOVERY_SERVER": "192.168.77.10:11811"}
    peer = {**DATA["peers"][0], "environment": servers}
    assert parse({**DATA, "peers": [peer]}).peers[0].environment == servers
    assert parse(DATA).peers[0].environment == {}
