"""The time of a host's processors. Pure."""

from __future__ import annotations

from swarm_onboard.agent.observations import LoadSeen

from swarmctl.health.check_context import CheckContext
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, listed, ok, warning

TABLE = {
    "load": (("its processors are busy for 90 % of the time, half of it for its own processes", "a warning"),)
}
BUSY = 0.9  # of the time of all processors


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each host."""
    for host, answer in context.hosts:
        if answer.load is not None:
            found.add("load", host.name, _verdict(answer.load, host.name), host=host)


def _verdict(seen: LoadSeen, host: str) -> Verdict:
    """Checks whether the processes of a host leave time of its processors."""
    if seen.busy < BUSY or seen.own < BUSY / 2:
        return ok("has time left")
    text = f"its processes take {seen.own:.0%} of the time of its processors"
    return warning(f"{text}, most of it {listed(seen.busiest)}", f"on {host}: top")
