"""Which nodes the relay registers at a master of ROS 1, and which it removes. Pure: values in, values out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import AbstractSet, Collection

from swarm_onboard.multimaster.graph import Entry, Graph
from swarm_onboard.multimaster.reconcile import host_of

_MOST = 128  # publishers of a topic: as many of the relay as of others


@dataclass(frozen=True)
class Plan:
    """What to do at the master; ``refused`` names nodes with the reason."""

    drop: tuple[Entry, ...]
    add: tuple[Entry, ...]
    refused: tuple[str, ...]


def publishers(graph: Graph, topics: Collection[str]) -> frozenset[str]:
    """Returns the nodes that publish ``topics``, of a flood of them a part."""
    return frozenset(
        node
        for topic in topics
        for node in sorted(node for name, node in graph.publishers if name == topic)[:_MOST]
    )


def plan_for(wanted: AbstractSet[Entry], graph: Graph, address: str, topics: Collection[str]) -> Plan:
    """The next calls towards ``wanted``, of which each is one of ``topics`` at the host ``address``.

    Others of them there are left from nodes that have gone, or from an earlier run. A name that the master
    knows elsewhere is not registered: that would shut the node there down.
    """
    present = graph.entries
    drop = {one for one in present - wanted if one.topic in topics and host_of(one.uri) == address}
    released = {one.node for one in drop}
    add, refused = [], []
    for entry in sorted(wanted - present):
        known = graph.nodes.get(entry.node)
        if known is None or known == entry.uri:
            add.append(entry)
        elif entry.node not in released:
            refused.append(f"{entry.topic} of {entry.node}: a node of that name runs there, at {known}")
    return Plan(tuple(sorted(drop)), tuple(add), tuple(refused))
