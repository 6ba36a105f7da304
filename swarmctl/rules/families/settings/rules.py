"""Robot settings: within the robot's capabilities, and read by its driver."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from swarmctl.diagnostics import Diagnostic
from swarmctl.robot_types.cameras import Image
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.settings import Limits
from swarmctl.rules.context import RuleContext, rule
from swarmctl.yamltext.edits import make_fix, remove
from swarmctl.yamltext.source import Loc


@rule("SET001")
def unreachable_limits(context: RuleContext) -> Iterator[Diagnostic]:
    """A speed limit above the maximum of the wheels: of a robot, of a type, or of all robots."""
    for name, robot in context.spec.robots.items():
        limits = robot.settings.limits
        for axis, found in _unreachable(limits, _reach(context.types[robot.type]), f"type `{robot.type}`"):
            yield replace(found, span=context.span("robots", name, "settings", "limits", axis))
    for name, kind in context.document.own_types.items():
        for axis, found in _unreachable(kind.settings.limits, _reach(kind), f"type `{name}`"):
            yield replace(found, span=context.document.span_of_type(name, "settings", "limits", axis))
    limits = context.spec.defaults.robot.limits
    if limits.model_fields_set:
        reaches = [_reach(context.types[kind]) for kind in {one.type for one in context.spec.robots.values()}]
        fastest = {axis: max((one[axis] for one in reaches), default=math.inf) for axis in _AXES}
        for axis, found in _unreachable(limits, fastest, "every robot"):
            yield replace(found, span=context.span("defaults", "robot", "limits", axis))


_AXES = {"linear": "m/s", "angular": "rad/s"}


def _reach(kind: RobotType) -> Mapping[str, float]:
    """The fastest that the wheels of a type allow, by axis."""
    fastest = kind.kinematics.wheel_speed_max
    return {"linear": fastest, "angular": 2 * fastest / kind.kinematics.wheel_separation}


def _unreachable(limits: Limits, reach: Mapping[str, float], whose: str) -> Iterator[tuple[str, Diagnostic]]:
    """Yields the axis of each limit that is never reached, and the finding, still without its place."""
    for axis, unit in _AXES.items():
        limit = getattr(limits, axis)
        if limit is not None and limit > reach[axis]:
            yield (
                axis,
                Diagnostic(
                    "SET001",
                    f"the limit of {limit:g} {unit} is above the maximum of {whose}",
                    label=f"its maximum is {reach[axis]:.3g} {unit}",
                    help=("lower it, or leave it out",),
                ),
            )


READ_BY_OUR_SKETCH = {"firmware", "calibration"}


@rule("SET002")
def unread_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """Settings of a robot with driver rosserial_python, which reads none."""
    for name, robot in context.spec.robots.items():
        sketch = context.types[robot.type].foreign(robot.driver)
        if sketch is None:
            continue
        read = READ_BY_OUR_SKETCH if sketch.firmware else set()
        if robot.settings.model_fields_set - read:
            loc = ("robots", name, "settings")
            yield Diagnostic(
                "SET002",
                f"the settings of robot `{name}` have no effect with driver `rosserial_python`",
                context.span(*loc, key=True),
                label="read by swarmctl's driver only",
                help=(
                    f"remove `driver` from `{name}`, so that swarmctl drives it, or set them in its sketch",
                ),
                fix=make_fix("remove the settings", remove(context.source, loc), safe=False),
            )


@rule("SET003")
def unsuitable_drivers(context: RuleContext) -> Iterator[Diagnostic]:
    """Driver rosserial_python for a robot without rosserial firmware."""
    for name, robot in context.spec.robots.items():
        if robot.driver == "rosserial_python" and context.types[robot.type].sketch is None:
            loc = ("robots", name, "driver")
            yield Diagnostic(
                "SET003",
                f"robot `{name}` has no rosserial firmware",
                context.span(*loc),
                label=f"cannot drive a `{robot.type}`",
                help=("remove `driver`, so that swarmctl's driver is used",),
                fix=make_fix("remove it", remove(context.source, loc), safe=False),
            )


@rule("SET004", "SET005")
def camera_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """Camera settings for a robot without a camera, or for images that its camera does not support."""
    defaults, robots = context.spec.defaults.robot.camera, context.spec.robots
    cameras = {
        name: one
        for name, kind in context.types.items()
        for one in kind.sensors.values()
        if isinstance(one, Image)
    }
    if defaults.model_fields_set and not any(one.type in cameras for one in robots.values()):
        yield _no_camera(context, ("defaults", "robot", "camera"), "no robot has a camera")
    checked: set[str] = set()  # types, with the camera settings of the defaults
    for name, robot in robots.items():
        own, image = bool(robot.settings.camera.model_fields_set), cameras.get(robot.type)
        loc: Loc = ("robots", name, "settings", "camera") if own else ("defaults", "robot", "camera")
        if image is None:
            if own:
                message = f"robots of type `{robot.type}` have no camera"
                yield _no_camera(context, loc, message, f"types with a camera: {', '.join(sorted(cameras))}")
        elif own or (defaults.model_fields_set and robot.type not in checked):
            checked |= set() if own else {robot.type}
            for _, what, remedy in image.tuned(context.settings_of(name)).complaints():
                yield Diagnostic(
                    "SET005",
                    f"the camera of type `{robot.type}` does not support these images: {what}",
                    context.span(*loc, key=True),
                    label=f"for robot `{name}`",
                    help=(remedy,),
                )


def _no_camera(context: RuleContext, loc: Loc, message: str, *others: str) -> Diagnostic:
    return Diagnostic(
        "SET004",
        message,
        context.span(*loc, key=True),
        label="no camera",
        help=("; ".join(["remove it", *others]),),
        fix=make_fix("remove it", remove(context.source, loc), safe=False),
    )
