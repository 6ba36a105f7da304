"""What is tuned for a robot is something that the robot can do."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Severity


def unreachable_limits(case: Case) -> Iterator[Diagnostic]:
    """SET001: a speed limit above what the wheels bear limits nothing; often the decimal point slipped."""
    for name, robot in case.spec.robots.items():
        kinematics = case.types[robot.type].kinematics
        reach = {
            "linear": (kinematics.wheel_speed_max, "m/s"),
            "angular": (2 * kinematics.wheel_speed_max / kinematics.wheel_separation, "rad/s"),
        }
        for axis, (fastest, unit) in reach.items():
            limit = getattr(robot.settings.limits, axis)
            if limit is not None and limit > fastest:
                yield Diagnostic(
                    "SET001",
                    f"the limit of {limit:g} {unit} is above what a `{robot.type}` can do",
                    case.span("robots", name, "settings", "limits", axis),
                    severity=Severity.WARNING,
                    label=f"its wheels bear {fastest:.3g} {unit}",
                    help=("lower it, or leave it out",),
                )


RULES: tuple[Rule, ...] = (unreachable_limits,)
