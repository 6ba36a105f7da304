"""Whether nodes can connect to the nodes of other hosts, in the directions in which ROS 1 connects. Pure.

A master connects to the slave API of every node (ROS wiki, Slave API, ``publisherUpdate``), a subscriber to
that of each publisher and to its port for topics. Where a firewall drops one of these connections, all units
run, and messages do not arrive.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from swarmctl.health import checks, command_sources
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, ExpectedRobot
from swarmctl.health.expected_programs import ExpectedProgram
from swarmctl.health.observations import Answer, PeerSeen, SenderSeen, UnconnectedSeen
from swarmctl.health.root_cause import Findings

CHECK = "connection"
Unconnected = Mapping[tuple[str, str], str]  # the findings, by robot and the publisher of its commands
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
            yield Input(robot.guard_node or f"the driver of {robot.name}", (robot.command,), (robot, None))
    for program in host.programs:
        topics = tuple(topic for topic, _ in program.subscribes)
        yield Input(program.node or f"a node of {program.name}", topics, (None, program))


def peers_of(graph: ExpectedGraph, hub: ExpectedHost) -> Iterator[str]:
    """Yields the nodes on other hosts to which the master on ``hub`` connects; none if it has none."""
    others = (host for host in graph.hosts if hub.is_hub and hub.name == host.hub != host.name)
    return (node for host in others for node in _owners(host))


def _owners(host: ExpectedHost) -> dict[str, Owner]:
    """The named nodes of ``host``, those that take commands first, with the robot or program of each."""
    found: dict[str, Owner] = {robot.guard_node: (robot, None) for robot in host.robots}
    found |= {robot.node: (robot, None) for robot in host.robots}
    found |= {program.node: (None, program) for program in host.programs}
    return {node: owner for node, owner in found.items() if node}


def compare(found: Findings, graph: ExpectedGraph, answers: Mapping[str, Answer]) -> Unconnected:
    """Files a finding for each pair of nodes of which one was seen not to connect to the other.

    The first one of each host that lets nothing in explains the others.
    """
    places = {host.advertised.lower(): host for host in graph.hosts}
    causes: dict[str, list[str]] = {}
    unconnected: dict[tuple[str, str], str] = {}
    for host in graph.hosts:
        closed = set()
        for node, seen in answers[host.name].peers.items() if host.name in answers else ():
            home = places.get(checks.host_of(seen.uri))
            if home is None or home.name == host.name or not _is_closed(node, seen, answers.get(home.name)):
                continue
            closed.add(node)
            for one, effect in _cut_off(graph, host, home, node, seen):
                robot, program = one.owner
                hint = f"check the firewall on {home.name}: sudo nft list ruleset; all TCP ports must be"
                key = found.add(
                    CHECK, f"{one.node} on {host.name} to {node} on {home.name}",
                    checks.bad(f"cannot connect to {seen.error}; {effect}", f"{hint} open to {host.name}"),
                    host=host, robot=robot, program=program, after=causes.get(home.name, ()),
                )  # fmt: skip
                causes.setdefault(home.name, []).append(key)
                if robot is not None and one.topics:
                    unconnected[robot.name, node] = key
        for pair in answers[host.name].unconnected if host.name in answers else ():
            home = places.get(checks.host_of(pair.uri))
            if home is not None and pair.publisher not in closed:
                _file_unconnected(found, graph, host, home, pair)
    return unconnected


def _file_unconnected(
    found: Findings, graph: ExpectedGraph, host: ExpectedHost, home: ExpectedHost, pair: UnconnectedSeen
) -> None:
    """Files that a subscriber on ``host`` gets nothing of a publisher on ``home``, although both answer.

    What may not command a robot need not be connected to it.
    """
    inputs = [one for one in inputs_of(graph, host) if pair.topic in one.topics]
    robot, program = next((one.owner for one in inputs if one.node == pair.node), (None, None))
    sender = SenderSeen(checks.host_of(pair.uri))
    if robot is not None and not command_sources.may_command(robot, pair.publisher, sender):
        return
    nothing, types = f"nothing arrives on {pair.topic}", (pair.type, pair.publisher_type)
    if all(types) and "*" not in types and pair.type != pair.publisher_type:
        text = f"subscribes to {pair.type}, and the publisher sends {pair.publisher_type}: {nothing}"
        hint = "remap one of the two topics, or start one of the nodes with the other's type"
    elif pair.md5 and pair.publisher_md5 and pair.md5 != pair.publisher_md5:
        sums = f"MD5 sum {pair.md5[:8]} here, {pair.publisher_md5[:8]} there"
        text = f"{pair.type} is another message ({sums}): {nothing}"
        package = pair.type.partition("/")[0]
        hint = f"install or build the same version of {package} for both, and start them again"
    else:
        text = f"is not connected, although its port is open: {nothing}"
        unit = _unit_of(robot, program)
        start = f"on {host.name}: sudo systemctl restart {unit}" if unit else f"start {pair.node} again"
        hint = f"{start}; it asks the master for the publishers then"
    found.add(
        CHECK, f"{pair.node} on {host.name} to {pair.publisher} on {home.name}", checks.bad(text, hint),
        host=host, robot=robot, program=program, after=[f"command type {robot.name}"] if robot else (),
    )  # fmt: skip


def _unit_of(robot: ExpectedRobot | None, program: ExpectedProgram | None) -> str:
    if robot is not None:
        return robot.gate.unit if robot.gate is not None else robot.unit
    return program.unit if program is not None else ""


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
            yield one, f"unless the two are connected already, nothing arrives on {checks.listed(topics)}"
    owner = _owners(home).get(node)
    if owner is not None and host.name == home.hub and seen.uri.rstrip("/").endswith(f":{seen.port}"):
        yield Input("the master", (), owner), "messages of nodes that start now do not arrive there"
