"""Fills in the answer from what pebbled lists."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from swarm_onboard.agent.clip import clipped

from . import daemon

if TYPE_CHECKING:
    from swarm_onboard.agent.probe_messages import (
        GraphAnswer,
        NodeAnswer,
        NodeRequest,
        ProbeAnswer,
        ProbeRequest,
        StatusAnswer,
    )


def observe(request: ProbeRequest, answer: GraphAnswer) -> None:
    nodes = daemon.nodes()
    answer["nodes"] = {one["name"]: _node(nodes.get(one["name"]), one) for one in request["nodes"]}
    answer["commanders"] = {
        topic: [name for name, node in nodes.items() if topic in node["publishes"]]
        for topic in request["commands"]
    }
    answer["senders"] = {
        name: {"host": node["host"], "publishes": node["publishes"]} for name, node in nodes.items()
    }
    bridged = request["graph"]["topics"] if request["graph"] else []
    answer["graph"] = {
        "publishers": {topic: _publishers(nodes, topic) for topic in bridged},
        "types": {topic: kind for node in nodes.values() for topic, kind in node["publishes"].items()},
        "strangers": [],
    }


def observe_logs(answer: ProbeAnswer) -> None:
    """Nothing to do: in this middleware a node that has a name keeps it."""


def _publishers(nodes: dict[str, dict[str, Any]], topic: str) -> dict[str, str]:
    return {name: f"pebble://{node['host']}" for name, node in nodes.items() if topic in node["publishes"]}


def _node(node: dict[str, Any] | None, request: NodeRequest) -> NodeAnswer:
    if node is None:
        return {"registered": False, "alive": False}
    status = node["status"]
    reports: list[StatusAnswer] = (
        [{"level": 0, "name": "", "message": status, "hardware": "", "values": {}}] if status else []
    )
    return {
        "registered": True,
        "alive": True,
        "publishes": {clipped(topic): clipped(kind) for topic, kind in node["publishes"].items()},
        "subscribes": node["subscribes"],
        "topics": {
            topic: {
                "count": int(node["rates"][topic] * seconds),
                "rate": node["rates"][topic],
                "age": None,
                "seconds": seconds,
                "type": node["publishes"][topic],
                "error": "",
            }
            for topic, seconds in request["topics"].items()
            if topic in node["rates"]
        },
        "reports": reports,
    }
