"""Every port on which a swarm's hosts listen, as its middleware and its multimaster provider declare them."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from swarmctl.render.middleware import middleware_of
from swarmctl.render.multimaster import provider_of
from swarmctl.spec.model import Spec
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.ports import SSH, Listener, ssh_port
from swarmctl.swarm.resolved import Island, joinable
from swarmctl.swarm.ros_processes import ros_processes


def listeners(index: SwarmIndex) -> Iterator[Listener]:
    """Yields every listener of a swarm: host by host in the order of the spec, then island by island.

    Last are the ports on which drivers receive from robots with an address, in the order of ``links``.
    """
    spec, islands = index.spec, index.islands
    for name in spec.hosts:
        yield Listener(name, ssh_port(spec, name), SSH, ("hosts", name, "port"))
    processes, joined = ros_processes(index), joinable(islands)
    for island in islands:
        yield from middleware_of(island.distro).listeners(spec, island, processes)
        if island.name in joined:
            yield from provider_of(spec.multimaster, island.distro).listeners(spec, island)
    for number, ends in index.ip_links.items():
        link = ends.link
        for place, port in enumerate(ends.local_ports):
            loc = ("links", number, "local_ports", place) if link.local_ports else ("links", number, "robot")
            yield Listener(link.host, port, f"the driver of `{link.robot}`", loc, link.kind)


def master_offsets(spec: Spec, islands: Collection[Island]) -> tuple[int, ...]:
    """Returns the ports that belong to a master, counted from its own."""
    joined = joinable(islands)
    distros = {one.distro for one in islands if one.has_master and one.name in joined}
    return (0, *sorted({port for one in distros for port in provider_of(spec.multimaster, one).offsets}))
