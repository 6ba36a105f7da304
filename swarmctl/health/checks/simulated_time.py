"""Simulated time: each master has what the spec says, and its clock moves. Pure."""

from __future__ import annotations

from swarm_onboard.agent.observations import SimulatedTimeSeen

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks.program import CHECK as PROGRAM
from swarmctl.health.expected_graph import ExpectedHost
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import State, Verdict, bad, listed, ok, unknown
from swarmctl.swarm.topics import CLOCK

TIME = "simulated time"
TABLE = {
    TIME: (
        ("`/use_sim_time` of a master differs from the spec", "unhealthy, with the restart that repairs it"),
        ("nothing publishes `/clock`, or more than one node does", "unhealthy"),
        (
            "no message of `/clock`, or all have the same time (a simulator or player is paused)",
            "unhealthy; below the program that stopped, if one did",
        ),
        ("one message of `/clock` within two seconds", "a warning"),
    )
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files one finding for each master."""
    wanted = context.graph.simulated_time
    programs = (one for host in context.graph.hosts for one in host.programs if one.gives_time)
    clocks = [f"{PROGRAM} {one.name}" for one in programs if wanted]
    for host, answer in context.hosts:
        seen = answer.simulated_time
        if not host.master_unit or (seen is None and not wanted):
            continue
        verdict = _verdict(host, seen, wanted=wanted)
        causes = [f"master {host.name}", f"probe {host.name} ros"]
        found.add(TIME, host.name, verdict, host=host, after=[*causes, f"probe {host.name} {TIME}", *clocks])


def _verdict(host: ExpectedHost, seen: SimulatedTimeSeen | None, *, wanted: bool) -> Verdict:
    restart = f"on {host.name}: sudo systemctl restart {host.master_unit}"
    if seen is None:
        return unknown("was not checked")
    if seen.used and not wanted:
        text = f"/use_sim_time is true at {host.master_uri}, and the spec does not simulate time: nodes that"
        hint = f"{restart}, which starts its nodes again; or write `ros: {{use_sim_time: true}}`"
        return bad(f"{text} start now wait for {CLOCK}", hint)
    if not wanted:
        return ok("nodes have the time of their hosts")
    if not seen.used:
        text = f"/use_sim_time is not true at {host.master_uri}: nodes that start now have the time of their"
        return bad(f"{text} hosts", f"{restart}, which sets it and starts its nodes again")
    return _clock(seen)


def _clock(seen: SimulatedTimeSeen) -> Verdict:
    paused = "check whether the simulator or player is paused or has ended"
    if not seen.publishers:
        return bad(f"nothing publishes {CLOCK}: the time of all nodes stands still", paused)
    who = seen.publishers[0]
    if len(seen.publishers) > 1:
        names = listed(seen.publishers)
        return bad(f"{names} publish {CLOCK}: the time jumps between them", "stop all but one")
    if seen.error:
        return bad(f"{CLOCK} of {who} cannot be received: {seen.error}")
    within = f"in {seen.seconds:g} s"
    if not seen.count:
        return bad(f"no message of {who} on {CLOCK} {within}: the time stands still", paused)
    if seen.moved == 0:
        text = f"stands at {seen.now or 0.0:.1f} s: {seen.count} messages {within} have the same time"
        return bad(f"{CLOCK} of {who} {text}", paused)
    if seen.moved is None:
        return Verdict(State.WARNING, f"one message of {who} on {CLOCK} {within}: the time moves in jumps")
    return ok(f"{CLOCK} of {who} moves")
