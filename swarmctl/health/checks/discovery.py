"""Whether nodes that have no master find each other: the servers, and who sees whom. Pure."""

from __future__ import annotations

from collections.abc import Iterator

from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks import link, unit
from swarmctl.health.checks.connection import nodes_of
from swarmctl.health.expected_graph import ExpectedHost
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, bad, listed, ok, unknown

CHECK = "discovery"
TABLE = {
    CHECK: (
        ("no process has the port of a discovery server, or of a Zenoh router", "unhealthy"),
        ("a host sees no node at all, though its own run", "unhealthy"),
        ("a host misses what is expected while the graph still changes, after 20 s", "unknown"),
        (
            "the hub does not see a node of another host that this host itself sees",
            "unhealthy: nothing passes between the two",
        ),
    )
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each host that has looked at the graph, and for each host that its hub misses."""
    for host, answer in context.hosts:
        if answer.seen is None:
            continue
        causes = [*_servers(context, host), *link.keys(context.graph, host)]
        found.add(CHECK, host.name, _verdict(host, answer), host=host, after=causes)
        for home in context.graph.hosts if host.is_hub else ():
            if home.hub == host.name and (missing := list(_missing(context, answer, home))):
                own = [context.reached(home.name), key(host), key(home), *link.keys(context.graph, home)]
                verdict = _unseen(host, home, missing)
                found.add(CHECK, f"{host.name} to {home.name}", verdict, host=home, after=[*own, *causes])


def key(host: ExpectedHost) -> str:
    """Returns the key of the finding whether a host sees the graph."""
    return f"{CHECK} {host.name}"


def _servers(context: CheckContext, host: ExpectedHost) -> Iterator[str]:
    """What may be wrong with the servers that the nodes of ``host`` use."""
    if host.servers is None:
        return
    servers = host.servers.hosts
    for one in servers:
        yield context.reached(one)
        yield unit.key(one, host.servers.unit)
        yield from [f"{CHECK} {one}"] if host.name not in servers else []  # no server explains another


def _verdict(host: ExpectedHost, answer: Answer) -> Verdict:
    servers = host.servers
    if servers is not None and host.name in servers.hosts and "ports" not in answer.troubles:
        ports = answer.listening_udp if servers.protocol == "udp" else answer.listening
        if servers.port not in ports:
            text = f"no process has port {servers.port}/{servers.protocol}: nodes do not find each other"
            return bad(text, f"on {host.name}: sudo systemctl restart {servers.unit}")
    running = [one for one in _units(host) if one in answer.units and answer.units[one].runs]
    if running and not answer.seen:
        many = "a unit with a node runs" if len(running) == 1 else f"{len(running)} units with nodes run"
        hint = _hint(host, "it")
        if servers is not None:  # measured with Fast DDS 3.2: its clients may not come back
            hint += (
                f"; after a restart of a server, on {host.name}: sudo systemctl restart {' '.join(running)}"
            )
        return bad(f"it sees no node in the graph, though {many}", hint)
    seen = f"sees {answer.seen} node{'' if answer.seen == 1 else 's'}"
    return (
        unknown(f"{seen}, and not yet all that are expected: more still appear")
        if answer.incomplete
        else ok(seen)
    )


def _units(host: ExpectedHost) -> Iterator[str]:
    """The units whose nodes have names."""
    yield from (robot.unit for robot in host.robots if robot.node)
    yield from (program.unit for program in host.programs if program.node)


def _missing(context: CheckContext, hub: Answer, home: ExpectedHost) -> Iterator[str]:
    """The nodes that ``home`` sees on itself and its hub does not see."""
    answer = context.answers.get(home.name)
    if answer is None or home.is_hub or hub.incomplete:
        return
    for node in nodes_of(home):
        if node in answer.nodes and answer.nodes[node].registered and node not in hub.peers:
            yield node


def _unseen(hub: ExpectedHost, home: ExpectedHost, nodes: list[str]) -> Verdict:
    they = "it publishes" if len(nodes) == 1 else "they publish"
    text = f"{hub.name} does not see {listed(nodes)} of {home.name}: what {they} does not arrive there"
    return bad(text, _hint(home, hub.name))


def _hint(host: ExpectedHost, other: str) -> str:
    firewall = f"check the firewalls of {host.name}"
    if host.servers is None:
        firewall += f" and {other}" if other != "it" else ""
        return f"{firewall}; a network that drops multicast needs `ros: {{discovery: server}}`"
    places = ", ".join(host.servers.hosts)
    return f"{firewall} and {places}: sudo nft list ruleset; {host.servers.protocol.upper()} must be open"
