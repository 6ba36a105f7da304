"""The parameter file of the guard as frozen values. Written by swarmctl, readable by people.

hub: koala-laptop                       # the host of the master; what it calls is not checked for owners
places: [192.168.77.10, 127.0.0.1]      # where the guard listens
port: 11311
uri: http://192.168.77.10:11311         # of the guard, as nodes have it
use_sim_time: false
hosts:                                  # of the island: addresses and names, as in the URIs of their nodes
  koala-laptop: [192.168.77.10, koala-laptop]
  k3-pi: [192.168.77.11, k3-pi]
others:                                 # hosts of other islands that may call, and the topics that cross
  epuck-pi: {at: [192.168.77.12, epuck-pi], receives: [/k3/odom], sends: []}
joined: [192.168.77.12, epuck-pi]       # where nodes run that a multimaster registers here
names:                                  # who owns a node, service or parameter, and all below it
  /k3: [k3-pi]
  /teleop: [koala-laptop]
topics:                                 # who may publish; everybody may publish others
  /k3/odom: [k3-pi]
"""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Mapping

from swarm_onboard.common.parameters import loaded

LOOPBACK = ("127.0.0.1", "::1", "localhost")


@dataclass(frozen=True)
class Caller:
    """A host that may call. ``at``: its addresses and names; ``receives`` and ``sends``: the only topics to
    which it may subscribe and that it may publish; ``receives`` is None for a host of the island."""

    host: str
    at: frozenset[str]
    receives: frozenset[str] | None = None
    sends: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Config:
    """All parameters of the guard. ``callers`` by IP address; ``named``: URIs that the hub may register."""

    hub: str
    places: tuple[str, ...]
    port: int
    uri: str
    use_sim_time: bool
    callers: Mapping[str, Caller]
    named: frozenset[str]
    names: Mapping[str, frozenset[str]]
    topics: Mapping[str, frozenset[str]]


def load(path: Path) -> Config:
    """Returns the parameters in ``path``. Raises ``ConfigError``."""
    return loaded(path, parse)


def parse(data: Mapping[str, Any]) -> Config:
    """The parameters in ``data``. Raises KeyError, TypeError, ValueError or AttributeError if invalid."""
    hub = str(data["hub"])
    callers = [Caller(host, _lower(at)) for host, at in data["hosts"].items() if host != hub]
    callers.append(Caller(hub, _lower([*data["hosts"][hub], *LOOPBACK])))
    for host, one in data["others"].items():
        crossing = frozenset(one["receives"]), frozenset(one["sends"])
        callers.append(Caller(host, _lower(one["at"]), *crossing))
    return Config(
        hub=hub,
        places=tuple(str(ipaddress.ip_address(one)) for one in data["places"]),
        port=int(data["port"]),
        uri=str(data["uri"]),
        use_sim_time=bool(data["use_sim_time"]),
        callers={text: one for one in callers for text in one.at if _is_address(text)},
        named=_lower(data["joined"]).union(*(one.at for one in callers)),
        names={name: frozenset(hosts) for name, hosts in data["names"].items()},
        topics={name: frozenset(hosts) for name, hosts in data["topics"].items()},
    )


def _lower(texts: Any) -> frozenset[str]:
    return frozenset(str(text).lower() for text in texts)


def _is_address(text: str) -> bool:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True
