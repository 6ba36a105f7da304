"""The ROS variables of the processes of drivers and programs. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from swarmctl.health.check_context import CheckContext
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, bad, listed, ok

TABLE = {
    "environment": (
        (
            "a driver, or a program without a container, has other `ROS_*` variables than the release",
            "unhealthy, with what it has: a drop-in sets it, or it runs from before",
        ),
    )
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each driver, and for each program that runs; the engine of a container has none."""
    for host, robot, answer in context.robots():
        verdict = _verdict(host.name, robot.unit, answer.environments.get(robot.unit, ()))
        found.add("environment", robot.name, verdict, robot=robot)
    for host, program, answer in context.programs():
        unit = answer.units.get(program.unit)
        if unit is not None and unit.runs and program.container is None:
            verdict = _verdict(host.name, program.unit, answer.environments.get(program.unit, ()))
            found.add("environment", program.name, verdict, program=program)


def _verdict(host: str, unit: str, differences: Sequence[str]) -> Verdict:
    """Checks the ROS variables of the process of a unit. ``differences`` from the release, in words."""
    if not differences:
        return ok("is that of the release")
    hint = f"on {host}, for what overrides it: systemctl cat {unit}; then: sudo systemctl restart {unit}"
    return bad(f"{listed(differences)}: a drop-in sets it, or the unit runs from before", hint)
