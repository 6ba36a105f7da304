"""The parameter file of the relay as frozen values. Written by swarmctl, readable by people.

island: k3-pi                           # the island that this node serves
node: /multimaster_k3_pi                # its name in every domain; unique per island
domain: 12                              # ROS_DOMAIN_ID of its own island
peers:
- island: koala-laptop
  domain: 11
  receives:                             # topics that come here
  - {topic: /k3/cmd_vel, type: geometry_msgs/Twist, command: true}
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Mapping

from swarm_onboard.common.parameters import loaded

_NAME = re.compile(r"/[A-Za-z][A-Za-z0-9_/]{0,250}")
_TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True)
class Crossing:
    """A topic that comes here. ``command``: old ones are of no use to anybody."""

    topic: str
    type: str
    command: bool


@dataclass(frozen=True)
class Peer:
    """Another island, with the topics that come from it."""

    island: str
    domain: int
    receives: tuple[Crossing, ...]


@dataclass(frozen=True)
class Config:
    """All parameters of the node."""

    island: str
    node: str
    domain: int
    peers: tuple[Peer, ...]


def load(path: Path) -> Config:
    """Returns the parameters in ``path``. Raises ``ConfigError``."""
    return loaded(path, parse)


def parse(data: Mapping[str, Any]) -> Config:
    """The parameters in ``data``. Raises KeyError, TypeError, ValueError or AttributeError if invalid."""
    peers = tuple(_peer(one) for one in data["peers"])
    domains = [_domain(data["domain"]), *(peer.domain for peer in peers)]
    if len(set(domains)) < len(domains):  # its own topics would come back to it
        raise ValueError(f"two islands have one domain: {domains}")
    return Config(str(data["island"]), _matching("node", data["node"], _NAME), domains[0], peers)


def _peer(data: Mapping[str, Any]) -> Peer:
    receives = tuple(
        Crossing(
            _matching("topic", one["topic"], _NAME),
            _matching("type", one["type"], _TYPE),
            bool(one.get("command", False)),
        )
        for one in data["receives"]
    )
    return Peer(str(data["island"]), _domain(data["domain"]), receives)


def _domain(value: Any) -> int:
    if not isinstance(value, int) or not 0 <= value <= 232:
        raise ValueError(f"`domain` is not a number from 0 to 232: {value!r}")
    return value


def _matching(name: str, value: Any, pattern: re.Pattern[str]) -> str:
    if not isinstance(value, str) or not pattern.fullmatch(value):
        raise ValueError(f"`{name}` is not a valid ROS name or type: {value!r}")
    return value
