"""The ports of a swarm's hosts: ranges that Linux reserves, SSH, and the search for a free master port."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

from swarmctl.spec.model import Spec
from swarmctl.swarm.resolved import Island

SSH = "the SSH server"
EPHEMERAL = range(32768, 61000)  # Linux draws ports of outgoing connections here (ip_local_port_range)
USUAL_MASTER = 11311


@dataclass(frozen=True)
class PortRange:
    """The ports from ``first`` to ``last``, both included."""

    protocol: Literal["tcp", "udp"]
    first: int
    last: int


#: Where nodes of ROS 1 listen: on any port of the range that Linux draws from, which a host may change.
DRAWN = PortRange("tcp", EPHEMERAL[0], EPHEMERAL[-1])

Loc = tuple[str | int, ...]


@dataclass(frozen=True)
class Listener:
    """What listens on which port of a host, and where the spec sets it (``loc``).

    ``runs`` is false for tools that are no part of the swarm, but take the port once somebody opens them.
    """

    host: str
    port: int
    what: str
    loc: Loc
    protocol: str = "tcp"
    runs: bool = True

    @property
    def of_robot(self) -> bool:
        """True for a port on which a driver receives what its robot sends."""
        return self.loc[0] == "links"


def ssh_port(spec: Spec, host: str) -> int:
    """Returns the SSH port of a host: its own, the swarm's default, or 22."""
    given, default = spec.hosts[host], spec.defaults.host.port
    return given.port if default is None or "port" in given.model_fields_set else default


def master_loc(spec: Spec, island: Island) -> Loc:
    """Returns where the spec sets the port of the master of ``island``."""
    own = spec.hosts[island.hub].master_port
    return ("hosts", island.hub, "master_port") if own else ("ros", "master_port")


def free_master_port(taken: Collection[int], offsets: Sequence[int]) -> int | None:
    """Returns the first port from the usual one on that is free, with the ports at ``offsets`` from it."""
    for port in range(USUAL_MASTER, EPHEMERAL[0] - max(offsets)):
        if not any(port + offset in taken for offset in offsets):
            return port
    return None
