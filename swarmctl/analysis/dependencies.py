"""What needs what in a swarm, as a directed graph of parts, drivers, commands and flows of data. Pure.

An edge leads from what is needed to what needs it: a node works only while everything before it works. Two
hosts talk over any network that they share, and no host counts as a router; so a network is needed where it
is the only one. Nodes find each other through their masters: open connections outlive a master, but nothing
can join any more, and so what needs a dead master counts as lost. A middleware may have no masters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property

import networkx as nx

from swarmctl.render.middleware import middleware_of
from swarmctl.spec.model import Bluetooth
from swarmctl.swarm import names
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.topics import COMMAND

Part = tuple[str, str]  # kind and name of something that can fail
Node = tuple[str, ...]  # a part, or what works by parts: its kind comes first
KINDS = ("host", "master", "network", "program", "adapter", "line", "robot")


class Dependencies:
    """The dependency graph of one swarm. Nodes are in the order of the spec, the parts first."""

    def __init__(self, index: SwarmIndex) -> None:
        self.index = index
        self.graph: nx.DiGraph[Node] = nx.DiGraph()
        self.masters = bool(middleware_of(index.spec.ros.distro).master_mb)
        self.graph.add_nodes_from(self.parts)
        for island in index.islands if self.masters else ():
            self.graph.add_edge(("host", island.hub), ("master", island.name))
        for program, host in index.program_hosts.items():
            self._add(("program", program), *([("host", host)] if host else []))
        for robot in index.spec.robots:
            self._add(("driver", robot), *self._driver_parts(robot))
        self.commands = self._commands()
        self.flows = self._flows()

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """Everything that can fail, in the order of the spec."""
        index, spec = self.index, self.index.spec
        found: list[Part] = [("host", name) for name in spec.hosts]
        found += [("master", island.name) for island in index.islands if self.masters]
        found += [("network", link.name) for _, link in index.networks]
        found += [("program", name) for name in spec.programs]
        for _, link in index.lines:
            if isinstance(link, Bluetooth):
                found += self._adapter(link)
            found.append(("line", link.robot))
        found += [("robot", name) for name in spec.robots]
        return tuple(dict.fromkeys(found))

    @cached_property
    def _rank(self) -> Mapping[Node, int]:
        return {node: rank for rank, node in enumerate(self.graph)}

    def lost_with(self, part: Part) -> list[Node]:
        """The part and everything that needs it, in the order of the spec."""
        return sorted((part, *nx.descendants(self.graph, part)), key=self._rank.__getitem__)

    def _add(self, node: Node, *needed: Node) -> Node:
        self.graph.add_node(node)
        self.graph.add_edges_from((one, node) for one in needed)
        return node

    def _adapter(self, link: Bluetooth) -> list[Part]:
        name = self.index.adapter_of(link)
        return [] if name is None else [("adapter", f"{link.host}/{name}")]

    def _driver_parts(self, robot: str) -> Iterator[Part]:
        yield ("robot", robot)
        host, link = self.index.driving[robot], self.index.line_of(robot)
        if host is not None:
            yield ("host", host)
        if link is not None:
            yield ("line", robot)
        if isinstance(link, Bluetooth):
            yield from self._adapter(link)

    def _commands(self) -> dict[str, list[Node]]:
        """By robot, one node for each commander of `control` that can reach the robot."""
        found: dict[str, list[Node]] = {}
        for control in self.index.spec.control:
            origin = self.index.commander_host(control.by)
            for robot in control.of:
                connection = self._connection(origin, self.index.driving[robot])
                if connection is not None:
                    needed = [connection, ("driver", robot)]
                    needed += [("program", control.by)] if control.by in self.index.spec.programs else []
                    node = self._add(("command", control.by, robot), *needed)
                    found.setdefault(robot, []).append(node)
        return {robot: list(dict.fromkeys(nodes)) for robot, nodes in found.items()}

    def _flows(self) -> dict[tuple[str, str], list[Node]]:
        """By topic and subscribing program, one node for each publisher that reaches the program."""
        publishers = self._publishers()
        found: dict[tuple[str, str], list[Node]] = {}
        for one in self.index.endpoints:
            for host, publisher in () if one.publishes else publishers.get(one.topic, ()):
                connection = self._connection(host, one.host)
                if connection is not None:
                    node = self._add(("flow", one.topic, one.owner, *publisher), connection, publisher)
                    found.setdefault((one.topic, one.owner), []).append(node)
        return found

    def _publishers(self) -> dict[str, list[tuple[str, Node]]]:
        """By subscribed topic, the drivers and programs that publish it, each with its host."""
        index = self.index
        found: dict[str, list[tuple[str, Node]]] = {
            one.topic: [] for one in index.endpoints if not one.publishes
        }
        for topic, publishers in found.items():
            namespace, name = names.split_topic(topic)
            robot = index.robot_by_namespace.get(namespace) if name != COMMAND else None
            host = index.driving[robot] if robot else None
            if robot is not None and host is not None:
                publishers.append((host, ("driver", robot)))
        for one in index.endpoints:
            if one.publishes and one.host and one.topic in found:
                found[one.topic].append((one.host, ("program", one.owner)))
        return found

    def _connection(self, one: str | None, other: str | None) -> Node | None:
        """The node of a connection between nodes on two hosts; None if these cannot talk."""
        home = self.index.home
        if one is None or other is None or one not in home or other not in home:
            return None
        node = ("connection", *sorted((one, other)))
        if node in self.graph:
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
