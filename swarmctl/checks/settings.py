"""What is tuned for a robot is something that the robot can do."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Severity
from swarmctl.spec.edits import mend, remove


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


READ_BY_OUR_SKETCH = {"firmware", "calibration"}


def unread_settings(case: Case) -> Iterator[Diagnostic]:
    """SET002: a setting of a rosserial robot, which nobody carries out: a limit that is believed in."""
    sketches = {name: kind.sketch for name, kind in case.types.items() if kind.sketch is not None}
    for name, robot in case.spec.robots.items() if sketches else ():
        read = READ_BY_OUR_SKETCH if robot.type in sketches and sketches[robot.type].firmware else set()
        if robot.type in sketches and robot.settings.model_fields_set - read:
            loc = ("robots", name, "settings")
            yield Diagnostic(
                "SET002",
                f"nobody carries out the settings of robot `{name}`: a sketch drives it",
                case.span(*loc, key=True),
                label=f"`{robot.type}` reads none of them",
                help=("set it in the sketch; what the sketch keeps to stands in the robot's type",),
                fix=mend("remove them", remove(case.source, loc)),
            )


RULES: tuple[Rule, ...] = (unreachable_limits, unread_settings)
