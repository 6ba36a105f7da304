"""The flows of a swarm, from its islands, bridges, multimaster and clocks, and from nothing else. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from swarmctl.plugins import MULTIMASTERS
from swarmctl.spec.model import Spec
from swarmctl.swarm.bridges import provider_name
from swarmctl.swarm.clocks import followed
from swarmctl.swarm.flow import Flow, Service
from swarmctl.swarm.resolved import Bridge, Island, Swarm, joinable


def ros_flows(spec: Spec, islands: Sequence[Island], bridges: Iterable[Bridge]) -> Iterator[Flow]:
    """Yields the flows between units of ROS: within islands, over bridges, between multimasters."""
    for island in islands:
        others = tuple(host for host in island.hosts if host != island.hub)
        if others:
            if island.has_master:
                yield Flow(others, (island.hub,), Service.MASTER, f"island {island.name}")
            yield Flow(island.hosts, island.hosts, Service.NODES, f"island {island.name}")
    by_name = {island.name: island for island in islands}
    for (origin, to), topics in _crossing(bridges).items():
        yield from _between(spec, by_name[origin], by_name[to], ", ".join(topics))
    joined = joinable(islands)
    discovering = [one for one in islands if one.name in joined and _discovers(spec, one)]
    if discovering:
        hubs = tuple(island.hub for island in discovering)
        for service in (Service.MASTER, Service.MULTIMASTER):
            yield Flow(hubs, hubs, service, "discovers masters")


def _between(spec: Spec, start: Island, end: Island, named: str) -> Iterator[Flow]:
    """The flows over which topics cross. A master calls the node that subscribes to them there."""
    if start.has_master is not end.has_master:
        relay, other = (start, end) if end.has_master else (end, start)
        yield Flow((relay.hub,), (other.hub,), Service.MASTER, f"joins {named}")
        if start is other:
            yield Flow((relay.hub,), other.hosts, Service.NODES, f"receives {named}")
        yield Flow(other.hosts, (relay.hub,), Service.MULTIMASTER, f"exchanges {named}")
    elif (provider := _provider(spec, end)) is not None and provider.relays:
        yield Flow((end.hub,), start.hosts, Service.NODES, f"receives {named}")
        if start.discovery.rmw != "zenoh":  # by which a relay calls, and nobody calls it
            yield Flow(start.hosts, (end.hub,), Service.NODES, f"sends {named}")
    else:
        yield Flow((end.hub,), (start.hub,), Service.MASTER, f"receives {named}")
        yield Flow(end.hosts, start.hosts, Service.NODES, f"receives {named}")
        yield Flow((start.hub,), (end.hub,), Service.NODES, f"announces {named}")


def _crossing(bridges: Iterable[Bridge]) -> Mapping[tuple[str, str], list[str]]:
    """The topics that cross, by island of origin and by receiving island."""
    found: dict[tuple[str, str], dict[str, None]] = {}
    for bridge in bridges:
        for to in bridge.to:
            found.setdefault((bridge.origin, to), {})[bridge.topic] = None
    return {ends: list(topics) for ends, topics in found.items()}


def _discovers(spec: Spec, island: Island) -> bool:
    """True if its multimaster finds others by heartbeats."""
    provider = _provider(spec, island)
    return provider is not None and provider.discovery is not None


def _provider(spec: Spec, island: Island) -> Any:
    """What joins the island to others of its ROS, a ``MultimasterProvider``; None without one."""
    name = provider_name(spec.multimaster, island.distro)
    return MULTIMASTERS.get(name) if name else None


def flows_of(swarm: Swarm) -> Iterator[Flow]:
    """Yields all flows of a swarm: of its units of ROS, of those who follow a clock, and of people."""
    yield from swarm.flows
    clocks = followed(swarm)
    for root in dict.fromkeys(clocks.values()):
        followers = tuple(host for host, one in clocks.items() if one == root)
        yield Flow(followers, (root,), Service.CLOCK, "follows its time")
    yield Flow((), tuple(swarm.hosts), Service.SSH, "swarmctl and people log in")
