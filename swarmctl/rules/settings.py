"""Robot settings: within the robot's capabilities, and read by its driver or measured."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.any_robot_type import SWARMCTL
from swarmctl.robot_types.driver_params import rates_of
from swarmctl.robot_types.kinematics import Motion
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_launchable import PlaceholderError, filled
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.robot_types.sensors import Battery, Image
from swarmctl.robot_types.settings import Limits, RobotSettings
from swarmctl.spec.maintenance_model import NO_TERMS
from swarmctl.swarm import names
from swarmctl.swarm.resolve import maintenance_of, power_topics
from swarmctl.swarm.topics import declared_topics
from swarmctl.yamltext.edits import make_fix, remove
from swarmctl.yamltext.source import Loc


@rule("SET001")
def unreachable_limits(context: RuleContext) -> Iterator[Diagnostic]:
    """A speed limit above the maximum of the wheels: of a robot, of a type, or of all robots."""
    for name, robot in context.spec.robots.items():
        limits = robot.settings.limits
        if not limits.model_fields_set:
            continue
        for axis, found in _unreachable(limits, _reach(context.motions[robot.type]), f"type `{robot.type}`"):
            yield replace(found, span=context.span("robots", name, "settings", "limits", axis))
    for name, kind in context.document.own_types.items():
        for axis, found in _unreachable(
            kind.settings.limits, _reach(context.motions[name]), f"type `{name}`"
        ):
            yield replace(found, span=context.document.span_of_type(name, "settings", "limits", axis))
    limits = context.spec.defaults.robot.limits
    if limits.model_fields_set:
        reaches = [
            _reach(context.motions[kind]) for kind in {one.type for one in context.spec.robots.values()}
        ]
        fastest = {axis: max((one[axis] for one in reaches), default=math.inf) for axis in _AXES}
        for axis, found in _unreachable(limits, fastest, "every robot"):
            yield replace(found, span=context.span("defaults", "robot", "limits", axis))


_AXES = {"linear": "m/s", "angular": "rad/s"}


def _reach(motion: Motion) -> Mapping[str, float]:
    """The fastest that a type allows, by axis."""
    linear, _, _, angular = motion.axes
    return {"linear": linear, "angular": angular}


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


READ_BY_THE_GATE = {"battery", "command_timeout", "command_type", "limits"}  # SET010 is about `battery`
READ_BY_OUR_SKETCH = {"firmware", "calibration"}
FOR_BOARDS = {"rosserial_python"}  # drivers that speak rosserial


@rule("SET002")
def unread_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """Settings that nothing reads, because a ROS package drives the robot."""
    for name, driver in context.ros_drivers.items():
        kind, settings = context.native_robots.get(name), context.spec.robots[name].settings
        read = {"battery"} if driver.ungated else READ_BY_THE_GATE
        read |= READ_BY_OUR_SKETCH if kind is not None and kind.sketch and kind.sketch.firmware else set()
        unread = [key for key in RobotSettings.model_fields if key in settings.model_fields_set - read]
        if unread:
            yield _without_effect(context, name, driver.package, unread)


def _without_effect(context: RuleContext, robot: str, package: str, unread: Sequence[str]) -> Diagnostic:
    loc = ("robots", robot, "settings")
    every = set(unread) == context.spec.robots[robot].settings.model_fields_set
    named = " and ".join(f"`{key}`" for key in unread)
    places = [loc] if every else [(*loc, key) for key in unread]
    return Diagnostic(
        "SET002",
        f"{named} of robot `{robot}` {'has' if len(unread) == 1 else 'have'} no effect: "
        f"`{package}` drives it",
        context.span(*loc, unread[0], key=True),
        label="read by swarmctl's driver only",
        help=("remove it, or set it in the parameters of the driver",),
        fix=make_fix(f"remove {named}", *(remove(context.source, one) for one in places), safe=False),
    )


@rule("SET003")
def unsuitable_drivers(context: RuleContext) -> Iterator[Diagnostic]:
    """A driver that cannot drive robots of this type."""
    for name, robot in context.spec.robots.items():
        kind = context.native_robots.get(name)
        for_board = isinstance(robot.driver, str) and robot.driver in FOR_BOARDS
        if robot.driver == SWARMCTL and isinstance(context.types[robot.type], RosRobotType):
            message = f"the type of robot `{name}` has no protocol that swarmctl's driver knows"
            use = "remove `driver`, so that the ROS package of its type is used"
        elif for_board and (kind is None or kind.sketch is None):
            message = f"robot `{name}` has no rosserial firmware"
            use = "remove `driver`, so that the driver of its type is used"
        else:
            continue
        loc = ("robots", name, "driver")
        yield Diagnostic(
            "SET003",
            message,
            context.span(*loc),
            label=f"cannot drive a `{robot.type}`",
            help=(use,),
            fix=make_fix("remove it", remove(context.source, loc), safe=False),
        )


@rule("SET004", "SET005")
def camera_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """Camera settings for a robot without a camera, or for images that its camera does not support."""
    defaults, robots = context.spec.defaults.robot.camera, context.spec.robots
    kinds = {robots[name].type: kind for name, kind in context.native_robots.items()}
    cameras = _cameras(kinds)
    if defaults.model_fields_set and not any(one.type in cameras for one in robots.values()):
        yield _no_camera(context, ("defaults", "robot", "camera"), "no robot has a camera")
    checked: set[str] = set()  # types, with the camera settings of the defaults
    for name, robot in robots.items():
        own, image = bool(robot.settings.camera.model_fields_set), cameras.get(robot.type)
        loc: Loc = ("robots", name, "settings", "camera") if own else ("defaults", "robot", "camera")
        if image is None:
            if own:
                message = f"robots of type `{robot.type}` have no camera"
                others = ", ".join(sorted(_cameras(context.native_types)))
                yield _no_camera(context, loc, message, f"types with a camera: {others}")
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


def _cameras(types: Mapping[str, RobotType]) -> dict[str, Image]:
    return {
        name: one for name, kind in types.items() for one in kind.sensors.values() if isinstance(one, Image)
    }


def _no_camera(context: RuleContext, loc: Loc, message: str, *others: str) -> Diagnostic:
    return Diagnostic(
        "SET004",
        message,
        context.span(*loc, key=True),
        label="no camera",
        help=("; ".join(["remove it", *others]),),
        fix=make_fix("remove it", remove(context.source, loc), safe=False),
    )


@rule("SET006")
def equal_starts(context: RuleContext) -> Iterator[Diagnostic]:
    """Two robots that start at one place."""
    places: dict[tuple[float, float], list[str]] = {}
    for name, robot in context.spec.robots.items():
        if robot.start is not None:
            places.setdefault((round(robot.start.x, 2), round(robot.start.y, 2)), []).append(name)
    for (x, y), (first, *others) in places.items():
        for second in others[:1]:  # a range has hundreds at one place
            more = f" and {len(others) - 1} more" if len(others) > 1 else ""
            yield Diagnostic(
                "SET006",
                f"robots `{first}` and `{second}`{more} start at the same place",
                context.span("robots", second, "start"),
                label=f"x {x:g} m, y {y:g} m",
                notes=(Note(context.span("robots", first, "start"), "the other one"),),
                help=("give each robot the place where it stands, or leave `start` out",),
            )


def _is_gated(context: RuleContext, robot: str) -> bool:
    moves = context.motions[context.spec.robots[robot].type].kind != "none"
    return moves and not context.ros_drivers[robot].ungated


@rule("SET008")
def shared_frames(context: RuleContext) -> Iterator[Diagnostic]:
    """Two robots of one master with a start, whose drivers publish one odometry frame."""
    users: dict[tuple[str, str], list[str]] = {}
    for name, driver in context.ros_drivers.items():
        island, space = context.island_of_robot(name), context.namespaces[name][1:]
        known = {"robot": name, "namespace": space, "frame": space, "host": context.driving[name] or ""}
        started = context.spec.robots[name].start is not None and _is_gated(context, name)
        if started and island is not None:
            with suppress(PlaceholderError):  # of a link: it is another one for each robot
                users.setdefault((island.name, str(filled(driver.odometry_frame, known))), []).append(name)
    for (_, frame), (first, *others) in users.items():
        for second in others[:1]:
            more = f" and {len(others) - 1} more" if len(others) > 1 else ""
            yield Diagnostic(
                "SET008",
                f"the starts of robots `{first}` and `{second}`{more} are for one frame, `{frame}`",
                context.span("robots", second, "start"),
                label="only one of them can hold",
                notes=(Note(context.span("robots", first, "start"), "the other one"),),
                help=(
                    "pass `{frame}` to the parameter or argument of the driver that begins its frames",
                    "or write the frame that it publishes: `odom_frame` of the driver",
                ),
            )


_WHY = {
    "idle": "no driver or gate of swarmctl stands before its wheels",
    "battery": "neither swarmctl's driver nor a gate reads its battery",
    "docked": "no gate reads a topic of its driver that shows it",
}
_NOTHING = {"docked": "false"}


@rule("SET009")
def unmeasured_terms(context: RuleContext) -> Iterator[Diagnostic]:
    """A term that swarmctl does not measure on a robot."""
    found: dict[tuple[Loc, str], list[str]] = {}
    for name, robot in context.spec.robots.items():
        if context.spec.maintenance is NO_TERMS and robot.maintenance is NO_TERMS:
            continue
        wanted = maintenance_of(context.spec, name)
        battery, docked = _read_by_gate(context, name)
        measured = {
            "idle": _has_gate(context, name),
            "battery": _knows_battery(context, name),
            "docked": docked or battery,
        }
        for term in wanted.model_fields_set:
            if not measured[term]:
                own = getattr(robot.maintenance, term) is not None
                found.setdefault((("robots", name) if own else (), term), []).append(name)
    for (place, term), (first, *others) in found.items():
        more = f" and {len(others)} more" if others else ""
        loc = (*place, "maintenance", term)
        yield Diagnostic(
            "SET009",
            f"`{term}` of `maintenance` never holds for robot `{first}`{more}: {_WHY[term]}",
            context.span(*loc),
            label="is not measured",
            help=(f"remove it, or write `maintenance: {{{term}: {_NOTHING.get(term, '0')}}}` at the robot",),
        )


def _has_gate(context: RuleContext, robot: str) -> bool:
    return robot in context.driven_robots or robot in context.gated


def _read_by_gate(context: RuleContext, robot: str) -> tuple[bool, bool]:
    """Whether the gate of a robot reads its battery, and a topic that says whether it is docked."""
    if robot not in context.gated:
        return False, False
    node = names.driver_node(context.namespaces[robot])
    battery, docked = power_topics(declared_topics(context.ros_drivers[robot], node))
    return battery is not None, docked is not None


def _knows_battery(context: RuleContext, robot: str) -> bool:
    return _read_by_gate(context, robot)[0] or _reads_battery(context, robot)


def _reads_battery(context: RuleContext, robot: str) -> bool:
    kind = context.driven_robots.get(robot)
    if kind is None or kind.driver_protocol is None:
        return False
    rates = rates_of(kind, context.settings_of(robot))
    return any(isinstance(one, Battery) and rates[name] > 0 for name, one in kind.sensors.items())


@rule("SET010")
def unread_battery_limits(context: RuleContext) -> Iterator[Diagnostic]:
    """Limits of a battery that swarmctl does not read: of a robot, of its type, or of all robots."""
    robots = context.spec.robots
    unread = [one for one in robots if context.settings_of(one).battery and not _knows_battery(context, one)]
    everywhere: Loc = ("defaults", "robot", "battery")
    if context.spec.defaults.robot.battery and len(unread) == len(robots):
        yield _unread_battery(context, everywhere, "no robot has a battery that swarmctl reads")
    for name in unread:
        own = robots[name].settings.battery is not None
        of_type = context.document.settings_layers(name)[1].battery is not None
        if own or of_type:
            loc: Loc = ("robots", name, "settings", "battery") if own else ("robots", name)
            yield _unread_battery(context, loc, f"the limits of the battery of robot `{name}` never apply")


def _unread_battery(context: RuleContext, loc: Loc, message: str) -> Diagnostic:
    return Diagnostic(
        "SET010",
        message,
        context.span(*loc, key=True),
        label=_WHY["battery"],
        help=(
            "read its sensor at a rate above 0",
            "or add its topic of type sensor_msgs/BatteryState to `publishes` of the driver",
            "or take the limits out, of the spec or of its type",
        ),
    )
