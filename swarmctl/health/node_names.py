"""Nodes of one name in one graph: each ends the other whenever it registers at the master. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from swarmctl.health import checks
from swarmctl.health.checks import RESTART_WINDOW, State, Verdict
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost
from swarmctl.health.observations import Answer, NodeSeen
from swarmctl.health.root_cause import Findings

CHECK = "node name"
_SETTLED = 60.0  # s after which a unit that lost its node has other reasons not to run
Launched = Mapping[tuple[str, str], Collection[str]]  # nodes of launch files, by host and program or robot
_STARTED = ("active", "activating", "reloading")


@dataclass(frozen=True)
class Place:
    """A unit on a host that has a node of the name, and how often another node has ended that."""

    host: str
    unit: str
    count: int
    ago: float


@dataclass(frozen=True)
class Conflicts:
    """The findings about equal names, by host and unit."""

    keys: Mapping[tuple[str, str], tuple[str, ...]]

    def of(self, host: str, unit: str) -> tuple[str, ...]:
        """Returns the keys of the findings that explain what is wrong with a unit."""
        return self.keys.get((host, unit), ())


def compare(
    found: Findings, graph: ExpectedGraph, answers: Mapping[str, Answer], launched: Launched
) -> Conflicts:
    """Files a finding for each name of which a node was ended by another."""
    keys: dict[tuple[str, str], list[str]] = {}
    for island in dict.fromkeys(host.island for host in graph.hosts):
        hosts = [host for host in graph.hosts if host.island == island and host.name in answers]
        for node in _names(answers[host.name] for host in hosts):
            places = [place for host in hosts for place in _places(host, answers[host.name], node, launched)]
            if not places:  # a host names units that it does not have
                continue
            others = sorted(_elsewhere(hosts, answers, node, {one.host for one in places}))
            subject = node if len(graph.addresses) < 2 else f"{node} of {island}"
            key = found.add(CHECK, subject, verdict(node, places, others))
            latest = min((place.ago for place in places if place.count), default=0.0)
            for place in places if latest <= _SETTLED else ():
                keys.setdefault((place.host, place.unit), []).append(key)
    return Conflicts({place: tuple(names) for place, names in keys.items()})


def _names(answers: Iterable[Answer]) -> list[str]:
    """The names of nodes that were ended by another of their name."""
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
            or (own is not None and node in (*own.started, *own.ended))
        ):
            yield Place(host.name, unit, 0, 0.0)


def _elsewhere(
    hosts: Iterable[ExpectedHost], answers: Mapping[str, Answer], node: str, known: set[str]
) -> Iterable[str]:
    """Where the master has the node, if that is none of the ``known`` hosts: names of hosts, or addresses."""
    names = {text.lower(): host.name for host in hosts for text in (host.advertised, host.address)}
    for host in hosts:
        for seen in _seen(answers[host.name], node):
            place = checks.host_of(seen.uri).lower()
            if seen.registered and place and names.get(place, place) not in known:
                yield names.get(place, place)


def _seen(answer: Answer, node: str) -> Iterable[NodeSeen]:
    sources = (answer.nodes, *(one.nodes for one in answer.launched.values()))
    return (nodes[node] for nodes in sources if node in nodes)


def verdict(node: str, places: list[Place], elsewhere: list[str]) -> Verdict:
    """Bad as long as two nodes have the name; a warning once only one is left."""
    hosts = list(dict.fromkeys([*(one.host for one in places), *elsewhere]))
    times = sum(one.count for one in places)
    counted = f"{times} time{'' if times == 1 else 's'} within {RESTART_WINDOW / 60:g} min"
    units = ", ".join(f"{one.unit} on {one.host}" for one in places)
    if len(hosts) > 1:
        many = "two" if len(hosts) == 2 else str(len(hosts))
        text = (
            f"{many} nodes are called {node}, on hosts {' and '.join(hosts)}: each ends the other, {counted}"
        )
    elif len(places) > 1:
        text = f"two nodes are called {node}, both on host {hosts[0]}: each ends the other, {counted}"
    else:
        last = min(one.ago for one in places)
        text = (
            f"a second node called {node} has ended that of {units} {counted}, the last time {last:.0f} s ago"
        )
        return Verdict(State.WARNING, text, "if it still runs, give it another name or namespace")
    return checks.bad(text, f"give one of them another name or `namespace` ({units}), or remove it")
