"""What needs what in a swarm, as a directed graph of parts, drivers, connections and ways. Pure.

An edge leads from what is needed to what needs it: a node works only while everything before it works. Two
hosts talk over any network that they share, and no host counts as a router; so a network is needed where it
is the only one. Nodes find each other through their masters: open connections outlive a master, but nothing
can join any more, and so what needs a dead master counts as lost; so it is with the multimaster between two
islands. A middleware may have no masters.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from itertools import chain
from typing import Generic, TypeVar

from swarmctl.render.middleware import middleware_of
from swarmctl.render.multimaster.base import MultimasterProvider, provider_of, runs_on
from swarmctl.spec.link_model import IpLink, RobotLink
from swarmctl.swarm.bridges import bridges_of
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolved import Island

Part = tuple[str, str]  # kind and name of something that can fail
Node = tuple[str, ...]  # a part, or what works by parts: its kind comes first
K = TypeVar("K")
KINDS = ("host", "master", "multimaster", "network", "program", "adapter", "line", "robot")
#: No nodes of the graph, which keeps it small: only the driver needs them, so its node stands for them.
_SERVE_ONE_DRIVER = frozenset({"line", "robot"})


class Ways(Generic[K]):
    """What has several ways, by a key. One way is enough; a way is a node of the graph."""

    def __init__(self, ways: Mapping[K, Iterable[Node]]) -> None:
        self.keys = tuple(ways)
        self._rank = {key: rank for rank, key in enumerate(ways)}
        self._number: dict[K, int] = {}
        self._using: dict[Node, list[K]] = {}
        for key, nodes in ways.items():
            distinct = set(nodes)
            self._number[key] = len(distinct)
            for node in distinct:
                self._using.setdefault(node, []).append(key)

    def cut_off(self, lost: Iterable[Node]) -> list[K]:
        """Returns the keys all of whose ways are among the lost nodes."""
        using = [self._using[node] for node in lost if node in self._using]
        if not using:
            return []
        found = Counter(chain.from_iterable(using))
        gone = [key for key, number in found.items() if number == self._number[key]]
        return sorted(gone, key=self._rank.__getitem__)


class Dependencies:
    """The dependency graph of one swarm. Nodes are in the order of the spec, the parts first."""

    def __init__(self, index: SwarmIndex) -> None:
        self.index = index
        self._needing: dict[Node, dict[Node, None]] = {}  # what needs each node
        self.masters = bool(middleware_of(index.spec.ros.distro).master_mb)
        robots = index.spec.robots
        nodes = (part for part in self.parts if part[0] not in _SERVE_ONE_DRIVER)
        for node in (*nodes, *(("driver", robot) for robot in robots)):
            self._add(node)
        for island in index.islands if self.masters else ():
            self._add(("master", island.name), ("host", island.hub))
        for island in self._joined:
            self._add(("multimaster", island.name), ("host", island.hub))
        for program, host in index.program_hosts.items():
            self._add(("program", program), *([("host", host)] if host else []))
        for robot in robots:
            self._add(("driver", robot), *self._driver_parts(robot))
        self.commands = Ways(self._commands())
        self.flows = Ways(self._flows())

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """Everything that can fail, in the order of the spec."""
        index, spec = self.index, self.index.spec
        found: list[Part] = [("host", name) for name in spec.hosts]
        found += [("master", island.name) for island in index.islands if self.masters]
        found += [("multimaster", island.name) for island in self._joined]
        found += [("network", link.name) for _, link in index.networks]
        found += [("program", name) for name in spec.programs]
        for _, link in index.lines:
            found += self._adapter(link)
            found.append(("line", link.robot))
        found += [("robot", name) for name in spec.robots]
        return tuple(dict.fromkeys(found))

    @cached_property
    def _joined(self) -> tuple[Island, ...]:
        """The islands whose hubs run the multimaster."""
        islands, provider = self.index.islands, self._provider
        to = {name for bridge in bridges_of(self.index) for name in bridge.to}
        return tuple(one for one in islands if runs_on(provider, len(islands), one.name in to))

    @cached_property
    def _provider(self) -> MultimasterProvider:
        return provider_of(self.index.spec.multimaster)

    @cached_property
    def _rank(self) -> Mapping[Node, int]:
        return {node: rank for rank, node in enumerate(self._needing)}

    def node_of(self, part: Part) -> Node:
        """Returns the node that stands for a part: that of the driver for its robot and its line."""
        return ("driver", part[1]) if part[0] in _SERVE_ONE_DRIVER else part

    def lost_with(self, node: Node) -> list[Node]:
        """Returns the node and everything that needs it, in the order of the spec."""
        lost, due = {node}, [node]
        while due:
            found = self._needing[due.pop()].keys() - lost
            lost |= found
            due += found
        return sorted(lost, key=self._rank.__getitem__)

    def _add(self, node: Node, *needed: Node) -> Node:
        """Adds a node, with an edge from everything that it needs."""
        self._needing.setdefault(node, {})
        for one in needed:
            self._needing.setdefault(one, {})[node] = None
        return node

    def _adapter(self, link: RobotLink) -> list[Part]:
        name = self.index.adapter_of(link)
        return [] if name is None else [("adapter", f"{link.host}/{name}")]

    def _driver_parts(self, robot: str) -> Iterator[Part]:
        host, link = self.index.driving[robot], self.index.line_of(robot)
        if host is not None:
            yield ("host", host)
        if link is not None:
            yield from self._adapter(link)
        if isinstance(link, IpLink) and (network := self.index.ends_of(link).network) is not None:
            yield ("network", network.name)

    def _commands(self) -> dict[str, list[Node]]:
        """By robot, one node for each way from a commander of `control` to the host of its driver.

        The driver is no part of the way: with it, the robot is lost anyway.
        """
        found: dict[str, list[Node]] = {}
        for control in self.index.spec.control:
            origin = self.index.commander_host(control.by)
            for robot in control.of:
                way = self._crossing(origin, self.index.driving[robot])
                if way is not None and control.by in self.index.spec.programs:
                    way = self._way(way, ("program", control.by))
                if way is not None:
                    found.setdefault(robot, []).append(way)
        return found

    def _flows(self) -> dict[tuple[str, str], list[Node]]:
        """By topic and subscribing program, one node for each publisher that reaches the program."""
        publishers = self._publishers()
        found: dict[tuple[str, str], list[Node]] = {}
        for one in self.index.endpoints:
            for host, publisher in () if one.publishes else publishers.get(one.topic, ()):
                connection = self._crossing(host, one.host)
                if connection is not None:
                    found.setdefault((one.topic, one.owner), []).append(self._way(connection, publisher))
        return found

    def _way(self, connection: Node, end: Node) -> Node:
        """The node of what a program or driver at one end of a connection sends over it."""
        way = ("way", *connection[1:], *end)
        return way if way in self._needing else self._add(way, connection, end)

    def _publishers(self) -> dict[str, list[tuple[str, Node]]]:
        """By subscribed topic, the drivers and programs that publish it, each with its host."""
        index = self.index
        found: dict[str, list[tuple[str, Node]]] = {
            one.topic: [] for one in index.endpoints if not one.publishes
        }
        for topic, publishers in found.items():
            namespace, _ = index.split_topic(topic)
            robot = None if topic in index.robots_by_command else index.robot_by_namespace.get(namespace)
            host = index.driving[robot] if robot else None
            if robot is not None and host is not None:
                publishers.append((host, ("driver", robot)))
        for one in index.endpoints:
            if one.publishes and one.host and one.topic in found:
                found[one.topic].append((one.host, ("program", one.owner)))
        return found

    def _crossing(self, origin: str | None, to: str | None) -> Node | None:
        """The node of what goes from one host to another, by the multimaster if they are on two islands."""
        connection = self._connection(origin, to)
        if connection is None or origin is None or to is None:
            return None
        first, second = self.index.home[origin].name, self.index.home[to].name
        if first == second:
            return connection
        ends = (second,) if self._provider.only_receivers else (first, second)
        return self._add(("crossing", origin, to), connection, *(("multimaster", one) for one in ends))

    def _connection(self, one: str | None, other: str | None) -> Node | None:
        """The node of a connection between nodes on two hosts; None if these cannot talk."""
        home = self.index.home
        if one is None or other is None or one not in home or other not in home:
            return None
        node = ("connection", *sorted((one, other)))
        if node in self._needing:
            return node
        first, second = home[one], home[other]
        needed: list[Part] = [("host", one), ("host", other)]
        pairs = [(one, other)]
        if self.masters:
            needed += [("master", first.name), ("master", second.name)]
            pairs += [(one, first.hub), (other, second.hub)]
        if first is not second or self.masters:
            pairs.append((first.hub, second.hub))
        for pair in pairs:
            shared = self.index.shared_networks(*pair) if pair[0] != pair[1] else ()
            if pair[0] != pair[1] and not shared:
                return None
            needed += [("network", shared[0])] if len(shared) == 1 else []
        return self._add(node, *needed)
