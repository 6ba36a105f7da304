"""What is tuned for a robot is something that the robot can do."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.cameras import camera_of, tuned
from swarmctl.spec.diagnostics import Diagnostic, Severity
from swarmctl.spec.edits import mend, remove
from swarmctl.spec.settings import merged
from swarmctl.spec.source import Loc


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


def missing_cameras(case: Case) -> Iterator[Diagnostic]:
    """SET004: settings of a camera for a robot that has none."""
    spec = case.spec
    if spec.defaults.robot.camera.model_fields_set and not any(
        camera_of(case.types[one.type].sensors) for one in spec.robots.values()
    ):
        yield _no_camera(case, ("defaults", "robot", "camera"), "no robot has a camera")
    for name, robot in spec.robots.items():
        if robot.settings.camera.model_fields_set and not camera_of(case.types[robot.type].sensors):
            able = sorted(one for one, kind in case.types.items() if camera_of(kind.sensors))
            loc, message = (
                ("robots", name, "settings", "camera"),
                f"robots of type `{robot.type}` have no camera",
            )
            yield _no_camera(case, loc, message, f"of the types, {' and '.join(able)} have one")


def _no_camera(case: Case, loc: Loc, message: str, *others: str) -> Diagnostic:
    return Diagnostic(
        "SET004",
        message,
        case.span(*loc, key=True),
        label="no camera",
        help=("; ".join(["leave it out", *others]),),
        fix=mend("remove it", remove(case.source, loc)),
    )


def impossible_images(case: Case) -> Iterator[Diagnostic]:
    """SET005: images that the robot has no room for, or that its camera does not make."""
    general = case.spec.defaults.robot
    judged: set[str] = set()  # types by what is said for all robots
    for name, robot in case.spec.robots.items():
        own = bool(robot.settings.camera.model_fields_set)
        if not own and (robot.type in judged or not general.camera.model_fields_set):
            continue
        judged |= set() if own else {robot.type}
        kind = case.types[robot.type]
        found = camera_of(kind.sensors)
        if found is None:
            continue
        image = tuned(found[1], merged(general, kind.settings, robot.settings).camera)
        loc = ("robots", name, "settings", "camera") if own else ("defaults", "robot", "camera")
        for _, what, mending in image.complaints():
            yield Diagnostic(
                "SET005",
                f"the camera of robots of type `{robot.type}` makes no such images: {what}",
                case.span(*loc, key=True),
                label=f"for robot `{name}`",
                help=(mending,),
            )


RULES: tuple[Rule, ...] = (
    unreachable_limits, unread_settings, misplaced_drivers, missing_cameras, impossible_images,
)  # fmt: skip
