"""Two nodes of one name in one graph, which end each other. Pure."""

from __future__ import annotations

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks.unit import RESTART_WINDOW
from swarmctl.health.name_conflicts import NODE_NAME, Conflict
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import State, Verdict, bad

TABLE = {
    NODE_NAME: (
        ("two nodes of one name end each other", "unhealthy, with both hosts and units"),
        ("a unit has lost its node to a second one that is gone", "a warning"),
    )
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each name of which a node was ended by another."""
    for conflict in context.conflicts:
        found.add(NODE_NAME, conflict.subject, _verdict(conflict))


def _verdict(conflict: Conflict) -> Verdict:
    """Bad as long as two nodes have the name; a warning once only one is left."""
    node, places = conflict.node, conflict.places
    hosts = list(dict.fromkeys([*(one.host for one in places), *conflict.elsewhere]))
    times = sum(one.count for one in places)
    counted = f"{times} time{'' if times == 1 else 's'} within {RESTART_WINDOW / 60:g} min"
    units = ", ".join(f"{one.unit} on {one.host}" for one in places)
    if len(hosts) > 1:
        many = "two" if len(hosts) == 2 else str(len(hosts))
        text = (
            f"{many} nodes are called {node}, on hosts {' and '.join(hosts)}: each ends the other, {counted}"
        )
    elif len(places) > 1:
        text = f"two nodes are called {node}, both on host {hosts[0]}: each ends the other, {counted}"
    else:
        last = min(one.ago for one in places)
        text = (
            f"a second node called {node} has ended that of {units} {counted}, the last time {last:.0f} s ago"
        )
        return Verdict(State.WARNING, text, "if it still runs, give it another name or namespace")
    return bad(text, f"give one of them another name or `namespace` ({units}), or remove it")
