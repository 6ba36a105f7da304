"""The ports on which a host listens for its swarm, and those that fkie's other tools take beside a master."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from swarmctl.spec.model import Spec
from swarmctl.spec.multimaster import Multimaster
from swarmctl.topology.swarm import Island

SSH = "the SSH server"
HIGHEST = 65535
PRIVILEGED = range(1, 1024)  # only root, or a process with CAP_NET_BIND_SERVICE
EPHEMERAL = range(32768, 61000)  # Linux draws ports of outgoing connections here (ip_local_port_range)

# fkie's tools count from the port of their master: fkie_master_discovery/__init__.py, its zeroconf twin,
# url.py of fkie_node_manager_daemon, and the README of fkie_mas_daemon.
DISCOVERY_OFFSET = 300
ZEROCONF_OFFSET = 600
DAEMON_OFFSET = 1010
USUAL_MASTER = 11311
_MAS_BASE, _MAS_STEP = 35430 + 255, 101

Loc = tuple[str | int, ...]


@dataclass(frozen=True)
class Listener:
    """Who listens on which port of a host, and where the spec says so (``loc``).

    What does not ``runs`` is no part of the swarm, but starts beside it once somebody opens fkie's GUI.
    """

    host: str
    port: int
    what: str
    loc: Loc
    protocol: str = "tcp"
    runs: bool = True


def ssh_port(spec: Spec, host: str) -> int:
    """The SSH port of a host: its own, the swarm's default, or 22."""
    given, default = spec.hosts[host], spec.defaults.host.port
    return given.port if default is None or "port" in given.model_fields_set else default


def has_discovery(spec: Spec, islands: Collection[Island]) -> bool:
    """Whether a discovery runs beside each master."""
    return len(islands) > 1 and (spec.multimaster or Multimaster()).provider == "fkie"


def offsets(spec: Spec, islands: Collection[Island]) -> tuple[int, ...]:
    """The ports that belong to a master, counted from its own."""
    return (0, DISCOVERY_OFFSET, ZEROCONF_OFFSET, DAEMON_OFFSET) if has_discovery(spec, islands) else (0,)


def discovery_port(island: Island) -> int:
    """The TCP port on which the discovery beside a master tells what is registered there."""
    return island.master_port + DISCOVERY_OFFSET


def listeners(spec: Spec, islands: Sequence[Island]) -> Iterator[Listener]:
    """Every listener of a swarm, host by host in the order of the spec, then master by master."""
    for name in spec.hosts:
        yield Listener(name, ssh_port(spec, name), SSH, ("hosts", name, "port"))
    discovery = has_discovery(spec, islands)
    multicast = (spec.multimaster or Multimaster()).port
    for island in islands:
        hub, master = island.hub, island.master_port
        loc: Loc = ("hosts", hub, "master_port") if spec.hosts[hub].master_port else ("ros", "master_port")
        yield Listener(hub, master, "the ROS master", loc)
        if discovery:
            yield Listener(hub, discovery_port(island), "the master discovery", loc)
            yield Listener(hub, multicast, "the master discovery", ("multimaster", "port"), "udp")
            yield Listener(hub, master + ZEROCONF_OFFSET, "fkie's zeroconf", loc, runs=False)
            yield Listener(hub, master + DAEMON_OFFSET, "fkie's node manager", loc, runs=False)
            mas = _MAS_BASE + _MAS_STEP * (master - USUAL_MASTER)
            yield Listener(hub, mas, "fkie's MAS daemon", loc, runs=False)


def free_master_port(taken: Collection[int], counted: Sequence[int]) -> int | None:
    """The first port from the usual one on where a master and its companions (``counted``) find room."""
    for port in range(USUAL_MASTER, EPHEMERAL[0] - max(counted)):
        if not any(port + offset in taken for offset in counted):
            return port
    return None
