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
    """SET002: a setting of a robot that rosserial_python drives: a limit that only people believe in."""
    for name, robot in case.spec.robots.items():
        sketch = case.types[robot.type].foreign(robot.driver)
        if sketch is None:
            continue
        read = READ_BY_OUR_SKETCH if sketch.firmware else set()
        if robot.settings.model_fields_set - read:
            loc = ("robots", name, "settings")
            yield Diagnostic(
                "SET002",
                f"nobody carries out the settings of robot `{name}`: rosserial_python drives it",
                case.span(*loc, key=True),
                label="rosserial_python reads none of them",
                help=(f"let swarmctl drive it: take `driver` out of `{name}`; or set them in its sketch",),
                fix=mend("remove them", remove(case.source, loc)),
            )


def misplaced_drivers(case: Case) -> Iterator[Diagnostic]:
    """SET003: rosserial_python for a robot that speaks something else."""
    for name, robot in case.spec.robots.items():
        if robot.driver == "rosserial_python" and case.types[robot.type].sketch is None:
            loc = ("robots", name, "driver")
            yield Diagnostic(
                "SET003",
                f"robot `{name}` does not speak rosserial",
                case.span(*loc),
                label=f"drives no `{robot.type}`",
                help=("leave `driver` out: swarmctl's own drives it",),
                fix=mend("remove it", remove(case.source, loc)),
            )


RULES: tuple[Rule, ...] = (unreachable_limits, unread_settings, misplaced_drivers)
