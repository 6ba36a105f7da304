"""The probe's request to a host."""

from __future__ import annotations

from swarm_agent.probe_messages import GraphRequest, NodeRequest, ProbeRequest

from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost
from swarmctl.swarm.topics import DIAGNOSTICS, DriverTopic

LONGEST_LISTENING = 10.0  # s, however slow a topic is
_A_REPORT = 2.5  # s within which the multimaster node reports at least once
_PERIODS = 2.5  # a rate is measured from at least two messages


def request(graph: ExpectedGraph, host: ExpectedHost, window: float) -> ProbeRequest:
    """The request to the agent of ``host``. ``window``: how long to listen to each topic, s.

    A hub also reports the publishers of its island's command topics, and what it has of other islands.
    """
    island = [one for one in graph.hosts if one.hub == host.name] if host.is_hub else []
    robots: list[NodeRequest] = [
        {"name": robot.node, "topics": {topic.name: listening(topic, window) for topic in robot.topics}}
        for robot in host.robots
    ]
    programs: list[NodeRequest] = [
        {"name": program.node, "topics": {}} for program in host.programs if program.node
    ]
    return {
        "verb": "probe",
        "swarm": graph.swarm,
        "module": graph.probe.name,
        "units": list(host.release.units),
        "master": host.master_uri,
        "nodes": [*robots, *programs, *_multimaster_nodes(host, window)],
        "graph": _graph_request(graph, host),
        "commands": [robot.command for one in island for robot in one.robots],
        "devices": [robot.device for robot in host.robots],
    }


def _multimaster_nodes(host: ExpectedHost, window: float) -> list[NodeRequest]:
    if host.multimaster is None:
        return []
    reporter = host.multimaster.reporter
    return [
        {"name": node, "topics": {DIAGNOSTICS: round(max(window, _A_REPORT), 3)} if node == reporter else {}}
        for node in host.multimaster.nodes
    ]


def _graph_request(graph: ExpectedGraph, host: ExpectedHost) -> GraphRequest | None:
    """The bridged topics at the master of ``host``, and the addresses of its own island."""
    if not host.is_hub or len(graph.addresses) < 2:
        return None
    crossing = (one.topic for one in graph.bridges if host.name in (one.hub, one.origin_hub))
    return {"topics": list(dict.fromkeys(crossing)), "own": list(graph.addresses[host.island])}


def listening(topic: DriverTopic, window: float) -> float:
    """Returns how long to listen, s: enough for two messages of a slow topic."""
    return round(max(window, min(_PERIODS / topic.rate, LONGEST_LISTENING)), 3)
