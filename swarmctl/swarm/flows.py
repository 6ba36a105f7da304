"""The flows of a swarm, from its islands, bridges, multimaster and clocks, and from nothing else. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from swarmctl.plugins import MIDDLEWARES, MULTIMASTERS
from swarmctl.spec.model import Spec
from swarmctl.swarm.clocks import followed
from swarmctl.swarm.flow import Flow, Service
from swarmctl.swarm.resolved import Bridge, Island, Swarm


def ros_flows(spec: Spec, islands: Sequence[Island], bridges: Iterable[Bridge]) -> Iterator[Flow]:
    """Yields the flows between units of ROS: within islands, over bridges, between multimasters."""
    masters = "master" in MIDDLEWARES.get(spec.ros.distro).capabilities
    for island in islands:
        others = tuple(host for host in island.hosts if host != island.hub)
        if others:
            if masters:
                yield Flow(others, (island.hub,), Service.MASTER, f"island {island.name}")
            yield Flow(island.hosts, island.hosts, Service.NODES, f"island {island.name}")
    by_name = {island.name: island for island in islands}
    for (origin, to), topics in _crossing(bridges).items():
        start, end, named = by_name[origin], by_name[to], ", ".join(topics)
        if (provider := _provider(spec)) is not None and provider.relays:
            yield Flow((end.hub,), start.hosts, Service.NODES, f"receives {named}")
            yield Flow(start.hosts, (end.hub,), Service.NODES, f"sends {named}")
            continue
        yield Flow((end.hub,), (start.hub,), Service.MASTER, f"receives {named}")
        yield Flow(end.hosts, start.hosts, Service.NODES, f"receives {named}")
        # The master of the origin calls the node that joins the other one.
        yield Flow((start.hub,), (end.hub,), Service.NODES, f"announces {named}")
    if len(islands) > 1 and _discovers(spec):
        hubs = tuple(island.hub for island in islands)
        for service in (Service.MASTER, Service.MULTIMASTER):
            yield Flow(hubs, hubs, service, "discovers masters")


def _crossing(bridges: Iterable[Bridge]) -> Mapping[tuple[str, str], list[str]]:
    """The topics that cross, by island of origin and by receiving island."""
    found: dict[tuple[str, str], dict[str, None]] = {}
    for bridge in bridges:
        for to in bridge.to:
            found.setdefault((bridge.origin, to), {})[bridge.topic] = None
    return {ends: list(topics) for ends, topics in found.items()}


def _discovers(spec: Spec) -> bool:
    """True if multimasters find each other by heartbeats."""
    provider = _provider(spec)
    return provider is not None and provider.discovery is not None


def _provider(spec: Spec) -> Any:
    """What joins islands, a ``MultimasterProvider``; None without one."""
    named = spec.multimaster and spec.multimaster.provider
    provider = named or MIDDLEWARES.get(spec.ros.distro).multimaster
    return MULTIMASTERS.get(provider) if provider else None


def flows_of(swarm: Swarm) -> Iterator[Flow]:
    """Yields all flows of a swarm: of its units of ROS, of those who follow a clock, and of people."""
    yield from swarm.flows
    clocks = followed(swarm)
    for root in dict.fromkeys(clocks.values()):
        followers = tuple(host for host, one in clocks.items() if one == root)
        yield Flow(followers, (root,), Service.CLOCK, "follows its time")
    yield Flow((), tuple(swarm.hosts), Service.SSH, "swarmctl and people log in")
