"""The swarm as nodes and edges to draw: what stands where, what joins it, who orders whom. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass

from swarmctl.spec.model import Bluetooth, NetworkLink, Serial, Spec
from swarmctl.spec.multimaster import Multimaster
from swarmctl.spec.robot_type import RobotType
from swarmctl.topology import modes, names
from swarmctl.topology.bridges import bridges_of
from swarmctl.topology.interfaces import COMMAND, Endpoint, program_endpoints, program_host
from swarmctl.topology.swarm import Bridge
from swarmctl.topology.wiring import Wiring


@dataclass(frozen=True)
class Node:
    """A host, robot, network or program. ``island`` is that of its host; empty for a network."""

    kind: str
    name: str
    detail: str
    island: str = ""

    @property
    def id(self) -> str:
        return f"{self.kind}:{self.name}"


@dataclass(frozen=True)
class Edge:
    """What joins two nodes, by their ids: network, serial, bluetooth, runs, orders or data."""

    kind: str
    start: str
    end: str
    label: str = ""


@dataclass(frozen=True)
class Crossing:
    """A topic of one island that others hear."""

    topic: str
    type: str
    origin: str
    to: tuple[str, ...]

    def to_json(self) -> dict[str, object]:
        return {"topic": self.topic, "type": self.type, "from": self.origin, "to": list(self.to)}


@dataclass(frozen=True)
class Picture:
    """A whole swarm to draw. ``islands`` are names with the host that runs the master."""

    swarm: str
    mode: str
    islands: tuple[tuple[str, str], ...]
    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]
    provider: str = ""  # what brings topics from one island to another; empty where there is one island
    crossings: tuple[Crossing, ...] = ()

    def to_json(self) -> dict[str, object]:
        return {
            "swarm": self.swarm,
            "mode": self.mode,
            "islands": [{"name": name, "hub": hub} for name, hub in self.islands],
            "nodes": [{"id": node.id, **asdict(node)} for node in self.nodes],
            "edges": [asdict(edge) for edge in self.edges],
            "crossings": [crossing.to_json() for crossing in self.crossings],
        }


def picture(spec: Spec, types: Mapping[str, RobotType]) -> Picture:
    """What there is to draw of a spec without errors, in its order."""
    wiring = Wiring(spec)
    endpoints = tuple(program_endpoints(spec))
    crossings = tuple(_crossings(bridges_of(spec, types, wiring.islands, endpoints)))
    return Picture(
        swarm=spec.name,
        mode=spec.mode.value,
        islands=tuple((island.name, island.hub) for island in wiring.islands),
        nodes=tuple(_nodes(wiring)),
        edges=tuple(dict.fromkeys(_edges(wiring, endpoints, {one.topic for one in crossings}))),
        provider=(spec.multimaster or Multimaster()).provider if len(wiring.islands) > 1 else "",
        crossings=crossings,
    )


def _crossings(bridges: Iterable[Bridge]) -> Iterator[Crossing]:
    """Each topic once, with all who hear it, whatever asks for it."""
    found: dict[tuple[str, str, str], dict[str, None]] = {}
    for one in bridges:
        found.setdefault((one.topic, one.type, one.origin), {}).update(dict.fromkeys(one.to))
    return (Crossing(*key, tuple(to)) for key, to in found.items())


def _nodes(wiring: Wiring) -> Iterator[Node]:
    spec = wiring.spec
    home = {host: island.name for host, island in wiring.home.items()}
    hubs = {island.hub for island in wiring.islands}
    for name, host in spec.hosts.items():
        kind = host.computer or spec.defaults.host.computer or "computer"
        yield Node("host", name, f"{kind}, master" if name in hubs else kind, home.get(name, ""))
    for name, robot in spec.robots.items():
        yield Node("robot", name, robot.type, home.get(modes.driving_host(spec, name) or "", ""))
    for name, program in spec.programs.items():
        what = program.use or program.executable or program.launch or program.package or "program"
        yield Node("program", name, what, home.get(program_host(spec, program) or "", ""))
    for link in spec.links:
        if isinstance(link, NetworkLink):
            yield Node("network", link.name, link.kind)


def _edges(wiring: Wiring, endpoints: Iterable[Endpoint], bridged: Collection[str]) -> Iterator[Edge]:
    spec = wiring.spec
    for link in spec.links:
        if isinstance(link, NetworkLink):
            yield from (Edge("network", f"host:{host}", f"network:{link.name}") for host in link.hosts)
        elif isinstance(link, Bluetooth):
            adapter = wiring.adapter(link)
            label = adapter[1].rpartition("/")[2] if adapter else ""
            yield Edge("bluetooth", f"host:{link.host}", f"robot:{link.robot}", label)
        elif isinstance(link, Serial):
            yield Edge("serial", f"host:{link.host}", f"robot:{link.robot}", link.device or "usb")
    for name, program in spec.programs.items():
        if (host := program_host(spec, program)) is not None:
            yield Edge("runs", f"host:{host}", f"program:{name}")
    for order in wiring.orders:
        yield Edge("orders", _commander(spec, order.by), f"robot:{order.robot}", COMMAND)
    yield from _data(wiring, endpoints, bridged)


def _data(wiring: Wiring, endpoints: Iterable[Endpoint], bridged: Collection[str]) -> Iterator[Edge]:
    """What programs hear of robots and of each other, and which of it crosses between islands."""
    spec = wiring.spec
    robots = {names.namespace(robot): robot for robot in spec.robots}
    publishers = {one.topic: f"program:{one.owner}" for one in endpoints if one.publishes}
    for one in wiring.hearings:
        robot = robots.get(one.topic.rpartition("/")[0])
        source = publishers.get(one.topic) or (f"robot:{robot}" if robot else None)
        if source is not None:
            label = f"{one.topic} (bridged)" if one.topic in bridged else one.topic
            yield Edge("data", source, f"program:{one.program}", label)


def _commander(spec: Spec, by: str) -> str:
    kind = "program" if by in spec.programs else "robot" if by in spec.robots else "host"
    return f"{kind}:{by}"
