"""The parameters that a driver of swarmctl sets. Pure."""

from __future__ import annotations

from swarm_onboard.agent.observations import NodeSeen

from swarmctl.health.check_context import CheckContext
from swarmctl.health.expected_graph import ExpectedRobot
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, bad, listed, ok

TABLE = {
    "parameters": (("the master has lost a parameter of a driver, or has another value", "unhealthy"),),
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each driver that lives and sets parameters."""
    for host, robot, answer in context.robots():
        node = answer.nodes.get(robot.node)
        if robot.parameters and node is not None and node.alive and node.parameters is not None:
            after = [f"master {host.name}", f"driver {robot.name}", f"release {host.name}"]
            found.add("parameters", robot.name, _verdict(robot, node), robot=robot, after=after)


def _verdict(robot: ExpectedRobot, seen: NodeSeen) -> Verdict:
    """Checks the parameters that the driver has set, for nodes that read them when they start."""
    if not seen.parameters:
        return ok("are as the driver set them")
    restart = f"on {robot.host}, to set them again: sudo systemctl restart {robot.unit}"
    return bad(f"of {robot.node}: {listed(seen.parameters)}", restart)
