"""What drivers and gates report of themselves in /diagnostics. Pure."""

from __future__ import annotations

from swarm_onboard.agent.observations import Report

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks import unit
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import State, Verdict

TABLE = {
    "report": (("a driver reports a warning or an error in `/diagnostics`", "a warning, or unhealthy"),),
    "gate report": (("a gate reports a warning or an error in `/diagnostics`", "a warning, or unhealthy"),),
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each driver that lives, and for each gate."""
    for host, robot, answer in context.robots():
        node, authority = answer.nodes.get(robot.node), f"authority {robot.name}"
        if robot.node and node is not None and node.alive and node.report is not None:
            after = [f"device {robot.name}", unit.key(host.name, robot.unit), authority]
            found.add("report", robot.name, _verdict(node.report), robot=robot, after=after)
        gate = answer.nodes.get(robot.gate.node) if robot.gate is not None else None
        if gate is not None and gate.report is not None:
            after = [f"wiring {robot.name}", authority]
            found.add("gate report", robot.name, _verdict(gate.report), robot=robot, after=after)


def _verdict(seen: Report) -> Verdict:
    """Returns the state that the driver reports in /diagnostics."""
    state = {0: State.OK, 1: State.WARNING}.get(seen.level, State.BAD)
    return Verdict(state, seen.message or "reports no details")
