"""A swarm as nodes and edges to draw: hosts, robots, programs and networks, and what connects them. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import asdict, dataclass

from swarmctl.analysis.dependencies import Dependencies
from swarmctl.render.middleware import middleware_of
from swarmctl.spec.link_model import IpLink, NetworkLink, Radio, RobotLink, Serial
from swarmctl.spec.multimaster_model import Multimaster
from swarmctl.swarm.bridges import bridges_of
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolved import Bridge


@dataclass(frozen=True)
class Node:
    """A host, robot, network or program. ``island`` is that of its host; empty for a network."""

    kind: str
    name: str
    detail: str
    island: str = ""

    @property
    def id(self) -> str:
        """The id that edges refer to: kind and name."""
        return f"{self.kind}:{self.name}"


@dataclass(frozen=True)
class Edge:
    """A connection of two nodes, by their ids. Kinds: network, runs, commands, data, kinds of links."""

    kind: str
    start: str
    end: str
    label: str = ""


@dataclass(frozen=True)
class BridgedTopic:
    """A topic of one island that is bridged to others."""

    topic: str
    type: str
    origin: str
    to: tuple[str, ...]

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {"topic": self.topic, "type": self.type, "from": self.origin, "to": list(self.to)}


@dataclass(frozen=True)
class Diagram:
    """A swarm to draw. ``islands`` are names, each with the host that runs its master, if one does.

    A part of a swarm has nodes ``outside``, by their ids: the other ends of its commands and data.
    """

    swarm: str
    mode: str
    islands: tuple[tuple[str, str], ...]
    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]
    provider: str = ""  # the multimaster that bridges topics; empty with one island
    crossings: tuple[BridgedTopic, ...] = ()
    outside: frozenset[str] = frozenset()

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {
            "swarm": self.swarm,
            "mode": self.mode,
            "islands": [{"name": name, "hub": hub} for name, hub in self.islands],
            "nodes": [{"id": node.id, **asdict(node)} for node in self.nodes],
            "edges": [asdict(edge) for edge in self.edges],
            "crossings": [one.to_json() for one in self.crossings],
        }


def diagram(index: SwarmIndex) -> Diagram:
    """Returns the diagram of a spec without errors, in the order of the spec."""
    bridged = tuple(_bridged_topics(bridges_of(index)))
    several = len(index.islands) > 1
    masters = bool(middleware_of(index.spec.ros.distro).master_mb)
    return Diagram(
        swarm=index.spec.name,
        mode=index.spec.mode.value,
        islands=tuple((island.name, island.hub if masters else "") for island in index.islands),
        nodes=tuple(_nodes(index, {island.hub for island in index.islands} if masters else set())),
        edges=tuple(dict.fromkeys(_edges(index, {one.topic for one in bridged}))),
        provider=(index.spec.multimaster or Multimaster()).provider if several else "",
        crossings=bridged,
    )


def _bridged_topics(bridges: Iterable[Bridge]) -> Iterator[BridgedTopic]:
    """Each topic once for each island of origin, with all islands that receive it."""
    found: dict[tuple[str, str, str], dict[str, None]] = {}
    for one in bridges:
        found.setdefault((one.topic, one.type, one.origin), {}).update(dict.fromkeys(one.to))
    return (BridgedTopic(*key, tuple(to)) for key, to in found.items())


def _nodes(index: SwarmIndex, masters: Collection[str]) -> Iterator[Node]:
    """The parts of the swarm. ``masters``: the hosts that run one."""
    spec = index.spec

    def island_of(host: str | None) -> str:
        island = index.home.get(host or "")
        return island.name if island else ""

    for name in spec.hosts:
        kind = index.computer_of(name) or "computer"
        yield Node("host", name, f"{kind}, master" if name in masters else kind, island_of(name))
    for name, robot in spec.robots.items():
        yield Node("robot", name, robot.type, island_of(index.driving[name]))
    for name, program in spec.programs.items():
        detail = program.use or program.executable or program.launch or program.package or "program"
        yield Node("program", name, detail, island_of(index.program_hosts[name]))
    for _, link in index.networks:
        yield Node("network", link.name, link.kind)


def _edges(index: SwarmIndex, bridged: Collection[str]) -> Iterator[Edge]:
    for link in index.spec.links:
        if isinstance(link, NetworkLink):
            yield from (Edge("network", f"host:{host}", f"network:{link.name}") for host in link.hosts)
        else:
            yield Edge(link.kind, f"host:{link.host}", f"robot:{link.robot}", _label(index, link))
    for name, host in index.driving.items():
        if host is not None and not index.lines_of[name]:
            yield Edge("runs", f"host:{host}", f"robot:{name}")
    for name, host in index.program_hosts.items():
        if host is not None:
            yield Edge("runs", f"host:{host}", f"program:{name}")
    for control in index.spec.control:
        for robot in control.of:
            if (command := index.command_topics.get(robot)) is not None:
                label = command.topic.removeprefix(f"{index.namespaces[robot]}/")
                yield Edge("commands", _commander(index, control.by), f"robot:{robot}", label)
    yield from _data(index, bridged)


def _label(index: SwarmIndex, link: RobotLink) -> str:
    """What identifies a robot's link at its host: device, adapter, address, or dongle with channel."""
    match link:
        case Serial():
            return link.device or "usb"
        case IpLink():
            port = index.ends_of(link).port
            return f"{link.address}:{port}" if port is not None else link.address
        case Radio():
            return f"{link.dongle}, channel {link.channel}"
    return index.adapter_of(link) or ""


def _data(index: SwarmIndex, bridged: Collection[str]) -> Iterator[Edge]:
    """The topics that programs receive from robots and from each other."""
    publishers = {one.topic: f"program:{one.owner}" for one in index.endpoints if one.publishes}
    for topic, program in Dependencies(index).flows.keys:
        robot = index.robot_by_namespace.get(index.split_topic(topic)[0])
        source = publishers.get(topic) or (f"robot:{robot}" if robot else None)
        if source is not None:
            label = f"{topic} (bridged)" if topic in bridged else topic
            yield Edge("data", source, f"program:{program}", label)


def _commander(index: SwarmIndex, by: str) -> str:
    kind = "program" if by in index.spec.programs else "robot" if by in index.spec.robots else "host"
    return f"{kind}:{by}"
