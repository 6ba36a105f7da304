"""What needs what in a swarm: for each driver, order and flow of data, the parts without which it ends. Pure.

A part is ``(kind, name)``. Two hosts talk over any network that they share, and nobody is taken for a
router; so a network is needed where it is the only one. Nodes find each other through their masters:
connections that stand when a master dies go on for a while, but nothing joins again, and so what needs a
master counts as lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import networkx as nx

from swarmctl.spec.model import Bluetooth, NetworkLink, Serial, Spec
from swarmctl.topology import modes, names
from swarmctl.topology.bridges import commanders_host
from swarmctl.topology.graph import Node, graph_of, host_node
from swarmctl.topology.interfaces import COMMAND, Endpoint, program_endpoints, program_host
from swarmctl.topology.swarm import Island

Part = tuple[str, str]
Needs = frozenset[Part]
KINDS = ("host", "master", "network", "program", "adapter", "line", "robot")


@dataclass(frozen=True)
class Order:
    """One entry of ``control`` for one robot. ``needs`` is nothing where no way leads to it."""

    by: str
    host: str | None
    robot: str
    needs: Needs | None


@dataclass(frozen=True)
class Hearing:
    """A topic that a program hears: what the program needs, and what every way of the topic needs."""

    topic: str
    program: str
    own: Needs
    needs: Needs


class Wiring:
    """One spec as parts that need each other. Indexes keep the order of the spec."""

    def __init__(self, spec: Spec) -> None:
        self.spec = spec
        self.islands: tuple[Island, ...] = modes.islands_of(spec)
        self.home: Mapping[str, Island] = {host: one for one in self.islands for host in one.hosts}
        self._between: dict[tuple[str, str], Needs | None] = {}

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """Everything that can die, in the order of the spec."""
        spec = self.spec
        found: list[Part] = [("host", name) for name in spec.hosts]
        found += [("master", island.name) for island in self.islands]
        found += [("network", link.name) for link in spec.links if isinstance(link, NetworkLink)]
        found += [("program", name) for name in spec.programs]
        for link in spec.links:
            if isinstance(link, Bluetooth) and (adapter := self.adapter(link)) is not None:
                found.append(adapter)
            if isinstance(link, (Serial, Bluetooth)):
                found.append(("line", link.robot))
        found += [("robot", name) for name in spec.robots]
        return tuple(dict.fromkeys(found))

    @cached_property
    def lines(self) -> Mapping[str, Serial | Bluetooth]:
        links = (link for link in self.spec.links if isinstance(link, (Serial, Bluetooth)))
        return {link.robot: link for link in links}

    @cached_property
    def graph(self) -> nx.Graph[Node]:
        return graph_of(self.spec)

    def adapter(self, link: Bluetooth) -> Part | None:
        name = link.adapter or next(iter(self.spec.hosts[link.host].bluetooth), None)
        return None if name is None else ("adapter", f"{link.host}/{name}")

    def shared(self, one: str, other: str) -> tuple[str, ...]:
        """The networks that two hosts have in common, in the order of the spec."""
        beside = self.graph[host_node(other)]
        return tuple(
            node[1] for node in self.graph[host_node(one)] if node[0] == "network" and node in beside
        )

    @cached_property
    def drivers(self) -> Mapping[str, Needs]:
        """What each robot's driver needs."""
        return {robot: frozenset(self._driver(robot)) for robot in self.spec.robots}

    def _driver(self, robot: str) -> Iterator[Part]:
        yield ("robot", robot)
        host, link = modes.driving_host(self.spec, robot), self.lines.get(robot)
        if host is not None:
            yield ("host", host)
        if link is not None:
            yield ("line", robot)
        if isinstance(link, Bluetooth) and (adapter := self.adapter(link)) is not None:
            yield adapter

    @cached_property
    def programs(self) -> Mapping[str, Needs]:
        """What each program needs to run."""
        placed = ((name, program_host(self.spec, one)) for name, one in self.spec.programs.items())
        return {
            name: frozenset([("program", name), *([("host", host)] if host else [])]) for name, host in placed
        }

    @cached_property
    def masters(self) -> Mapping[str, Needs]:
        """What each island's master needs."""
        return {one.name: frozenset([("master", one.name), ("host", one.hub)]) for one in self.islands}

    @cached_property
    def orders(self) -> tuple[Order, ...]:
        return tuple(self._order(control.by, robot) for control in self.spec.control for robot in control.of)

    def _order(self, by: str, robot: str) -> Order:
        origin, to = commanders_host(self.spec, by), modes.driving_host(self.spec, robot)
        way = self.between(origin, to) if origin is not None and to is not None else None
        if way is None or origin is None:
            return Order(by, origin, robot, None)
        commander = self.programs.get(by, frozenset([("host", origin)]))
        return Order(by, origin, robot, commander | way | self.drivers[robot])

    @cached_property
    def hearings(self) -> tuple[Hearing, ...]:
        """Every topic that a program hears and somebody publishes within its reach."""
        endpoints = tuple(program_endpoints(self.spec))
        published = self._published(endpoints)
        found = []
        for one in endpoints:
            if not one.publishes and one.host:
                ways = [
                    needs | way
                    for host, needs in published.get(one.topic, ())
                    if (way := self.between(host, one.host)) is not None
                ]
                if ways:
                    own = self.programs[one.owner]
                    found.append(Hearing(one.topic, one.owner, own, frozenset.intersection(*ways)))
        return tuple(found)

    def _published(self, endpoints: Iterable[Endpoint]) -> Mapping[str, list[tuple[str, Needs]]]:
        """By topic: the host of each node that publishes it, and what that node needs. Only what is heard."""
        heard = {one.topic for one in endpoints if not one.publishes}
        found: dict[str, list[tuple[str, Needs]]] = {}
        robots = {names.namespace(robot): robot for robot in self.spec.robots} if heard else {}
        for topic in sorted(heard):
            space, sensor = names.parted(topic)
            robot = robots.get(space)
            host = modes.driving_host(self.spec, robot) if robot and sensor != COMMAND else None
            if robot is not None and host is not None:
                found.setdefault(topic, []).append((host, self.drivers[robot]))
        for one in endpoints:
            if one.publishes and one.host and one.topic in heard:
                found.setdefault(one.topic, []).append((one.host, self.programs[one.owner]))
        return found

    def between(self, one: str, other: str) -> Needs | None:
        """What a node on one host and a node on another need to hear each other; nothing if they cannot."""
        pair = (one, other)
        if pair not in self._between:
            self._between[pair] = self._joined(one, other)
        return self._between[pair]

    def _joined(self, one: str, other: str) -> Needs | None:
        if one not in self.home or other not in self.home:
            return None
        first, second = self.home[one], self.home[other]
        ways = [self._direct(one, other), self._direct(one, first.hub), self._direct(other, second.hub)]
        if first is not second:
            ways.append(self._direct(first.hub, second.hub))
        if any(way is None for way in ways):
            return None
        ends = [("host", one), ("host", other)]
        return frozenset(ends).union(
            self.masters[first.name], self.masters[second.name], *(way for way in ways if way)
        )

    def _direct(self, one: str, other: str) -> Needs | None:
        """The network between two hosts, where it is the only one they share."""
        if one == other:
            return frozenset()
        shared = self.shared(one, other)
        return None if not shared else frozenset([("network", shared[0])] if len(shared) == 1 else [])
