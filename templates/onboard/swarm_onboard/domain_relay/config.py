"""The parameter file of the relay as frozen values. Written by swarmctl, readable by people.

island: k3-pi                           # the island that this node serves
node: /multimaster_k3_pi                # its name in every domain and at every master; unique per island
domain: 12                              # ROS_DOMAIN_ID of its own island
address: 192.168.77.20                  # at which masters and nodes of ROS 1 reach this host
peers:
- island: koala-laptop                  # of ROS 2
  domain: 11
  environment: {ROS_DISCOVERY_SERVER: "192.168.77.10:11811"}  # in its domain, in place of that of the process
  receives:                             # topics that come here
  - {topic: /k3/cmd_vel, type: geometry_msgs/Twist, command: true}
- island: epuck-pi                      # of ROS 1
  master: http://192.168.77.10:11311
  hosts: [192.168.77.10, epuck-pi]      # addresses and names in the URIs of the island's nodes
  receives:
  - {topic: /epuck/odom, type: nav_msgs/Odometry}
  sends:                                # topics that go there
  - {topic: /epuck/cmd_vel, type: geometry_msgs/Twist, command: true}
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Mapping

from swarm_onboard.common.parameters import loaded
from swarm_onboard.common.xmlrpc import PeerError, place_of

_NAME = re.compile(r"/[A-Za-z][A-Za-z0-9_/]{0,250}")
_TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True)
class Crossing:
    """A topic that crosses. ``command``: old ones are of no use to anybody."""

    topic: str
    type: str
    command: bool


@dataclass(frozen=True)
class Peer:
    """Another island of ROS 2, with the topics that come from it."""

    island: str
    domain: int
    environment: Mapping[str, str]
    receives: tuple[Crossing, ...]


@dataclass(frozen=True)
class Ros1Peer:
    """An island of ROS 1, with the topics that come from it and those that go there."""

    island: str
    master: str
    hosts: frozenset[str]
    receives: tuple[Crossing, ...]
    sends: tuple[Crossing, ...]


@dataclass(frozen=True)
class Config:
    """All parameters of the node."""

    island: str
    node: str
    domain: int
    address: str
    peers: tuple[Peer, ...]
    ros1_peers: tuple[Ros1Peer, ...]


def load(path: Path) -> Config:
    """Returns the parameters in ``path``. Raises ``ConfigError``."""
    return loaded(path, parse)


def parse(data: Mapping[str, Any]) -> Config:
    """The parameters in ``data``. Raises KeyError, TypeError, ValueError or AttributeError if invalid."""
    config = Config(
        str(data["island"]),
        _matching("node", data["node"], _NAME),
        _domain(data["domain"]),
        str(data.get("address", "")).lower(),
        tuple(_peer(one) for one in data["peers"] if "master" not in one),
        tuple(_ros1_peer(one) for one in data["peers"] if "master" in one),
    )
    # Otherwise its own topics would come back to it.
    _all_different("domain", [config.domain, *(peer.domain for peer in config.peers)])
    _all_different("master", [peer.master for peer in config.ros1_peers])
    if config.ros1_peers:
        hosts = [host for peer in config.ros1_peers for host in peer.hosts]
        _all_different("host", [_host("address", config.address), *hosts])
    return config


def _peer(data: Mapping[str, Any]) -> Peer:
    environment = {str(name): str(value) for name, value in data.get("environment", {}).items()}
    return Peer(str(data["island"]), _domain(data["domain"]), environment, _crossings(data["receives"]))


def _ros1_peer(data: Mapping[str, Any]) -> Ros1Peer:
    try:
        place_of(data["master"])
    except PeerError as error:
        raise ValueError(str(error)) from error
    hosts = frozenset(_host("hosts", host) for host in data["hosts"])
    if not hosts:
        raise ValueError("island `{}` has no hosts".format(data["island"]))
    crossings = (_crossings(data.get(way, ())) for way in ("receives", "sends"))
    return Ros1Peer(str(data["island"]), str(data["master"]), hosts, *crossings)


def _crossings(data: Any) -> tuple[Crossing, ...]:
    return tuple(
        Crossing(
            _matching("topic", one["topic"], _NAME),
            _matching("type", one["type"], _TYPE),
            bool(one.get("command", False)),
        )
        for one in data
    )


def _all_different(what: str, values: list[Any]) -> None:
    twice = sorted({value for value in values if values.count(value) > 1})
    if twice:
        raise ValueError(f"two islands have one {what}: {', '.join(map(str, twice))}")


def _domain(value: Any) -> int:
    if not isinstance(value, int) or not 0 <= value <= 232:
        raise ValueError(f"`domain` is not a number from 0 to 232: {value!r}")
    return value


def _host(name: str, value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise ValueError(f"`{name}` is not an address or a name: {value!r}")
    return value.lower()


def _matching(name: str, value: Any, pattern: re.Pattern[str]) -> str:
    if not isinstance(value, str) or not pattern.fullmatch(value):
        raise ValueError(f"`{name}` is not a valid ROS name or type: {value!r}")
    return value
