"""A swarm as nodes and edges to draw: hosts, robots, programs and networks, and what connects them. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

from swarmctl.analysis import swarm_graph
from swarmctl.analysis.swarm_graph import COMMANDS, DATA, RUNS, Graph, node
from swarmctl.render.middleware import middleware_of
from swarmctl.swarm.bridges import bridges_of, provider_name
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolved import Bridge, carriers, joinable

_DRAWN = ("host", "robot", "program", "network")


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
            "provider": self.provider,
            "crossings": [one.to_json() for one in self.crossings],
        }

    @classmethod
    def from_json(cls, data: Any) -> Diagram:
        """Reads what ``to_json`` returns. Raises KeyError or TypeError for anything else."""
        return cls(
            data["swarm"],
            data["mode"],
            tuple((one["name"], one["hub"]) for one in data["islands"]),
            tuple(Node(one["kind"], one["name"], one["detail"], one["island"]) for one in data["nodes"]),
            tuple(Edge(**one) for one in data["edges"]),
            data["provider"],
            tuple(
                BridgedTopic(one["topic"], one["type"], one["from"], tuple(one["to"]))
                for one in data["crossings"]
            ),
        )


def diagram(index: SwarmIndex) -> Diagram:
    """Returns the diagram of a spec without errors, in the order of the spec."""
    graph = swarm_graph.swarm_graph(index)
    bridged = tuple(_bridged_topics(bridges_of(index)))
    return Diagram(
        swarm=index.spec.name,
        mode=index.spec.mode.value,
        islands=tuple(
            (one.name, one.hub if middleware_of(one.distro).master_mb else "") for one in index.islands
        ),
        nodes=tuple(
            Node(**one) for kind in _DRAWN for _, one in graph.nodes(data=True) if one["kind"] == kind
        ),
        edges=tuple(sorted(_edges(graph, {one.topic for one in bridged}), key=_rank)),
        provider=", ".join(_providers(index)),
        crossings=bridged,
    )


def _providers(index: SwarmIndex) -> Iterator[str]:
    """The multimasters that join the islands; none with one island."""
    settings, islands = index.spec.multimaster, index.islands
    between = carriers(islands, bridges_of(index)) | joinable(islands)
    joined = (one for one in islands if one.name in between)
    yield from dict.fromkeys(provider_name(settings, one.distro) for one in joined)


def _bridged_topics(bridges: Iterable[Bridge]) -> Iterator[BridgedTopic]:
    """Each topic once for each island of origin, with all islands that receive it."""
    found: dict[tuple[str, str, str], dict[str, None]] = {}
    for one in bridges:
        found.setdefault((one.topic, one.type, one.origin), {}).update(dict.fromkeys(one.to))
    return (BridgedTopic(*key, tuple(to)) for key, to in found.items())


def _edges(graph: Graph[swarm_graph.Node], bridged: Collection[str]) -> Iterator[Edge]:
    """The edges between what is drawn; a line is an edge itself."""
    kinds = graph.nodes(data="kind")
    for start, end, edge in graph.edges(data=True):
        role, label = edge["role"], edge["label"]
        if kinds[end] == "line" and kinds[start] == "host":
            yield Edge(role, start, node("robot", graph.nodes[end]["name"]), label)
        elif kinds[start] in _DRAWN and kinds[end] in _DRAWN and (label or role != COMMANDS):
            yield Edge(role, start, end, f"{label} (bridged)" if role == DATA and label in bridged else label)


def _rank(edge: Edge) -> int:
    """Links come first."""
    return (RUNS, COMMANDS, DATA).index(edge.kind) + 1 if edge.kind in (RUNS, COMMANDS, DATA) else 0
