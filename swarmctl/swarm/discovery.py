"""How the nodes of an island of ROS 2 find each other: the defaults of `rmw`, `domain`, `discovery`. Pure."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle, islice

from swarmctl.plugins import MIDDLEWARES
from swarmctl.spec.model import Mode
from swarmctl.spec.ros_model import METHODS, SERVED, Method, Rmw, Ros

#: The numbers that domains get by default; each of their ports is below those of outgoing connections.
DOMAINS = range(1, 102)


@dataclass(frozen=True)
class Discovery:
    """How the nodes of one island find each other. The place of a host in ``servers`` is its server's id."""

    rmw: Rmw = "fastrtps"
    method: Method = "server"
    servers: tuple[str, ...] = ()
    domain: int = 0


def has_master(distro: str) -> bool:
    """Returns True if nodes of a ROS distribution register at a master, as those of ROS 1 do."""
    return "master" in MIDDLEWARES.get(distro).capabilities


def discovery_of(ros: Ros, mode: Mode, hub: str, hosts: Sequence[str], domain: int) -> Discovery:
    """Returns how the nodes on ``hosts`` find each other, in an island of a swarm that works in ``mode``."""
    rmw = ros.rmw or "fastrtps"
    method = ros.method
    if mode is Mode.SINGLE_MINDED and "local" in METHODS[rmw] and not ros.servers and not ros.discovery:
        method = "local"
    named = tuple(one for one in dict.fromkeys(ros.servers) if one in hosts)
    return Discovery(rmw, method, (named or (hub,)) if method in SERVED else (), domain)


def domains(swarm: str, first: int | None, count: int) -> Iterator[int]:
    """Yields the domain of each of ``count`` islands; beyond 101 islands some have the same."""
    number = DOMAINS[zlib.crc32(swarm.encode()) % len(DOMAINS)] if first is None else first
    yield number
    place = number - DOMAINS[0] + 1
    following = (*DOMAINS[place:], *DOMAINS[: place - 1]) if number in DOMAINS else tuple(DOMAINS)
    yield from islice(cycle(following), max(0, count - 1))
