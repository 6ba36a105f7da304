"""Whether nodes can connect to the nodes of other hosts, in the directions in which ROS 1 connects. Pure.

A master connects to the slave API of every node (ROS wiki, Slave API, ``publisherUpdate``), a subscriber to
that of each publisher and to its port for topics. Where a firewall drops one of these connections, all units
run, and messages do not arrive.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from swarm_onboard.agent.observations import PeerSeen
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks import link
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, ExpectedProgram, ExpectedRobot
from swarmctl.health.root_cause import Findings
from swarmctl.health.unit_faults import host_of
from swarmctl.health.verdict import bad, listed

CHECK = "connection"
TABLE = {
    CHECK: (
        (
            "a node cannot connect to that of another host, which listens",
            "unhealthy: a firewall is in between",
        ),
    )
}
Owner = tuple[ExpectedRobot | None, ExpectedProgram | None]


@dataclass(frozen=True)
class Input:
    """Topics to which a node subscribes, and whose node that is; ``node`` is for people."""

    node: str
    topics: tuple[str, ...]
    owner: Owner


def inputs_of(graph: ExpectedGraph, host: ExpectedHost) -> Iterator[Input]:
    """Yields what the nodes of ``host`` subscribe to; of a hub also what comes of robots of other islands."""
    own = list(_inputs_of_nodes(host))
    known = {topic for one in own for topic in one.topics}
    yield from own
    bridges = (one for one in graph.bridges if one.hub == host.name and one.robots)
    if received := dict.fromkeys(one.topic for one in bridges if one.topic not in known):
        yield Input("a subscriber", tuple(received), (None, None))


def _inputs_of_nodes(host: ExpectedHost) -> Iterator[Input]:
    for robot in host.robots:
        if robot.command:
            yield Input(_commanded(robot), (robot.command,), (robot, None))
    for program in host.programs:
        topics = tuple(topic for topic, _ in program.subscribes)
        yield Input(program.node or f"a node of {program.name}", topics, (None, program))


def _commanded(robot: ExpectedRobot) -> str:
    return robot.guard_node or f"the driver of {robot.name}"


def peers_of(graph: ExpectedGraph, hub: ExpectedHost) -> Iterator[str]:
    """Yields the nodes on other hosts to which the master on ``hub`` connects; none if it has none."""
    others = (host for host in graph.hosts if hub.is_hub and hub.name == host.hub != host.name)
    return (node for host in others for node in nodes_of(host))


def nodes_of(host: ExpectedHost) -> dict[str, Owner]:
    """The named nodes of ``host``, those that take commands first, with the robot or program of each."""
    found: dict[str, Owner] = {robot.guard_node: (robot, None) for robot in host.robots}
    found |= {robot.node: (robot, None) for robot in host.robots}
    found |= {program.node: (None, program) for program in host.programs}
    return {node: owner for node, owner in found.items() if node}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each pair of nodes of which one was seen not to connect to the other.

    The first one of each host that lets nothing in explains the others.
    """
    causes: dict[str, list[str]] = {}
    graph = context.graph
    for host, answer in context.hosts:
        for node, seen, home in _closed(context, host, answer):
            for one, effect in _cut_off(graph, host, home, node, seen):
                robot, program = one.owner
                hint = f"check the firewall on {home.name}: sudo nft list ruleset; all TCP ports must be"
                key = found.add(
                    CHECK, subject(one.node, host, node, home),
                    bad(f"cannot connect to {seen.error}; {effect}", f"{hint} open to {host.name}"),
                    host=host, robot=robot, program=program,
                    after=[*causes.get(home.name, ()), f"address {home.name}", *link.keys(graph, host)],
                )  # fmt: skip
                causes.setdefault(home.name, []).append(key)


def unconnected(context: CheckContext, host: ExpectedHost, robot: ExpectedRobot) -> Mapping[str, str]:
    """Returns the findings, by the publisher of the robot's commands to which there is no connection."""
    return {
        node: f"{CHECK} {subject(_commanded(robot), host, node, home)}"
        for node, seen, home in _closed(context, host, context.answers[host.name])
        if robot.command in seen.topics
    }


def subject(one: str, host: ExpectedHost, other: str, home: ExpectedHost) -> str:
    """Returns the name of a pair of nodes in findings."""
    return f"{one} on {host.name} to {other} on {home.name}"


def _closed(
    context: CheckContext, host: ExpectedHost, answer: Answer
) -> Iterator[tuple[str, PeerSeen, ExpectedHost]]:
    """Yields the nodes of other hosts that let in no connection of ``host``, with their hosts."""
    for node, seen in answer.peers.items():
        home = context.by_address.get(host_of(seen.uri))
        if home is not None and home is not host and _is_closed(node, seen, context.answers.get(home.name)):
            yield node, seen, home


def _is_closed(node: str, seen: PeerSeen, home: Answer | None) -> bool:
    """Whether a process listens on the port that let no connection in. A node that hangs may let none in."""
    if not seen.error or home is None or seen.port not in home.listening:
        return False
    return node not in home.nodes or home.nodes[node].alive is True


def _cut_off(
    graph: ExpectedGraph, host: ExpectedHost, home: ExpectedHost, node: str, seen: PeerSeen
) -> Iterator[tuple[Input, str]]:
    """Yields what of ``host`` does not connect to ``node``, with the effect."""
    for one in inputs_of(graph, host):
        if topics := [topic for topic in one.topics if topic in seen.topics]:
            yield one, f"unless the two are connected already, nothing arrives on {listed(topics)}"
    owner = nodes_of(home).get(node)
    if owner is not None and host.name == home.hub and seen.uri.rstrip("/").endswith(f":{seen.port}"):
        yield Input("the master", (), owner), "messages of nodes that start now do not arrive there"
