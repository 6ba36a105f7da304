"""Who publishes what only a robot's driver should, and which registered publishers do not answer. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks.connection import unconnected
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, ExpectedRobot
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, bad, listed, warning

TABLE = {
    "publisher": (
        ("a second node publishes a topic of a robot's driver", "unhealthy"),
        ("a registered publisher of such a topic, or of commands, does not answer", "a warning"),
    )
}


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


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each topic of a robot with other publishers, or with ones that do not answer."""
    for host, robot, _ in context.robots():
        if (hub := context.answers.get(host.hub)) is None:
            continue
        remove = f"on {host.name}: {host.master_cleanup}" if host.master_cleanup else ""
        for topic in _own_topics(robot):
            nodes = hub.others.get(topic, ())
            if alive := [node for node in nodes if not _is_silent(node, hub)]:
                found.add("publisher", topic, _second(robot, alive, hub), robot=robot)
            elif nodes:
                found.add("publisher", topic, _silent(nodes, hub, remove), robot=robot)
        commanders = hub.commanders.get(robot.command, ())
        if silent := [node for node in commanders if _is_silent(node, hub)]:
            closed = unconnected(context, host, robot)
            after = [closed[node] for node in silent] if closed.keys() >= set(silent) else ()
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
    text = f"{listed(named)} {verb} it as well as {robot.node}: its subscribers receive both"
    return bad(text, f"stop {them}, or remap the topic")


def _silent(nodes: Sequence[str], hub: Answer, remove: str) -> Verdict:
    """A node that was ended by force stays registered; so does one behind a firewall, or one that hangs."""
    verb, does, it_has = ("is", "does", "it has") if len(nodes) == 1 else ("are", "do", "they have")
    why = hub.senders[nodes[0]].error
    text = f"{listed(nodes)} {verb} registered as its publisher, and {does} not answer: {why}"
    return warning(text, f"if {it_has} ended, {remove}" if remove else "")
