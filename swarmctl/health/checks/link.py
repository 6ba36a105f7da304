"""The packets that are lost between hosts whose nodes depend on each other. Pure."""

from __future__ import annotations

from swarm_onboard.agent.observations import PingSeen

from swarmctl.health.check_context import CheckContext
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, bad, ok, warning
from swarmctl.swarm import names

TABLE = {
    "link": (
        (
            "10 % of the pings of a host to its hub, or of a hub to one that it receives from, are lost",
            "a warning",
        ),
        ("40 % are lost", "unhealthy"),
    )
}
_FEW = 3  # packets
_NOTICEABLE, _HEAVY = 0.1, 0.4  # of the pings; half of that in each direction


def neighbours(graph: ExpectedGraph, host: ExpectedHost) -> list[ExpectedHost]:
    """Returns the hosts with which ``host`` exchanges most: its hub; of a hub, those it receives from."""
    names = {host.hub, *(one.origin_hub for one in graph.bridges if one.hub == host.name)}
    return [one for one in graph.hosts if one.name in names and one.name != host.name]


def keys(graph: ExpectedGraph, host: ExpectedHost) -> list[str]:
    """Returns the keys of the findings about the links of ``host``, and about its WireGuard."""
    others = [other.name for other in neighbours(graph, host)]
    links = [f"link {host.name} to {other}" for other in others]
    unit = f"unit {names.unit(graph.swarm, names.WIREGUARD)} on {host.name}"
    return [unit, *(f"wireguard {host.name} {other}" for other in others), *links]


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each link on which pings are answered. Some hosts answer none on purpose."""
    for host, answer in context.hosts:
        for other in neighbours(context.graph, host):
            seen = answer.pings.get(other.advertised)
            if seen is not None and seen.received:
                found.add("link", f"{host.name} to {other.name}", _verdict(seen, host.name), host=host)


def _verdict(seen: PingSeen, host: str) -> Verdict:
    lost = seen.sent - seen.received
    if lost < _FEW or lost < _NOTICEABLE * seen.sent:
        return ok(f"{seen.received} of {seen.sent} pings were answered")
    text = f"{lost} of {seen.sent} pings were not answered: messages arrive late, or not at all"
    hint = f"improve the signal of {host}, or use another channel, an access point of your own, or a cable"
    return (bad if lost >= _HEAVY * seen.sent else warning)(text, hint)
