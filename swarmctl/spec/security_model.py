"""The level of `security` of a swarm and of an island, and the network of its WireGuard, in a spec."""

from __future__ import annotations

import ipaddress
from typing import Annotated

from pydantic import AfterValidator

from swarmctl.field_types import Subnet
from swarmctl.plugins import SECURITY_LEVELS, NameIn

_LONGEST_PREFIX = 20  # bits: addresses of hosts follow from their names, and no two may be the same


class _OfIslands:
    """The levels that an island can have of its own: WireGuard is between all hosts of a swarm."""

    def names(self) -> tuple[str, ...]:
        return tuple(name for name in SECURITY_LEVELS if name in self)

    def __contains__(self, name: object) -> bool:
        return name in SECURITY_LEVELS and not has_wireguard(str(name))


def has_wireguard(level: str) -> bool:
    """Returns True if ROS uses WireGuard in a swarm with this level."""
    return bool(SECURITY_LEVELS.get(level).wireguard)


Security = Annotated[str, NameIn(SECURITY_LEVELS)]
IslandSecurity = Annotated[str, NameIn(_OfIslands())]


def _large(value: str) -> str:
    network = ipaddress.ip_network(value)
    if network.version == 6 or network.prefixlen > _LONGEST_PREFIX:
        raise ValueError(f"`{value}` is not an IPv4 subnet of 4096 addresses or more, like 10.200.0.0/16")
    return value


Overlay = Annotated[Subnet, AfterValidator(_large)]
