"""The packets that are lost between hosts whose nodes depend on each other. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.health import checks
from swarmctl.health.checks import Verdict
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost
from swarmctl.health.observations import Answer, PingSeen
from swarmctl.health.root_cause import Findings

CHECK = "link"
_FEW = 3  # packets
_NOTICEABLE, _HEAVY = 0.1, 0.4  # of the pings; half of that in each direction


def neighbours(graph: ExpectedGraph, host: ExpectedHost) -> list[ExpectedHost]:
    """Returns the hosts with which ``host`` exchanges most: its hub; of a hub, those it receives from."""
    names = {host.hub, *(one.origin_hub for one in graph.bridges if one.hub == host.name)}
    return [one for one in graph.hosts if one.name in names and one.name != host.name]


def links_of(graph: ExpectedGraph, host: ExpectedHost) -> list[str]:
    """Returns the findings about the links of ``host``."""
    return [f"{CHECK} {host.name} to {one.name}" for one in neighbours(graph, host)]


def compare(found: Findings, graph: ExpectedGraph, answers: Mapping[str, Answer]) -> None:
    """Files a finding for each link on which pings are answered. Some hosts answer none on purpose."""
    for host in graph.hosts:
        for other in neighbours(graph, host) if host.name in answers else ():
            seen = answers[host.name].pings.get(other.advertised)
            if seen is not None and seen.received:
                found.add(CHECK, f"{host.name} to {other.name}", losses(seen, host.name), host=host)


def losses(seen: PingSeen, host: str) -> Verdict:
    """Checks the share of pings without an answer."""
    lost = seen.sent - seen.received
    if lost < _FEW or lost < _NOTICEABLE * seen.sent:
        return checks.ok(f"{seen.received} of {seen.sent} pings were answered")
    text = f"{lost} of {seen.sent} pings were not answered: messages arrive late, or not at all"
    hint = f"improve the signal of {host}, or use another channel, an access point of your own, or a cable"
    return (checks.bad if lost >= _HEAVY * seen.sent else checks.warning)(text, hint)
