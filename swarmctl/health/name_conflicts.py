"""Nodes of one name in one graph: each takes it from the other whenever it registers at the master. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

from swarm_onboard.agent.observations import NodeSeen
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost
from swarmctl.health.unit_faults import host_of

NODE_NAME = "node name"
_SETTLED = 60.0  # s after which a unit that lost its node has other reasons not to run
_STARTED = ("active", "activating", "reloading")
Launched = Mapping[tuple[str, str], Collection[str]]  # nodes of launch files, by host and program or robot


@dataclass(frozen=True)
class Place:
    """A unit on a host that has a node of the name, and how often another node has taken it."""

    host: str
    unit: str
    count: int
    ago: float


@dataclass(frozen=True)
class Conflict:
    """A name that one node has taken from another. ``elsewhere``: where the master has one of no unit."""

    node: str
    subject: str
    places: tuple[Place, ...]
    elsewhere: tuple[str, ...]

    @property
    def key(self) -> str:
        """The key of the finding."""
        return f"{NODE_NAME} {self.subject}"

    @property
    def explained(self) -> tuple[Place, ...]:
        """The places where it explains what is wrong."""
        latest = min((place.ago for place in self.places if place.count), default=0.0)
        return self.places if latest <= _SETTLED else ()


def conflicts(graph: ExpectedGraph, answers: Mapping[str, Answer], launched: Launched) -> Iterator[Conflict]:
    """Yields each name that one node has taken from another."""
    for island in dict.fromkeys(host.island for host in graph.hosts):
        hosts = [host for host in graph.hosts if host.island == island and host.name in answers]
        for node in _names(answers[host.name] for host in hosts):
            places = [place for host in hosts for place in _places(host, answers[host.name], node, launched)]
            if places:  # else a host names units that it does not have
                subject = node if len(graph.addresses) < 2 else f"{node} of {island}"
                others = sorted(_elsewhere(hosts, answers, node, {one.host for one in places}))
                yield Conflict(node, subject, tuple(places), tuple(others))


def _names(answers: Iterable[Answer]) -> list[str]:
    """The names that one node has taken from another."""
    return list(
        dict.fromkeys(node for answer in answers for seen in answer.conflicts.values() for node in seen)
    )


def _places(host: ExpectedHost, answer: Answer, node: str, launched: Launched) -> Iterable[Place]:
    """The units of ``host`` that have, or had, a node called ``node``, or that start it at this moment."""
    declared = {one.unit: one.node for one in host.robots}
    declared |= {one.gate.unit: one.gate.node for one in host.robots if one.gate is not None}
    declared |= {one.unit: one.node for one in host.programs}
    of_files = {one.unit: launched.get((host.name, one.name), ()) for one in host.robots}
    of_files |= {one.unit: launched.get((host.name, one.name), ()) for one in host.programs}
    starting = {
        unit
        for unit, seen in answer.units.items()
        if seen.active in _STARTED and node in of_files.get(unit, ())
    }
    for unit in host.release.units:
        conflict = answer.conflicts.get(unit, {}).get(node)
        own = answer.launched.get(unit)
        if conflict is not None:
            yield Place(host.name, unit, conflict.count, conflict.ago)
        elif (
            declared.get(unit) == node
            or unit in starting
            or (own is not None and node in (*own.starts, *own.ended))
        ):
            yield Place(host.name, unit, 0, 0.0)


def _elsewhere(
    hosts: Iterable[ExpectedHost], answers: Mapping[str, Answer], node: str, known: set[str]
) -> Iterable[str]:
    """Where the master has the node, if that is none of the ``known`` hosts: names of hosts, or addresses."""
    names = {text.lower(): host.name for host in hosts for text in (host.advertised, host.address)}
    for host in hosts:
        for seen in _seen(answers[host.name], node):
            place = host_of(seen.uri).lower()
            if seen.registered and place and names.get(place, place) not in known:
                yield names.get(place, place)


def _seen(answer: Answer, node: str) -> Iterable[NodeSeen]:
    sources = (answer.nodes, *(one.nodes for one in answer.launched.values()))
    return (nodes[node] for nodes in sources if node in nodes)
