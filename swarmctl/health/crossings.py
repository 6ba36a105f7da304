"""The expected graph between islands: which topics cross, from whom, and whose address is whose. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from swarmctl.topology import names
from swarmctl.topology.fkie import FAMILIES
from swarmctl.topology.interfaces import DIAGNOSTICS, driver_topics
from swarmctl.topology.swarm import Island, Robot, Swarm


@dataclass(frozen=True)
class ExpectedBridge:
    """A topic that island ``to`` hears from ``origin``. ``robots``: those whose drivers publish it."""

    topic: str
    type: str
    origin: str
    origin_hub: str
    to: str
    hub: str
    robots: tuple[str, ...] = ()

    @property
    def subject(self) -> str:
        return f"{self.topic} from {self.origin} to {self.to}"


def bridges_of(swarm: Swarm) -> tuple[ExpectedBridge, ...]:
    """Every topic, once for each pair of islands between which it crosses, in the order of the spec."""
    islands = {island.name: island for island in swarm.islands}
    robots = {robot.namespace: robot for robot in swarm.robots.values()}
    found: dict[tuple[str, str, str], ExpectedBridge] = {}
    for one in swarm.bridges:
        origin = islands[one.origin]
        publishing = tuple(robot.name for robot in _publishing(one.topic, swarm, origin, robots))
        for to in one.to:
            bridge = ExpectedBridge(
                one.topic, one.type, one.origin, origin.hub, to, islands[to].hub, publishing
            )
            found.setdefault((one.topic, one.origin, to), bridge)
    return tuple(found.values())


def _publishing(topic: str, swarm: Swarm, origin: Island, robots: Mapping[str, Robot]) -> Iterator[Robot]:
    """The robots of ``origin`` whose drivers publish ``topic``. ``robots`` by namespace."""
    if topic == DIAGNOSTICS:
        yield from (robot for host in origin.hosts for robot in swarm.robots_on(host))
        return
    space, name = names.parted(topic)
    robot = robots.get(space)
    if robot is not None and robot.host in origin.hosts and _publishes(robot, name):
        yield robot


def _publishes(robot: Robot, topic: str) -> bool:
    return any(one.name == topic for one in driver_topics(robot.type, robot.settings, robot.driver))


@dataclass(frozen=True)
class ExpectedMultimaster:
    """What joins a hub's master to others: its unit and its nodes. ``speaker``: the node that reports."""

    unit: str
    nodes: tuple[str, ...]
    speaker: str | None


def multimaster_of(swarm: Swarm, hub: str, units: tuple[str, ...]) -> ExpectedMultimaster | None:
    """What ``hub`` runs beside its master, if one of its ``units`` joins it to others."""
    unit = names.unit(swarm.name, names.MULTIMASTER)
    if unit not in units:
        return None
    if swarm.multimaster.provider == "static":
        node = names.multimaster_node(swarm.island_of(hub).name)
        return ExpectedMultimaster(unit, (node,), node)
    family = FAMILIES[swarm.multimaster.packages]
    hears = swarm.island_of(hub).name in swarm.heard
    nodes = (family.discovery, family.sync) if hears else (family.discovery,)
    return ExpectedMultimaster(unit, tuple(f"/{node.name}" for node in nodes), None)
