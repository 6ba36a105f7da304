"""Bridges between islands: the multimaster nodes, the bridged topics, and undeclared nodes. Pure.

Two masters are compared: one must list exactly the publishers that the other has, under the same names and
addresses, for the bridged topics and for no others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import chain

from swarm_onboard.agent.observations import ForeignNode, GraphSeen, NodeSeen
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks import link, unit
from swarmctl.health.expected_graph import ExpectedBridge, ExpectedGraph, ExpectedHost, ExpectedMultimaster
from swarmctl.health.root_cause import Findings
from swarmctl.health.unit_faults import absent, dead, host_of
from swarmctl.health.verdict import State, Verdict, bad, ok, unknown
from swarmctl.swarm.topics import DIAGNOSTICS

CHECK = "bridge"
TABLE = {
    "multimaster": (
        ("a node of the multimaster is not registered, or does not answer", "unhealthy"),
        ("it reports a warning or an error", "a warning, or unhealthy"),
    ),
    CHECK: (
        ("a hub lacks a publisher of a bridged topic, or lists one that is gone or elsewhere", "unhealthy"),
        ("the topic has another type there, or a publisher of that island, too", "unhealthy"),
        ("no robot publishes it on its own island", "unhealthy; skipped for topics of other nodes"),
    ),
    "leak": (("a node of another island takes part in an island without a declared bridge", "unhealthy"),),
}
_NAMED = 3  # nodes or topics in one sentence


def compare(found: Findings, context: CheckContext) -> None:
    """Files the findings about multimasters, bridges, and nodes that no bridge explains."""
    graph, answers = context.graph, context.answers
    hubs = {host.name: host for host in graph.hosts if host.is_hub}
    peers: dict[str, list[str]] = {}
    for bridge in graph.bridges:
        peers.setdefault(bridge.hub, []).append(bridge.origin_hub)
    for hub in hubs.values():
        if hub.multimaster is not None and hub.name in answers:
            others = dict.fromkeys(peers.get(hub.name, ()))
            away = [*(context.reached(peer) for peer in others), *(f"master {peer}" for peer in others)]
            away += link.keys(graph, hub)
            _multimaster(found, hub, hub.multimaster, answers[hub.name], away)
    for bridge in graph.bridges:
        joined = (_joined(hubs[name]) for name in (bridge.hub, bridge.origin_hub) if name in answers)
        causes = [*_causes(bridge, context), *chain.from_iterable(joined)]
        seen = {name: answers[name].graph for name in (bridge.origin_hub, bridge.hub) if name in answers}
        origin, target = hubs[bridge.origin_hub], hubs[bridge.hub]
        compared = _relayed if bridge.relayed else _bridged
        verdict = compared(bridge, seen.get(bridge.origin_hub), seen.get(bridge.hub), graph.homes)
        owner = origin if origin.optional else target
        found.add(CHECK, bridge.subject, verdict, host=owner, after=causes)
    for hub in hubs.values():
        seen_here = answers[hub.name].graph if hub.name in answers else None
        for node, verdict in _leaks(graph, hub, seen_here):
            found.add("leak", f"{node.node} at {hub.name}", verdict, host=hub)


def _causes(bridge: ExpectedBridge, context: CheckContext) -> Iterator[str]:
    """What may explain that a topic is not bridged, most basic cause first."""
    both = (bridge.origin_hub, bridge.hub)
    yield from (context.reached(hub) for hub in both)
    yield from (f"master {hub}" for hub in both)
    yield f"link {bridge.hub} to {bridge.origin_hub}"
    yield from (f"probe {hub} {part}" for hub in both for part in ("ros", "graph"))
    yield from (f"driver {robot}" for robot in bridge.robots)


def _multimaster(
    found: Findings, hub: ExpectedHost, wanted: ExpectedMultimaster, answer: Answer, away: list[str]
) -> None:
    """Checks the multimaster of a hub. ``away``: the keys of the findings about its peers."""
    own = unit.key(hub.name, wanted.unit)
    for node in wanted.nodes:
        verdict = _joining(hub, wanted, node, answer.nodes.get(node))
        after = [f"master {hub.name}", f"probe {hub.name} ros", own, f"release {hub.name}", *away]
        found.add("multimaster", f"{node} on {hub.name}", verdict, host=hub, after=after)


def _joined(hub: ExpectedHost) -> list[str]:
    """The keys of the findings about the multimaster of a hub, if it has one."""
    if (wanted := hub.multimaster) is None:
        return []
    return [unit.key(hub.name, wanted.unit), *(f"multimaster {node} on {hub.name}" for node in wanted.nodes)]


def _joining(hub: ExpectedHost, wanted: ExpectedMultimaster, node: str, seen: NodeSeen | None) -> Verdict:
    """Checks a multimaster node: registered, alive, and the status it reports."""
    restart = f"on {hub.name}: sudo systemctl restart {wanted.unit}"
    if seen is None or seen.registered is None:
        return unknown("was not checked")
    if not seen.registered:
        return bad(absent(hub), restart)
    if not seen.alive:
        return bad(dead(hub, seen), restart)
    if seen.report is None:
        silent = node == wanted.reporter
        return unknown("has reported no status") if silent else ok("runs")
    state = {0: State.OK, 1: State.WARNING}.get(seen.report.level, State.BAD)
    journal = f"on {hub.name}: sudo journalctl -u {wanted.unit} -n 50"
    return Verdict(state, seen.report.message, "" if state is State.OK else journal)


def _bridged(
    bridge: ExpectedBridge, origin: GraphSeen | None, target: GraphSeen | None, homes: Mapping[str, str]
) -> Verdict:
    """Checks that the target's master lists exactly the publishers that the origin has.

    What a robot's driver publishes has no others; commands and diagnostics may have some of each island.
    """
    if origin is None or target is None:
        return _unseen(bridge, target)
    here = _of_island(bridge.origin, origin.publishers.get(bridge.topic, {}), homes)
    there = _of_island(bridge.origin, target.publishers.get(bridge.topic, {}), homes)
    if absent := [node for node in here if node not in there]:
        return bad(f"{bridge.hub} does not receive {_some(absent)}")
    if stale := [node for node in there if node not in here]:
        return bad(f"{bridge.hub} still lists {_some(stale)}, which left {bridge.origin_hub}")
    if moved := [node for node in here if here[node] != there[node]]:
        node = moved[0]
        return bad(f"{bridge.hub} lists {node} at {there[node]} instead of {here[node]}")
    rivals = list(_of_island(bridge.to, target.publishers.get(bridge.topic, {}), homes))
    return _received(bridge, target, list(here), rivals)


def _relayed(
    bridge: ExpectedBridge, origin: GraphSeen | None, target: GraphSeen | None, homes: Mapping[str, str]
) -> Verdict:
    """Checks that a relay publishes in the target's domain as each node that publishes in the origin's.

    Its nodes have the names of those, and run on the hub, as nodes of the island may.
    """
    if origin is None or target is None:
        return _unseen(bridge, target)
    here = list(_of_island(bridge.origin, origin.publishers.get(bridge.topic, {}), homes))
    there = target.publishers.get(bridge.topic, {})
    if absent := [node for node in here if node not in there]:
        return bad(f"{bridge.hub} does not receive {_some(absent)}")
    rivals = [node for node in _of_island(bridge.to, there, homes) if node not in here]
    return _received(bridge, target, here, rivals)


def _unseen(bridge: ExpectedBridge, target: GraphSeen | None) -> Verdict:
    return unknown(f"the graph of {bridge.hub if target is None else bridge.origin_hub} was not checked")


def _received(bridge: ExpectedBridge, target: GraphSeen, here: list[str], rivals: list[str]) -> Verdict:
    """Checks the rest of a topic that arrives from the nodes ``here``, beside ``rivals`` of the target."""
    kind = target.types.get(bridge.topic, "*")
    wrong = "" if kind in (bridge.type, "*") else f"has type {kind} instead of {bridge.type}"
    if rivals and bridge.robots and bridge.topic != DIAGNOSTICS:
        text = f"{_some(rivals)} of {bridge.to} publishes it as well at {bridge.hub}"
        text += f", where it {wrong}" if wrong else ": subscribers there receive both"
        return bad(text, "stop that node, or remap its topic")
    if wrong:
        return bad(f"{wrong} at {bridge.hub}")
    if not here:
        text = f"no publisher on {bridge.origin} at the moment"
        return bad(text) if bridge.robots else Verdict(State.SKIPPED, text)
    return ok(f"{_some(here)} received")


def _leaks(
    graph: ExpectedGraph, hub: ExpectedHost, seen: GraphSeen | None
) -> Iterator[tuple[ForeignNode, Verdict]]:
    """Nodes of other islands that publish or subscribe at this master without a declared bridge.

    Only nodes of islands in ``graph``, which may be a part of the swarm, are judged.
    """
    if seen is None:
        return
    known = {host.island for host in graph.hosts if host.is_hub}
    comes = {(one.topic, one.origin) for one in graph.bridges if one.hub == hub.name}
    leaves = {(one.topic, one.to) for one in graph.bridges if one.origin_hub == hub.name}
    for node in seen.foreign:
        island = graph.homes.get(host_of(node.uri).lower())
        if island not in known:
            continue
        publishes = [topic for topic in node.publishes if (topic, island) not in comes]
        subscribes = [topic for topic in node.subscribes if (topic, island) not in leaves]
        if publishes or subscribes:
            did = " and ".join(
                f"{verb} {_some(topics)}"
                for verb, topics in (("publishes", publishes), ("subscribes to", subscribes))
                if topics
            )
            text = f"runs on island {island} ({node.uri}) and {did} here: no such bridge is declared"
            yield node, bad(text, _leak_hint(hub))


def _leak_hint(hub: ExpectedHost) -> str:
    bridge = "to bridge it, list it under `multimaster.topics` or `control`; otherwise look for "
    if not hub.master_uri:
        return f"{bridge}a program that takes part in the graph of two islands, or a second multimaster"
    return (
        f"{bridge}a program with another island's ROS_MASTER_URI or a second multimaster; "
        f"`rosnode cleanup` on {hub.name} removes nodes that no longer run"
    )


def _of_island(island: str, publishers: Mapping[str, str], homes: Mapping[str, str]) -> dict[str, str]:
    return {node: uri for node, uri in publishers.items() if homes.get(host_of(uri).lower()) == island}


def _some(names: list[str]) -> str:
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")
