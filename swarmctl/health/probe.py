"""The probe's question to a host."""

from __future__ import annotations

from typing import Any

from swarmctl.health.expected import ExpectedGraph, ExpectedHost
from swarmctl.topology.interfaces import DIAGNOSTICS, DriverTopic

AGENT_VERBS = ("probe", "probe_graph", "probe_ros")  # the modules of the agent that the probe is made of
LONGEST_LISTENING = 10.0  # s, however slow a topic is
_A_REPORT = 2.5  # s in which the multimaster node reports at least once
_PERIODS = 2.5  # a rate is measured from at least two messages


def request(graph: ExpectedGraph, host: ExpectedHost, window: float) -> dict[str, Any]:
    """What to ask the agent of ``host``. The hub is also asked who commands the robots of its island, and
    what it has of other islands where there are any."""
    island = [one for one in graph.hosts if one.hub == host.name] if host.is_hub else []
    return {
        "verb": "probe",
        "swarm": graph.swarm,
        "units": list(host.release.units),
        "master": host.master_uri,
        "nodes": [
            {"name": robot.node, "topics": {topic.name: listening(topic, window) for topic in robot.topics}}
            for robot in host.robots
        ]
        + [{"name": program.node, "topics": {}} for program in host.programs if program.node]
        + _multimaster_nodes(host, window),
        "graph": _graph_asked(graph, host),
        "commands": [robot.command for one in island for robot in one.robots],
        "devices": [robot.device for robot in host.robots],
    }


def _multimaster_nodes(host: ExpectedHost, window: float) -> list[dict[str, Any]]:
    if host.multimaster is None:
        return []
    speaker = host.multimaster.speaker
    return [
        {"name": node, "topics": {DIAGNOSTICS: round(max(window, _A_REPORT), 3)} if node == speaker else {}}
        for node in host.multimaster.nodes
    ]


def _graph_asked(graph: ExpectedGraph, host: ExpectedHost) -> dict[str, Any] | None:
    """The topics that cross at the master of ``host``, and which addresses are its island's own."""
    if not host.is_hub or len(graph.addresses) < 2:
        return None
    crossing = (one.topic for one in graph.bridges if host.name in (one.hub, one.origin_hub))
    return {"topics": list(dict.fromkeys(crossing)), "own": list(graph.addresses[host.island])}


def listening(topic: DriverTopic, window: float) -> float:
    """How long to listen, s: long enough for two messages of a slow topic."""
    return round(max(window, min(_PERIODS / topic.rate, LONGEST_LISTENING)), 3)
