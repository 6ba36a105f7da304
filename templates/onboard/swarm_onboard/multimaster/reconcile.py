"""Computes the calls that bring a master to the wanted state. Pure: values in, calls out.

Nothing is registered under a name that the master knows at another URI: that would shut the old node down.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import AbstractSet, Mapping, Sequence
from urllib.parse import urlsplit

from swarm_onboard.multimaster.config import Config, Peer
from swarm_onboard.multimaster.graph import Entry, Graph
from swarm_onboard.multimaster.peer_state import Offer, Refusal

MOST_PUBLISHERS = 64  # of one topic at one peer


@dataclass(frozen=True)
class Plan:
    """What to do at the own master. ``brought`` must be in the record before any other call."""

    drop: tuple[Entry, ...] = ()
    add: tuple[Entry, ...] = ()
    brought: Mapping[Entry, str] = field(default_factory=dict)
    refusals: tuple[Refusal, ...] = ()


def names_wanted(peer: Peer, graph: Graph) -> frozenset[str]:
    """The nodes whose URIs are needed to know what ``peer`` offers."""
    return frozenset(node for topic in peer.receives for node in _publishers(graph, topic)[:MOST_PUBLISHERS])


def offer_of(peer: Peer, graph: Graph) -> Offer:
    """The publishers of the peer's own nodes for this island, which run on its hosts.

    Others were brought there from elsewhere, or are refused: the peer's record, which anybody can write,
    decides only whether that is reported.
    """
    entries, refusals = [], []
    for topic, declared in peer.receives.items():
        nodes = _publishers(graph, topic)
        for node in nodes:
            entry = Entry(topic, node, graph.nodes.get(node, ""))
            if not entry.uri:
                continue
            why = _objection(peer, entry, declared, graph.types.get(topic, "*"))
            if why and entry in graph.record.entries:
                continue
            if why:
                refusals.append(Refusal(topic, node, why))
            else:
                entries.append(entry)
        if len(nodes) > MOST_PUBLISHERS:
            refusals.append(Refusal(topic, nodes[-1], f"more than {MOST_PUBLISHERS} publishers"))
    return Offer(frozenset(entries), tuple(refusals))


def _publishers(graph: Graph, topic: str) -> list[str]:
    return sorted(node for name, node in graph.publishers if name == topic)


def _objection(peer: Peer, entry: Entry, declared: str, kind: str) -> str:
    if kind not in (declared, "*"):
        return f"its type is {kind}, declared is {declared}"
    if runs_on(peer, entry):
        return ""
    return f"it runs at `{host_of(entry.uri)}`, which is not a host of island {peer.island}"


def may_come(peer: Peer, entry: Entry) -> bool:
    """Whether ``peer`` could offer ``entry`` at all."""
    return entry.topic in peer.receives and runs_on(peer, entry)


def runs_on(peer: Peer, entry: Entry) -> bool:
    """Whether the node of ``entry`` runs on a host of ``peer``."""
    return host_of(entry.uri) in peer.hosts


def host_of(uri: str) -> str:
    """Returns the host in the URI of a node; empty if it is none."""
    try:
        parts = urlsplit(uri)
        return (parts.hostname or "") if parts.scheme == "http" and parts.port and " " not in uri else ""
    except ValueError:
        return ""


def wanted_from(
    offers: Sequence[tuple[str, AbstractSet[Entry]]], brought: Mapping[Entry, str]
) -> tuple[dict[Entry, str], list[Refusal]]:
    """The entries to register, each with its island. Of several nodes with one name it takes the one that is
    registered already, else that of the first peer."""
    claims = [
        (entry not in brought, number, entry, island)
        for number, (island, entries) in enumerate(offers)
        for entry in entries
    ]
    owners: dict[str, tuple[str, str]] = {}
    wanted: dict[Entry, str] = {}
    refusals = []
    for _, _, entry, island in sorted(claims):
        uri, owner = owners.setdefault(entry.node, (entry.uri, island))
        if uri == entry.uri:
            wanted.setdefault(entry, island)
        else:
            refusals.append(Refusal(entry.topic, entry.node, f"island {owner} has a node of that name too"))
    return wanted, refusals


def plan_for(
    wanted: Mapping[Entry, str],
    own: Graph,
    brought: Mapping[Entry, str],
    renew: AbstractSet[Entry] = frozenset(),
) -> Plan:
    """The next calls towards ``wanted``. ``brought``: what this node has registered there.

    A node that moved is unregistered first, and registered once the master has released its name.
    """
    present = own.entries
    ours = {entry: island for entry, island in brought.items() if entry in present}
    uris_brought = {(entry.node, entry.uri) for entry in brought}
    moving = {entry.node for entry in ours if entry not in wanted}
    add, refusals, adopted = [], [], {}
    for entry, island in sorted(wanted.items()):
        known = own.nodes.get(entry.node)
        if known is None or known == entry.uri:
            adopted[entry] = island
            if entry not in present or entry in renew:
                add.append(entry)
        elif not (entry.node in moving and (entry.node, known) in uris_brought):
            refusals.append(Refusal(entry.topic, entry.node, f"a node of that name runs here, at {known}"))
    drop = tuple(sorted(entry for entry in ours if entry not in wanted))
    return Plan(drop, tuple(add), {**ours, **adopted}, tuple(refusals))


def subscriptions(peer: Peer, graph: Graph, me: str, uri: str) -> tuple[list[str], list[tuple[str, str]]]:
    """At the peer's master: topics to subscribe, and topics with URIs to unsubscribe."""
    known = graph.nodes.get(me)
    mine = graph.subscribed if known == uri else frozenset()
    extra = [(topic, known) for topic in sorted(graph.subscribed - peer.receives.keys()) if known]
    return sorted(topic for topic in peer.receives if topic not in mine), extra


def types_of(config: Config) -> dict[str, str]:
    """The declared type of every topic that may come here."""
    return {topic: kind for peer in config.peers for topic, kind in peer.receives.items()}
