"""Several islands: what joins their masters, which topics cross, and who must not be there. Pure.

Two masters are compared: what one has from the other is to be just what the other has, under the same names
and addresses, for the topics that cross and for no others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from swarmctl.health import verdicts
from swarmctl.health.crossings import ExpectedBridge, ExpectedMultimaster
from swarmctl.health.expected import ExpectedGraph, ExpectedHost
from swarmctl.health.findings import Findings
from swarmctl.health.seen import Answer, GraphSeen, NodeSeen, Stranger
from swarmctl.health.verdicts import State, Verdict

CHECK = "bridge"
_NAMED = 3  # nodes or topics in one sentence


def compare(
    found: Findings, graph: ExpectedGraph, answers: Mapping[str, Answer], gates: Mapping[str, str]
) -> None:
    """File what is to be said of bridges. ``gates``: by host, whether it could be asked, as a finding."""
    hubs = {host.name: host for host in graph.hosts if host.is_hub}
    peers: dict[str, list[str]] = {}
    for bridge in graph.bridges:
        peers.setdefault(bridge.hub, []).append(bridge.origin_hub)
    joined: dict[str, list[str]] = {}
    for hub in hubs.values():
        if hub.multimaster is not None and hub.name in answers:
            away = [gates[peer] for peer in dict.fromkeys(peers.get(hub.name, ()))]
            joined[hub.name] = list(_multimaster(found, hub, hub.multimaster, answers[hub.name], away))
    for bridge in graph.bridges:
        causes = [*_causes(bridge, gates), *joined.get(bridge.hub, ()), *joined.get(bridge.origin_hub, ())]
        seen = {name: answers[name].graph for name in (bridge.origin_hub, bridge.hub) if name in answers}
        verdict = crossing(bridge, seen.get(bridge.origin_hub), seen.get(bridge.hub), graph.homes)
        origin, target = hubs[bridge.origin_hub], hubs[bridge.hub]
        owner = origin if origin.optional else target
        found.add(CHECK, bridge.subject, verdict, host=owner, after=causes)
    for hub in hubs.values():
        seen_here = answers[hub.name].graph if hub.name in answers else None
        for stranger, verdict in leaks(graph, hub, seen_here):
            found.add("leak", f"{stranger.node} at {hub.name}", verdict, host=hub)


def _causes(bridge: ExpectedBridge, gates: Mapping[str, str]) -> Iterator[str]:
    """What may explain that a topic does not cross, nearest to the ground first."""
    both = (bridge.origin_hub, bridge.hub)
    yield from (gates[hub] for hub in both)
    yield from (f"master {hub}" for hub in both)
    yield from (f"probe {hub} {part}" for hub in both for part in ("ros", "graph"))
    yield from (f"driver {robot}" for robot in bridge.robots)


def _multimaster(
    found: Findings, hub: ExpectedHost, wanted: ExpectedMultimaster, answer: Answer, away: list[str]
) -> Iterator[str]:
    """What joins this hub's master to others; the keys of the findings. ``away``: peers' gates."""
    unit = f"unit {wanted.unit} on {hub.name}"
    yield unit
    for node in wanted.nodes:
        verdict = joining(hub, wanted, node, answer.nodes.get(node))
        after = [f"master {hub.name}", f"probe {hub.name} ros", unit, f"release {hub.name}", *away]
        yield found.add("multimaster", f"{node} on {hub.name}", verdict, host=hub, after=after)


def joining(hub: ExpectedHost, wanted: ExpectedMultimaster, node: str, seen: NodeSeen | None) -> Verdict:
    """A node of the multimaster: is it there, and what does it say?"""
    restart = f"on {hub.name}: systemctl restart {wanted.unit}"
    if seen is None or seen.registered is None:
        return verdicts.unknown("was not asked about")
    if not seen.registered:
        return verdicts.bad("is not registered at the master", restart)
    if not seen.alive:
        return verdicts.bad(f"is registered, but does not answer ({seen.error})", restart)
    if seen.report is None:
        silent = node == wanted.speaker
        return verdicts.unknown("has not said how it is") if silent else verdicts.ok("runs")
    state = {0: State.OK, 1: State.WARNING}.get(seen.report.level, State.BAD)
    return Verdict(state, seen.report.message)


def crossing(
    bridge: ExpectedBridge, origin: GraphSeen | None, target: GraphSeen | None, homes: Mapping[str, str]
) -> Verdict:
    """Does the target's master know the origin's publishers, and no others of the origin?"""
    if origin is None or target is None:
        missing = bridge.hub if target is None else bridge.origin_hub
        return verdicts.unknown(f"the master of {missing} was not asked")
    here = _of_island(bridge.origin, origin.publishers.get(bridge.topic, {}), homes)
    there = _of_island(bridge.origin, target.publishers.get(bridge.topic, {}), homes)
    if unheard := [node for node in here if node not in there]:
        return verdicts.bad(f"{bridge.hub} does not hear {_some(unheard)}")
    if stale := [node for node in there if node not in here]:
        return verdicts.bad(f"{bridge.hub} still has {_some(stale)}, gone from {bridge.origin_hub}")
    if moved := [node for node in here if here[node] != there[node]]:
        node = moved[0]
        return verdicts.bad(f"{bridge.hub} has {node} at {there[node]}, it is at {here[node]}")
    kind = target.types.get(bridge.topic, "*")
    if kind not in (bridge.type, "*"):
        return verdicts.bad(f"is of type {kind} at {bridge.hub}, not {bridge.type}")
    if not here:
        text = f"nobody on {bridge.origin} publishes it now"
        return verdicts.bad(text) if bridge.robots else Verdict(State.SKIPPED, text)
    return verdicts.ok(f"{_some(list(here))} heard")


def leaks(
    graph: ExpectedGraph, hub: ExpectedHost, seen: GraphSeen | None
) -> Iterator[tuple[Stranger, Verdict]]:
    """Nodes of other islands that publish or hear at this master what is not declared to cross.

    What crosses is known between the islands of ``graph``; it may be a part of the swarm.
    """
    if seen is None:
        return
    asked = {host.island for host in graph.hosts if host.is_hub}
    comes = {(one.topic, one.origin) for one in graph.bridges if one.hub == hub.name}
    leaves = {(one.topic, one.to) for one in graph.bridges if one.origin_hub == hub.name}
    for stranger in seen.strangers:
        island = graph.homes.get(verdicts.host_of(stranger.uri).lower())
        if island not in asked:
            continue
        says = [topic for topic in stranger.publishes if (topic, island) not in comes]
        hears = [topic for topic in stranger.hears if (topic, island) not in leaves]
        if says or hears:
            did = " and ".join(
                f"{verb} {_some(topics)}"
                for verb, topics in (("publishes", says), ("hears", hears))
                if topics
            )
            yield (
                stranger,
                verdicts.bad(
                    f"runs on island {island} ({stranger.uri}) and {did} here: nothing says that it may",
                    "if that is to cross, name it under `multimaster.topics` or `control`; "
                    "else look for a program with another island's ROS_MASTER_URI or a second multimaster; "
                    f"what does not run any more, `rosnode cleanup` on {hub.name} takes away",
                ),
            )


def _of_island(island: str, publishers: Mapping[str, str], homes: Mapping[str, str]) -> dict[str, str]:
    return {
        node: uri for node, uri in publishers.items() if homes.get(verdicts.host_of(uri).lower()) == island
    }


def _some(names: list[str]) -> str:
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")
