"""The clocks of hosts: they agree with each other. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from statistics import median

from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.check_context import CheckContext
from swarmctl.health.expected_graph import ExpectedGraph
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, ok, warning

TABLE = {
    "clock": (
        (
            "the clock of a host differs from its hub's by more than 1 s, or the hub's from all others'",
            "a warning",
        ),
        ("so does that of a hub from those of islands that exchange topics with it", "a warning"),
    )
}
_LARGEST_SKEW = 1.0  # s between two clocks of hosts; the measurement itself errs by some tenths


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each host whose clock is known."""
    clocks = _clocks(context.graph, context.answers)
    for host, _ in context.hosts:
        if host.name in clocks:
            found.add("clock", host.name, clocks[host.name], host=host)


def _clocks(graph: ExpectedGraph, answers: Mapping[str, Answer]) -> dict[str, Verdict]:
    """Compares the clocks that are known: of each host with its hub's, of hubs that exchange topics."""
    aheads = {
        host.name: ahead
        for host in graph.hosts
        if host.name in answers and (ahead := answers[host.name].clock_ahead) is not None
    }
    found: dict[str, Verdict] = {}
    for hub in dict.fromkeys(host.hub for host in graph.hosts if host.hub in aheads):
        names = [host.name for host in graph.hosts if host.hub == hub and host.name in aheads]
        island = {name: aheads[name] for name in names}
        found |= _compared(hub, island, ("the hub's clock", "the other hosts' clock"))
    joined = {hub for bridge in graph.bridges for hub in (bridge.origin_hub, bridge.hub)}
    hubs = {name: ahead for name, ahead in aheads.items() if name in joined and found[name].fine}
    for first in [*hubs][:1]:
        found |= _compared(first, hubs, (f"{first}'s clock", "the other islands' clock"))
    return found


def _compared(first: str, aheads: Mapping[str, float], whose: tuple[str, str]) -> dict[str, Verdict]:
    """Compares clocks with that of ``first``, or with the others' where these agree that it is wrong.

    ``whose``: how people call the one and the other.
    """
    reference, name = aheads[first], whose[0]
    others = [ahead for name, ahead in aheads.items() if name != first]
    if len(others) > 1 and max(others) - min(others) <= _LARGEST_SKEW:
        middle = median(others)
        if abs(reference - middle) > _LARGEST_SKEW:
            reference, name = middle, whose[1]
    return {host: _verdict(ahead - reference, name) for host, ahead in aheads.items()}


def _verdict(ahead: float, whose: str) -> Verdict:
    """Compares clocks. ``ahead``: by how much a host's clock is ahead of ``whose``, s."""
    if abs(ahead) <= _LARGEST_SKEW:
        return ok(f"agrees with {whose}")
    side = "ahead of" if ahead > 0 else "behind"
    text = f"is {abs(ahead):.1f} s {side} {whose}: transforms and time stamps are wrong"
    return warning(text, "check that chrony runs on both; `chronyc sources` lists its sources")
