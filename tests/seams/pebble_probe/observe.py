"""Fills in the answer from what pebbled lists."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from swarm_onboard.agent.observations import GraphSeen, NodeSeen, Report, SenderSeen, TopicSeen
from swarm_onboard.agent.texts import clipped

from . import daemon

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.probe import Answer, Request


def observe(request: Request, answer: Answer) -> Answer:
    nodes = daemon.nodes()
    bridged = request.bridged or ()
    types = {topic: kind for node in nodes.values() for topic, kind in node["publishes"].items()}
    return answer._replace(
        nodes={name: _node(nodes.get(name), topics) for name, topics in request.nodes.items()},
        commanders={
            topic: [name for name, node in nodes.items() if topic in node["publishes"]]
            for topic in request.commands
        },
        senders={name: SenderSeen(node["host"], node["publishes"]) for name, node in nodes.items()},
        graph=GraphSeen({topic: _publishers(nodes, topic) for topic in bridged}, types, []),
    )


def observe_logs(answer: Answer) -> Answer:
    """Nothing to add: in this middleware a node that has a name keeps it."""
    return answer


def _publishers(nodes: dict[str, dict[str, Any]], topic: str) -> dict[str, str]:
    return {name: f"pebble://{node['host']}" for name, node in nodes.items() if topic in node["publishes"]}


def _node(node: dict[str, Any] | None, topics: Mapping[str, float]) -> NodeSeen:
    if node is None:
        return NodeSeen(False, False)
    return NodeSeen(
        True,
        True,
        publishes={clipped(topic): clipped(kind) for topic, kind in node["publishes"].items()},
        subscribes=node["subscribes"],
        topics={
            topic: TopicSeen(
                int(node["rates"][topic] * seconds), node["rates"][topic], seconds, node["publishes"][topic]
            )
            for topic, seconds in topics.items()
            if topic in node["rates"]
        },
        report=Report(0, node["status"]) if node["status"] else None,
    )
