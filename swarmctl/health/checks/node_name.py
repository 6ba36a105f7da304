"""Nodes of one name in one graph, which take it from each other or run side by side. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks.connection import Owner, nodes_of
from swarmctl.health.checks.unit import RESTART_WINDOW
from swarmctl.health.expected_graph import ExpectedHost
from swarmctl.health.name_conflicts import NODE_NAME, Conflict
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import State, Verdict, bad

TABLE = {
    NODE_NAME: (
        ("two nodes take one name from each other", "unhealthy, with both hosts and units"),
        ("a second node has taken the name of a unit's node, and is gone", "a warning"),
        (
            "several nodes of one name run side by side",
            "unhealthy, with the hosts; a warning if the spec does not name it",
        ),
    )
}

_FORGOTTEN = 30.0  # s until a graph has forgotten a node that was killed (20 s in DDS), and the look itself


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each name of which a node was ended by another, or that several have."""
    for conflict in context.conflicts:
        found.add(NODE_NAME, conflict.subject, _verdict(conflict))
    for hub, answer in context.hosts:
        for node, places in answer.doubles.items():
            owners = [(host, nodes_of(host)[node]) for host in context.graph.hosts if node in nodes_of(host)]
            if not any(_just_started(context, host, owner) for host, owner in owners):
                names = [context.by_address[one].name if one in context.by_address else one for one in places]
                robot, program = owners[0][1] if owners else (None, None)
                verdict = _doubled(node, names, State.BAD if owners else State.WARNING)
                found.add(NODE_NAME, node, verdict, host=hub, robot=robot, program=program)


def _just_started(context: CheckContext, host: ExpectedHost, owner: Owner) -> bool:
    """Whether systemd has started its unit again: a graph keeps a node that was killed for a while."""
    robot, program = owner
    name = robot.unit if robot is not None else program.unit if program is not None else ""
    seen = context.answers[host.name].units.get(name) if host.name in context.answers else None
    return seen is not None and (seen.restarted > 0 or 0 < seen.running < _FORGOTTEN)


def _doubled(node: str, hosts: Sequence[str], state: State) -> Verdict:
    known = list(dict.fromkeys(one for one in hosts if one))
    where = f", on host{'' if len(known) == 1 else 's'} {' and '.join(known)}" if known else ""
    text = f"several nodes are called {node}{where}: who asks for one reaches all of them"
    return Verdict(state, text, "stop the others, or give them another name or namespace")


def _verdict(conflict: Conflict) -> Verdict:
    """Bad as long as two nodes have the name; a warning once only one is left."""
    node, places = conflict.node, conflict.places
    hosts = list(dict.fromkeys([*(one.host for one in places), *conflict.elsewhere]))
    times = sum(one.count for one in places)
    counted = f"{times} time{'' if times == 1 else 's'} within {RESTART_WINDOW / 60:g} min"
    taken = f"each takes the name from the other, {counted}"
    units = ", ".join(f"{one.unit} on {one.host}" for one in places)
    if len(hosts) > 1:
        many = "two" if len(hosts) == 2 else str(len(hosts))
        text = f"{many} nodes are called {node}, on hosts {' and '.join(hosts)}: {taken}"
    elif len(places) > 1:
        text = f"two nodes are called {node}, both on host {hosts[0]}: {taken}"
    else:
        last = min(one.ago for one in places)
        text = (
            f"a second node called {node} has taken the name from that of {units} {counted}, "
            f"the last time {last:.0f} s ago"
        )
        return Verdict(State.WARNING, text, "if it still runs, give it another name or namespace")
    return bad(text, f"give one of them another name or `namespace` ({units}), or remove it")
