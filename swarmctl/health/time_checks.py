"""Checks of clocks, and of simulated time: each master has what the spec says, and its clock moves. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from statistics import median

from swarmctl.health import checks
from swarmctl.health.checks import State, Verdict
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost
from swarmctl.health.observations import Answer, SimulatedTimeSeen
from swarmctl.health.program_checks import CHECK as PROGRAM
from swarmctl.health.root_cause import Findings
from swarmctl.swarm.topics import CLOCK

TIME = "simulated time"
_LARGEST_SKEW = 1.0  # s between two clocks of hosts; the measurement itself errs by some tenths


def clocks(graph: ExpectedGraph, answers: Mapping[str, Answer]) -> dict[str, Verdict]:
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
    return {host: clock(ahead - reference, name) for host, ahead in aheads.items()}


def clock(ahead: float, whose: str) -> Verdict:
    """Compares clocks. ``ahead``: by how much a host's clock is ahead of ``whose``, s."""
    if abs(ahead) <= _LARGEST_SKEW:
        return checks.ok(f"agrees with {whose}")
    side = "ahead of" if ahead > 0 else "behind"
    text = f"is {abs(ahead):.1f} s {side} {whose}: transforms and time stamps are wrong"
    return Verdict(State.WARNING, text, "check that chrony runs on both; `chronyc sources` lists its sources")


def compare(found: Findings, graph: ExpectedGraph, answers: Mapping[str, Answer]) -> None:
    """Files one finding for each master."""
    programs = (one for host in graph.hosts for one in host.programs if one.gives_time)
    clocks = [f"{PROGRAM} {one.name}" for one in programs if graph.simulated_time]
    for host in graph.hosts:
        seen = answers[host.name].simulated_time if host.name in answers else None
        if host.name not in answers or not host.master_unit or (seen is None and not graph.simulated_time):
            continue
        verdict = _verdict(host, seen, wanted=graph.simulated_time)
        causes = [f"master {host.name}", f"probe {host.name} ros"]
        found.add(TIME, host.name, verdict, host=host, after=[*causes, f"probe {host.name} {TIME}", *clocks])


def _verdict(host: ExpectedHost, seen: SimulatedTimeSeen | None, *, wanted: bool) -> Verdict:
    restart = f"on {host.name}: sudo systemctl restart {host.master_unit}"
    if seen is None:
        return checks.unknown("was not checked")
    if seen.used and not wanted:
        text = f"/use_sim_time is true at {host.master_uri}, and the spec does not simulate time: nodes that"
        hint = f"{restart}, which starts its nodes again; or write `ros: {{use_sim_time: true}}`"
        return checks.bad(f"{text} start now wait for {CLOCK}", hint)
    if not wanted:
        return checks.ok("nodes have the time of their hosts")
    if not seen.used:
        text = f"/use_sim_time is not true at {host.master_uri}: nodes that start now have the time of their"
        return checks.bad(f"{text} hosts", f"{restart}, which sets it and starts its nodes again")
    return _clock(seen)


def _clock(seen: SimulatedTimeSeen) -> Verdict:
    paused = "check whether the simulator or player is paused or has ended"
    if not seen.publishers:
        return checks.bad(f"nothing publishes {CLOCK}: the time of all nodes stands still", paused)
    who = seen.publishers[0]
    if len(seen.publishers) > 1:
        names = checks.listed(seen.publishers)
        return checks.bad(f"{names} publish {CLOCK}: the time jumps between them", "stop all but one")
    if seen.error:
        return checks.bad(f"{CLOCK} of {who} cannot be received: {seen.error}")
    within = f"in {seen.seconds:g} s"
    if not seen.count:
        return checks.bad(f"no message of {who} on {CLOCK} {within}: the time stands still", paused)
    if seen.moved == 0:
        text = f"stands at {seen.now or 0.0:.1f} s: {seen.count} messages {within} have the same time"
        return checks.bad(f"{CLOCK} of {who} {text}", paused)
    if seen.moved is None:
        return Verdict(State.WARNING, f"one message of {who} on {CLOCK} {within}: the time moves in jumps")
    return checks.ok(f"{CLOCK} of {who} moves")
