"""What the ROS masters of a lab list, read through the Master API (wiki.ros.org/ROS/Master_API)."""

from __future__ import annotations

import xmlrpc.client
from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

from swarmctl.lab import paths
from swarmctl.lab.hosts import network
from swarmctl.swarm.resolved import Island, Swarm
from tests.e2e.lab_swarm import LabSwarm


@dataclass(frozen=True)
class Registration:
    """A topic or service that a node publishes, subscribes to or serves, and the island of the node."""

    kind: str
    name: str
    island: str


Registrations = Mapping[str, frozenset[Registration]]  # by the island whose master has them


def registered(lab: LabSwarm, swarm: Swarm) -> Registrations:
    """Everything registered at every master; nothing where a master is away."""
    homes = {swarm.hosts[host].advertised: island.name for island in swarm.islands for host in island.hosts}
    return {island.name: _at(lab, swarm, island, homes) for island in swarm.islands}


def crossed(seen: Registrations) -> Registrations:
    """Of ``seen``, what came over from other islands."""
    return {name: frozenset(one for one in rows if one.island != name) for name, rows in seen.items()}


def allowed(swarm: Swarm) -> Registrations:
    """All that may ever come over: the publishers of declared topics, from their own island."""
    return {
        island.name: frozenset(
            Registration("publishes", one.topic, one.origin) for one in swarm.bridges if island.name in one.to
        )
        for island in swarm.islands
    }


def due(seen: Registrations, swarm: Swarm) -> Registrations:
    """Of what may come over, that which somebody publishes at home now."""
    return {
        name: frozenset(one for one in rows if one in seen[one.island])
        for name, rows in allowed(swarm).items()
    }


def _at(lab: LabSwarm, swarm: Swarm, island: Island, homes: Mapping[str, str]) -> frozenset[Registration]:
    """Read on the hub: a filtered one lets nobody else look."""
    hub = network.namespace_path(paths.lab_paths(lab.name), island.hub)
    try:
        rows = network.within(hub, lambda: _registrations(swarm.master_uri(island)))
    except (OSError, xmlrpc.client.Error):
        rows = []
    return frozenset(Registration(kind, name, homes.get(address, address)) for kind, name, address in rows)


def _registrations(uri: str) -> list[tuple[str, str, str]]:
    master = xmlrpc.client.ServerProxy(uri)
    state = master.getSystemState("/test")[2]  # type: ignore[index]
    return [
        (kind, name, urlsplit(str(master.lookupNode("/test", node)[2])).hostname or "")  # type: ignore[index]
        for kind, rows in zip(("publishes", "subscribes", "serves"), state, strict=True)
        for name, nodes in rows
        for node in nodes
    ]
