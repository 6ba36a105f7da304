"""The serial device of a robot. Pure."""

from __future__ import annotations

from swarm_onboard.agent.observations import DeviceSeen

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks import unit
from swarmctl.health.expected_graph import ExpectedRobot
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, bad, ok, unknown

TABLE = {
    "device": (
        ("the device of a robot does not exist", "unhealthy, with the adapters that are connected"),
        ("another file is at its path, or drivers cannot open it", "unhealthy"),
    )
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each robot with a line."""
    for host, robot, answer in context.robots():
        if robot.device:
            verdict = _verdict(robot, answer.devices.get(robot.device))
            after = [f"probe {host.name} devices", unit.key(host.name, robot.line_unit)]
            after += [f"release {host.name}"] if answer.release is None else []
            found.add("device", robot.name, verdict, robot=robot, after=after)


def _verdict(robot: ExpectedRobot, seen: DeviceSeen | None) -> Verdict:
    """Checks that the robot's serial device exists and that drivers may open it."""
    if seen is None:
        return unknown(f"{robot.device} was not checked")
    if not seen.exists:
        nearby = f"; connected adapters: {', '.join(seen.nearby)}" if seen.nearby else ""
        return bad(f"{robot.device} does not exist", f"connect {robot.adapter}{nearby}")
    if not seen.is_device:
        return bad(f"{robot.device} is not a serial device", "remove the file at this path")
    if not seen.usable:
        text = f"{robot.device} cannot be opened by drivers: group {seen.group}, mode {seen.mode:04o}"
        return bad(text, "it needs group dialout and mode 0660; check for another udev rule that sets them")
    return ok(robot.device if seen.resolves in ("", robot.device) else f"{robot.device} ({seen.resolves})")
