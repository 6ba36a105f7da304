"""Probes all hosts in parallel, over one connection each; one host's failure does not affect the others."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from swarm_onboard.agent.verbs import probe
from swarm_onboard.agent.verbs.probe import Answer, Request

from swarmctl.health.checks.connection import inputs_of, nodes_of, peers_of
from swarmctl.health.checks.link import neighbours
from swarmctl.health.checks.publisher import publishers_of
from swarmctl.health.checks.unit import RESTART_WINDOW
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, ExpectedProgram, ExpectedRobot
from swarmctl.health.host_checks import host_checks
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.answer_check import checked
from swarmctl.remote.ask import ask
from swarmctl.remote.transport import AgentSession, HostError, Session, Target, Transport
from swarmctl.resources import host_check_names
from swarmctl.swarm.topics import DIAGNOSTICS, DriverTopic

LONGEST_LISTENING = 10.0  # s, however slow a topic is
_A_REPORT = 2.5  # s within which the multimaster node reports at least once
_PERIODS = 2.5  # a rate is measured from at least two messages


def request(graph: ExpectedGraph, host: ExpectedHost, window: float) -> Request:
    """The request to the agent of ``host``. ``window``: how long to listen to each topic, s.

    A hub also reports the publishers of its island's command topics, and what it has of other islands; where
    a gate stands, also those of every other topic on which a driver might take commands.
    """
    island = [one for one in graph.hosts if one.hub == host.name] if host.is_hub else []
    unmastered = [] if host.master_uri else island or [host]
    gated = any(robot.gate is not None for one in island for robot in one.robots)
    robots = {robot.node: robot for robot in host.robots if robot.node}
    gates = [robot.gate for robot in host.robots if robot.gate is not None]
    return Request(
        graph.swarm,
        host.probe.name,
        list(host.release.units),
        host.master_uri,
        nodes={
            **{node: _topics_of(robot, window) for node, robot in robots.items()},
            **{gate.node: {gate.reports.name: listening(gate.reports, window)} for gate in gates},
            **{program.node: _measured(program, window) for program in host.programs if program.node},
            **_multimaster_nodes(host, window),
        },
        parameters={node: {**robot.parameters} for node, robot in robots.items()},
        **_islands(graph, host),
        commands=[topic for one in island for robot in one.robots for topic in _command_topics(robot)],
        command_types=list(host.velocities) if gated else [],
        publishers=publishers_of(graph, host) if island else {},
        homes={node: one.advertised for one in island for node in nodes_of(one)},
        peers=list(peers_of(graph, host)),
        expected={name: ends for one in unmastered for name, ends in _expected(one)},
        skippable={one.node: one.unit for one in host.programs if one.node},
        inputs=list(dict.fromkeys(topic for one in inputs_of(graph, host) for topic in one.topics)),
        provides=[
            *(name for one in host.robots for name, _ in one.provides),
            *(name for one in host.programs for name, _ in one.provides),
        ],
        devices=[robot.device for robot in host.robots if robot.device],
        launched={
            **{
                one.unit: {
                    **dict.fromkeys((name for name, _ in one.provides), 0.0),
                    **_topics_of(one, window),
                }
                for one in host.robots
                if not one.node
            },
            **{one.unit: _searched(one, window) for one in host.programs if _is_searched(one)},
        },
        advertised=host.advertised,
        restart_window=RESTART_WINDOW,
        images={
            one.unit: (one.container.engine, one.container.image)
            for one in host.programs
            if one.container is not None
        },
        checks=list(host_check_names()),
        clock=(round(window, 3) if graph.simulated_time else 0.0) if host.master_unit else None,
        pings={one.advertised: round(window, 3) for one in neighbours(graph, host)},
        requires=list(host.release.requires),
    )


def _topics_of(robot: ExpectedRobot, window: float) -> dict[str, float]:
    """The topics of a driver, each with the seconds to listen; none where its rate is not known."""
    return {one.name: listening(one, window) if one.rate else 0.0 for one in robot.topics}


def _is_searched(program: ExpectedProgram) -> bool:
    """Whether the nodes of a program are to be found: it runs for good, and nothing names them."""
    return not program.node and program.lifecycle == "service"


def _measured(program: ExpectedProgram, window: float) -> dict[str, float]:
    return {topic.name: listening(topic, window) for topic in program.measured}


def _searched(program: ExpectedProgram, window: float) -> dict[str, float]:
    """The topics by which the nodes of a program are found, each with the seconds to listen."""
    declared = (name for name, _ in (*program.publishes, *program.subscribes, *program.provides))
    return {**dict.fromkeys(declared, 0.0), **_measured(program, window)}


def _command_topics(robot: ExpectedRobot) -> Iterator[str]:
    if robot.command:
        yield robot.command
    if robot.gate is not None:
        yield robot.gate.output


def _expected(host: ExpectedHost) -> Iterator[tuple[str, dict[str, list[str]]]]:
    """Yields what the graph has for certain of ``host``, by node or unit; not what may be left out.

    Many programs subscribe only while somebody receives their own output.
    """
    for robot in host.robots:
        if robot.optional:
            continue
        takes = [robot.takes[0]] if robot.command else []
        topics, provided = [one.name for one in robot.topics], [name for name, _ in robot.provides]
        yield robot.node or robot.unit, {"publishes": topics, "subscribes": takes, "provides": provided}
        if robot.gate is not None:
            gate = robot.gate
            yield gate.node, {"publishes": [gate.output], "subscribes": [robot.command], "provides": []}
    for program in host.programs:
        if not program.optional and program.lifecycle == "service":
            yield (
                program.node or program.unit,
                {
                    "publishes": [name for name, _ in program.publishes],
                    "subscribes": [],
                    "provides": [name for name, _ in program.provides],
                },
            )


def _multimaster_nodes(host: ExpectedHost, window: float) -> dict[str, dict[str, float]]:
    if host.multimaster is None:
        return {}
    reports = {DIAGNOSTICS: round(max(window, _A_REPORT), 3)}
    return {node: reports if node == host.multimaster.reporter else {} for node in host.multimaster.nodes}


def _islands(graph: ExpectedGraph, host: ExpectedHost) -> dict[str, Any]:
    """The bridged topics at the master of ``host``, and the addresses of its own island."""
    if not host.is_hub or len(graph.addresses) < 2:
        return {}
    crossing = (one.topic for one in graph.bridges if host.name in (one.hub, one.origin_hub))
    own = list(graph.addresses[host.island])
    return {"graph": True, "bridged": list(dict.fromkeys(crossing)), "own": own}


def listening(topic: DriverTopic, window: float) -> float:
    """Returns how long to listen, s: enough for two messages of a slow topic."""
    return round(max(window, min(_PERIODS / topic.rate, LONGEST_LISTENING)), 3)


WINDOW = 2.0  # s of listening to a topic, unless it is slow
_AROUND = 40.0  # s, more than the sum of the agent's own time limits before and after listening
_LONGEST_TEXT = 300  # characters


def probe_hosts(
    graph: ExpectedGraph,
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    window: float = WINDOW,
    parallel: int,
) -> dict[str, Answer | HostError]:
    """The answer of every host of ``graph``, or the error.

    ``window``: how long to listen to each topic, s.
    """
    requests = {host.name: request(graph, host, window) for host in graph.hosts}
    probes = {host.name: host.probe for host in graph.hosts}
    patience = max(window, LONGEST_LISTENING) + _AROUND

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Answer:
        with agent_client.agent_session(session, verbs=("probe",), module=probes[target.host]) as host:
            return probed(host, requests[target.host], patience)

    chosen = [targets[name] for name in requests]
    return parallel_hosts.results_of(parallel_hosts.run(chosen, work, transport=transport, parallel=parallel))


def probed(host: AgentSession, request: probe.Request, timeout: float) -> Answer:
    """Returns what a host has seen. Raises ``HostError``."""
    answer = ask(host, probe.handle, request, timeout=timeout, longest_text=_LONGEST_TEXT)
    ahead = None if answer.time is None else answer.time - time.time()
    return answer._replace(clock_ahead=ahead, checks=checks_of(answer))


def checks_of(answer: Answer) -> dict[str, list[Any]]:
    """Returns what was observed for each check of a host, by name, as values of the check's type.

    Raises ``HostError`` if a check reports what it cannot.
    """
    return {
        name: [
            checked(one, host_checks()[name].Seen, f"what the host observed for `{name}`") for one in found
        ]
        for name, found in answer.checks.items()
        if name in host_checks()
    }
