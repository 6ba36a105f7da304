"""The swarm as one graph of networkx: its parts, what each of them needs, commands and data. Pure.

Nodes are called ``kind:name`` and have the attributes ``kind``, ``name``, ``detail`` and ``island``; a robot
stands for its driver as well. Edges have a ``role`` and a ``label``:

- ``runs``, ``serves`` and the kinds of links lead from what is needed to what needs it;
- ``network`` leads from a host to a network that it is in;
- ``commands`` leads from a commander to a robot, ``data`` from what publishes a topic to a program that
  subscribes to it. ``carriers`` are the nodes that it needs; without any, no network joins the two ends.

It extends the topology of the index: two hosts talk over any network that they share, and no host counts as
a router; so a network is needed where it is the only one. Nodes find each other through their masters: open
connections outlive a master, but nothing can join any more, and so what needs a dead master counts as lost;
so it is with the multimaster between two islands. A middleware may have no masters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache, cached_property

import networkx as nx

from swarmctl.links.ip_link import IpLink
from swarmctl.render.middleware import middleware_of
from swarmctl.render.multimaster import running_on
from swarmctl.swarm.bridges import bridges_of
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolved import carrier, carriers
from swarmctl.swarm.topics import Endpoint

Node = str
Graph = nx.MultiDiGraph
KINDS = ("host", "master", "multimaster", "network", "program", "adapter", "line", "robot")
COMMANDS, DATA, NETWORK, RUNS = "commands", "data", "network", "runs"
_SERVES = "serves"
#: The roles of edges whose start the end does not need.
_FREE = frozenset({COMMANDS, DATA, NETWORK})


def node(kind: str, name: str) -> Node:
    """Returns how the graph calls a part."""
    return f"{kind}:{name}"


def swarm_graph(index: SwarmIndex) -> Graph[Node]:
    """Returns the graph of a spec without errors, in the order of the spec."""
    return _Builder(index).graph


def needed(graph: Graph[Node]) -> Mapping[Node, set[Node]]:
    """Returns by node what it needs, itself included: its ancestors without the free edges."""
    dependencies: nx.DiGraph[Node] = nx.DiGraph()
    dependencies.add_nodes_from(graph)
    for start, end, edge in graph.edges(data=True):
        if edge["role"] not in _FREE:
            dependencies.add_edge(start, end)
    found: dict[Node, set[Node]] = {}
    for one in nx.topological_sort(dependencies):
        found[one] = {one}.union(*(found[start] for start in dependencies.pred[one]))
    return found


def graphml(graph: Graph[Node]) -> str:
    """Returns the graph as GraphML, in which ``carriers`` are one text."""
    plain = graph.copy()
    for *_, attributes in plain.edges(data=True):
        attributes["carriers"] = " ".join(attributes["carriers"])
    return "\n".join((*nx.generate_graphml(plain), ""))


class _Builder:
    def __init__(self, index: SwarmIndex) -> None:
        self._index, self._spec = index, index.spec
        self._mastered = {one.name: one for one in index.islands if middleware_of(one.distro).master_mb}
        self._multimasters = running_on(
            index.spec.multimaster, index.islands, carriers(index.islands, bridges_of(index))
        )
        self._carriers = cache(self._carriers_between)
        self.graph: Graph[Node] = nx.MultiDiGraph(swarm=index.spec.name, mode=index.spec.mode.value)
        self._add_hosts()
        self._add_networks()
        self._add_programs()
        self._add_lines()
        self._add_commands()
        self._add_data()

    def _add(self, kind: str, name: str, detail: str = "", host: str | None = None) -> Node:
        island = self._index.home.get(host or "")
        one = node(kind, name)
        self.graph.add_node(one, kind=kind, name=name, detail=detail, island=island.name if island else "")
        return one

    def _join(
        self, role: str, start: Node, end: Node, label: str = "", carriers: Sequence[Node] = ()
    ) -> None:
        key = f"{role} {label}" if role == DATA else role
        self.graph.add_edge(start, end, key=key, role=role, label=label, carriers=tuple(carriers))

    def _add_hosts(self) -> None:
        index, with_master = self._index, {one.hub for one in self._mastered.values()}
        for name in self._spec.hosts:
            kind = index.computer_of(name) or "computer"
            self._add("host", name, f"{kind}, master" if name in with_master else kind, name)
        for island in self._mastered.values():
            self._join(RUNS, node("host", island.hub), self._add("master", island.name, "", island.hub))
        for island in index.islands:
            if island.name in self._multimasters:
                here = self._add("multimaster", island.name, "", island.hub)
                self._join(RUNS, node("host", island.hub), here)

    def _add_networks(self) -> None:
        for number, link in self._index.networks:
            network = self._add("network", link.name, link.kind)
            for host in self._index.topology[number]:
                self._join(NETWORK, node("host", host), network)

    def _add_programs(self) -> None:
        for name, host in self._index.program_hosts.items():
            program = self._spec.programs[name]
            detail = program.use or program.executable or program.launch or program.package or "program"
            here = self._add("program", name, detail, host)
            if host is not None:
                self._join(RUNS, node("host", host), here)

    def _add_lines(self) -> None:
        index = self._index
        for name, robot in self._spec.robots.items():
            host = index.driving[name]
            self._add("robot", name, robot.type, host)
            if host is not None and not index.lines_of[name]:
                self._join(RUNS, node("host", host), node("robot", name))
        for _, link in index.lines:
            line = self._add("line", link.robot, link.kind, link.host)
            adapter = index.adapter_of(link)
            ends = index.ends_of(link) if isinstance(link, IpLink) else None
            label = link.label(adapter, ends.port if ends is not None else None)
            self._join(link.kind, node("host", link.host), line, label)
            self._join(link.kind, line, node("robot", link.robot))
            if adapter is not None:
                one = self._add("adapter", f"{link.host}/{adapter}", "", link.host)
                self._join(_SERVES, node("host", link.host), one)
                self._join(_SERVES, one, line)
            if ends is not None and ends.network is not None:
                self._join(_SERVES, node("network", ends.network.name), line)

    def _add_commands(self) -> None:
        index, spec = self._index, self._spec
        for control in spec.control:
            by = control.by
            kind = "program" if by in spec.programs else "robot" if by in spec.robots else "host"
            own = [node("program", by)] if by in spec.programs else []
            for robot in control.of:
                command = index.command_topics.get(robot)
                label = command.topic.removeprefix(f"{index.namespaces[robot]}/") if command else ""
                carriers = self._carriers(index.commander_host(by), index.driving[robot])
                needed_by_it = [*own, *carriers] if carriers else ()
                self._join(COMMANDS, node(kind, by), node("robot", robot), label, needed_by_it)

    def _add_data(self) -> None:
        for one in self._index.endpoints:
            for host, publisher in () if one.publishes else self._publishers(one.topic):
                if carriers := self._carriers(host, one.host):
                    self._join(DATA, publisher, node("program", one.owner), one.topic, [publisher, *carriers])

    @cached_property
    def _publishing(self) -> Mapping[str, list[Endpoint]]:
        """The programs that publish each topic."""
        found: dict[str, list[Endpoint]] = {}
        for one in self._index.endpoints:
            if one.publishes:
                found.setdefault(one.topic, []).append(one)
        return found

    def _publishers(self, topic: str) -> Iterator[tuple[str | None, Node]]:
        """The robot and the programs that publish a topic, each with its host."""
        index = self._index
        robot = index.robot_by_namespace.get(index.split_topic(topic)[0])
        if robot is not None and topic not in index.robots_by_command:
            yield index.driving[robot], node("robot", robot)
        for one in self._publishing.get(topic, ()):
            yield one.host, node("program", one.owner)

    def _carriers_between(self, origin: str | None, to: str | None) -> tuple[Node, ...]:
        """What carries a connection of nodes on two hosts; nothing if these cannot talk."""
        home = self._index.home
        if origin is None or to is None or origin not in home or to not in home:
            return ()
        first, second = home[origin], home[to]
        found = [node("host", origin), node("host", to)]
        pairs = [(origin, to)]
        for end, island in ((origin, first), (to, second)):
            if island.name in self._mastered:
                found.append(node("master", island.name))
                pairs.append((end, island.hub))
        if first is not second or first.name in self._mastered:
            pairs.append((first.hub, second.hub))
        for one, other in pairs:
            shared = self._index.shared_networks(one, other) if one != other else ()
            if one != other and not shared:
                return ()
            found += [node("network", self._index.network_at[shared[0]].name)] if len(shared) == 1 else []
        if first is not second:
            joined = carrier(first, second)
            provider = self._multimasters.get(joined.name)
            both = first.has_master is second.has_master and provider and not provider.only_receivers
            found += [node("multimaster", one.name) for one in ((first, second) if both else (joined,))]
        return tuple(dict.fromkeys(one for one in found if one in self.graph))
