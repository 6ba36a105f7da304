"""The expected bridges between islands: topics, publishers, and the nodes that bridge them. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from swarmctl.render.middleware import middleware_of
from swarmctl.render.multimaster import provider_of
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Island, Robot, Swarm, carrier
from swarmctl.swarm.topics import DIAGNOSTICS


@dataclass(frozen=True)
class ExpectedBridge:
    """A topic that island ``to`` receives from ``origin``. ``robots``: those whose drivers publish it.

    ``relayed``: the hub publishes it there, under the names of the nodes in ``origin``.
    """

    topic: str
    type: str
    origin: str
    origin_hub: str
    to: str
    hub: str
    robots: tuple[str, ...] = ()
    relayed: bool = False

    @property
    def subject(self) -> str:
        """The name of the bridge in findings."""
        return f"{self.topic} from {self.origin} to {self.to}"


def bridges_of(swarm: Swarm) -> tuple[ExpectedBridge, ...]:
    """Returns every bridged topic, once per pair of islands, in the order of the spec."""
    islands = {island.name: island for island in swarm.islands}
    robots = {robot.namespace: robot for robot in swarm.robots.values()}
    found: dict[tuple[str, str, str], ExpectedBridge] = {}
    for one in swarm.bridges:
        origin = islands[one.origin]
        publishing = tuple(robot.name for robot in _publishing(one.topic, swarm, origin, robots))
        for to in map(islands.__getitem__, one.to):
            relayed = provider_of(swarm.multimaster, carrier(origin, to).distro).relays
            kind = middleware_of(to.distro).type_name(one.type)
            bridge = ExpectedBridge(
                one.topic, kind, one.origin, origin.hub, to.name, to.hub, publishing, relayed
            )
            found.setdefault((one.topic, one.origin, to.name), bridge)
    return tuple(found.values())


def _publishing(topic: str, swarm: Swarm, origin: Island, robots: Mapping[str, Robot]) -> Iterator[Robot]:
    """The robots of ``origin`` whose drivers publish ``topic``. ``robots`` by namespace."""
    if topic == DIAGNOSTICS:
        yield from (robot for host in origin.hosts for robot in swarm.robots_on(host))
        return
    robot = next((robots[space] for space in names.above(topic) if space in robots), None)
    if robot is None or robot.host not in origin.hosts:
        return
    if _publishes(robot, topic[len(robot.namespace) + 1 :]):
        yield robot


def _publishes(robot: Robot, topic: str) -> bool:
    return any(one.name == topic for one in robot.topics)


@dataclass(frozen=True)
class ExpectedMultimaster:
    """What joins a hub's master to others: its unit, its nodes, and which node reports its state."""

    unit: str
    nodes: tuple[str, ...]
    reporter: str | None


def multimaster_of(swarm: Swarm, hub: str, units: tuple[str, ...]) -> ExpectedMultimaster | None:
    """Returns what ``hub`` runs to join its master to others; None if none of its ``units`` does."""
    unit = names.unit(swarm.name, names.MULTIMASTER)
    if unit not in units:
        return None
    island = swarm.island_of(hub)
    nodes = provider_of(swarm.multimaster, island.distro).nodes(swarm, island)
    return ExpectedMultimaster(unit, nodes.names, nodes.reporter)
