"""The parameter file of the static multimaster as frozen values. Written by swarmctl, readable by people.

island: koala-laptop                    # the island that this node serves
node: /multimaster_koala_laptop         # its name at every master; unique per island
master: http://192.168.77.10:11311      # of its own island
address: 192.168.77.10                  # at which the peers' masters reach this host
poll_hz: 1.0                            # of each master
silent_after: 3.0                       # s without an answer, then a peer is silent
remove_after: 60.0                      # s without an answer, then its publishers are removed
peers:
- island: k3-pi
  master: http://192.168.77.11:11311
  hosts: [192.168.77.11, k3-pi]         # addresses and names in the URIs of the island's nodes
  receives:                             # topics that come here
  - {topic: /k3/odom, type: nav_msgs/Odometry}
  sends:                                # topics that the peer's node fetches from here; only reported
  - {topic: /koala/odom, type: nav_msgs/Odometry}
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Mapping

from swarm_onboard.common.parameters import between, loaded
from swarm_onboard.common.xmlrpc import PeerError, place_of

NAME = re.compile(r"/[A-Za-z_][A-Za-z0-9_/]{0,250}")  # as rosgraph has it
_TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True)
class Peer:
    """Another island. ``receives``: topics that come from it; ``sends``: topics that go there; by type."""

    island: str
    master: str
    hosts: frozenset[str]
    receives: Mapping[str, str]
    sends: Mapping[str, str]


@dataclass(frozen=True)
class Config:
    """All parameters of the node. Times in s."""

    island: str
    node: str
    master: str
    address: str
    period: float
    silent_after: float
    remove_after: float
    peers: tuple[Peer, ...]


def load(path: Path) -> Config:
    """Returns the parameters in ``path``. Raises ``ConfigError``."""
    return loaded(path, parse)


def parse(data: Mapping[str, Any]) -> Config:
    """The parameters in ``data``. Raises KeyError, TypeError, ValueError or AttributeError if invalid."""
    peers = tuple(_peer(one) for one in data["peers"])
    silent_after = between("silent_after", data["silent_after"], 0.5, 60.0)
    _all_different("island", [data["island"], *(peer.island for peer in peers)])
    _all_different("master", [data["master"], *(peer.master for peer in peers)])
    _all_different("host", [str(data["address"]).lower(), *(host for peer in peers for host in peer.hosts)])
    return Config(
        island=str(data["island"]),
        node=_matching("node", data["node"], NAME),
        master=_uri(data["master"]),
        address=str(data["address"]),
        period=1.0 / between("poll_hz", data["poll_hz"], 0.1, 10.0),
        silent_after=silent_after,
        remove_after=between("remove_after", data["remove_after"], silent_after, 3600.0),
        peers=peers,
    )


def _peer(data: Mapping[str, Any]) -> Peer:
    hosts = frozenset(str(host).lower() for host in data["hosts"])
    if not hosts:
        raise ValueError("island `{}` has no hosts".format(data["island"]))
    return Peer(
        island=str(data["island"]),
        master=_uri(data["master"]),
        hosts=hosts,
        receives=_topics(data["receives"]),
        sends=_topics(data.get("sends", ())),
    )


def _topics(data: Any) -> Mapping[str, str]:
    return {_matching("topic", one["topic"], NAME): _matching("type", one["type"], _TYPE) for one in data}


def _all_different(what: str, values: list[str]) -> None:
    """Rejects duplicates: distinct values per island keep a topic from returning to its origin."""
    twice = sorted({value for value in values if values.count(value) > 1})
    if twice:
        raise ValueError(f"two islands have the same {what}: {', '.join(twice)}")


def _uri(value: Any) -> str:
    try:
        place_of(value)
    except PeerError as error:
        raise ValueError(str(error)) from error
    return str(value)


def _matching(name: str, value: Any, pattern: re.Pattern[str]) -> str:
    if not isinstance(value, str) or not pattern.fullmatch(value):
        raise ValueError(f"`{name}` is not a valid ROS name or type: {value!r}")
    return value
