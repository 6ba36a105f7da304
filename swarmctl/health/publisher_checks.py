"""Who publishes what only a robot's driver should, and which registered publishers do not answer. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from swarmctl.health import checks
from swarmctl.health.checks import Verdict
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, ExpectedRobot
from swarmctl.health.observations import Answer
from swarmctl.health.peer_checks import Unconnected
from swarmctl.health.root_cause import Findings


def publishers_of(graph: ExpectedGraph, hub: ExpectedHost) -> dict[str, list[str]]:
    """Returns the nodes that should publish each topic of the robots at the master of ``hub``.

    Topics that other nodes may publish as well are left out: those outside the robot's namespace, and what a
    program declares whose node is not known.
    """
    declared = set(graph.program_topics)
    return {
        topic: [robot.node]
        for host in graph.hosts
        if host.hub == hub.name
        for robot in host.robots
        for topic in _own_topics(robot)
        if topic not in declared
    }


def compare(
    found: Findings, host: ExpectedHost, robot: ExpectedRobot, hub: Answer | None, unconnected: Unconnected
) -> None:
    """Files a finding for each topic of ``robot`` with other publishers, or with ones that do not answer."""
    if hub is None:
        return
    remove = f"on {host.name}: {host.master_cleanup}" if host.master_cleanup else ""
    for topic in _own_topics(robot):
        nodes = hub.others.get(topic, ())
        if alive := [node for node in nodes if not _is_silent(node, hub)]:
            found.add("publisher", topic, _second(robot, alive, hub), robot=robot)
        elif nodes:
            found.add("publisher", topic, _silent(nodes, hub, remove), robot=robot)
    commanders = hub.commanders.get(robot.command, ())
    if silent := [node for node in commanders if _is_silent(node, hub)]:
        causes = [unconnected.get((robot.name, node), "") for node in silent]
        after = causes if all(causes) else ()
        found.add("publisher", robot.command, _silent(silent, hub, remove), robot=robot, after=after)


def _own_topics(robot: ExpectedRobot) -> Iterator[str]:
    own = f"/{robot.namespace}/"
    return (topic.name for topic in robot.topics if robot.node and topic.name.startswith(own))


def _is_silent(node: str, hub: Answer) -> bool:
    return node in hub.senders and bool(hub.senders[node].error)


def _second(robot: ExpectedRobot, nodes: Sequence[str], hub: Answer) -> Verdict:
    places = [hub.senders[node].host if node in hub.senders else "" for node in nodes]
    named = [f"{node} on {place}" if place else node for node, place in zip(nodes, places, strict=True)]
    verb, them = ("publishes", "it") if len(nodes) == 1 else ("publish", "them")
    text = f"{checks.listed(named)} {verb} it as well as {robot.node}: its subscribers receive both"
    return checks.bad(text, f"stop {them}, or remap the topic")


def _silent(nodes: Sequence[str], hub: Answer, remove: str) -> Verdict:
    """A node that was ended by force stays registered; so does one behind a firewall, or one that hangs."""
    verb, does, it_has = ("is", "does", "it has") if len(nodes) == 1 else ("are", "do", "they have")
    why = hub.senders[nodes[0]].error
    text = f"{checks.listed(nodes)} {verb} registered as its publisher, and {does} not answer: {why}"
    return checks.warning(text, f"if {it_has} ended, {remove}" if remove else "")
