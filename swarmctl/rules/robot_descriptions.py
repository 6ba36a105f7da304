"""URDFs beside a spec: ROS reads them, and their frames fit the robots that have them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_driver import BASE_FRAME
from swarmctl.robot_types.sensors import Image, Range
from swarmctl.ros_packages.urdf import Fault, Place, Urdf, UrdfError, UrdfTooLargeError
from swarmctl.ros_packages.xml_tags import MAX_DEPTH, MAX_NAME, MAX_TAGS

_BASE = "base_link"


@dataclass(frozen=True)
class _Use:
    """A URDF where the spec names it, with the robots that it is of."""

    path: str
    span: Span
    robots: tuple[str, ...]

    def at(self, place: Place) -> str:
        return f"{self.path}:{place.line}:{place.column}"

    @property
    def owner(self) -> str:
        return f"the URDF of robot `{self.robots[0]}`" if len(self.robots) == 1 else "the URDF of its type"


def _uses(context: RuleContext) -> Iterator[_Use]:
    """Yields each place that names a URDF, also in the type of no robot."""
    spec, paths = context.spec, context.urdfs.paths
    for name, robot in spec.robots.items():
        if robot.urdf is not None:
            yield _Use(robot.urdf, context.span("robots", name, "urdf"), (name,))
    for name, one in context.document.own_types.items():
        if one.urdf is not None:
            of_type = (robot for robot, given in spec.robots.items() if given.type == name)
            robots = tuple(robot for robot in of_type if spec.robots[robot].urdf is None and robot in paths)
            yield _Use(one.urdf, context.document.span_of_type(name, "urdf"), robots)


def _valid(context: RuleContext) -> Iterator[tuple[_Use, Urdf]]:
    """Yields the uses by robots whose URDF has one root."""
    for use in _uses(context):
        found = context.urdfs.read.get(use.path) if use.robots else None
        if isinstance(found, Urdf) and not found.faults:
            yield use, found


@rule("URDF001")
def found(context: RuleContext) -> Iterator[Diagnostic]:
    """A file that does not lie beside the spec, or cannot be read."""
    refused = context.document.files.refused
    for use in _uses(context) if refused else ():
        if use.path in refused:
            yield Diagnostic(
                "URDF001",
                f"`{use.path}` {refused[use.path]}",
                use.span,
                label="the URDF of a robot",
                help=("write its path from the folder of the spec",),
            )


@rule("URDF002", "URDF003")
def readable(context: RuleContext) -> Iterator[Diagnostic]:
    """A file that is not a URDF, or whose links and joints are no tree."""
    for use in _uses(context):
        match context.urdfs.read.get(use.path):
            case UrdfTooLargeError(fault=fault):
                yield Diagnostic(
                    "URDF002",
                    f"{use.at(fault.place)} cannot be checked: {fault.text}",
                    use.span,
                    label="the URDF of a robot",
                    help=(
                        f"the limits: {MAX_TAGS} elements, {MAX_DEPTH} levels, names of {MAX_NAME} letters",
                    ),
                )
            case UrdfError(fault=fault):
                yield _faulty("URDF002", use, fault)
            case Urdf(faults=faults):
                yield from (_faulty("URDF003", use, one) for one in faults)


def _faulty(code: str, use: _Use, fault: Fault) -> Diagnostic:
    stem = use.path.removesuffix(".xacro").removesuffix(".urdf")
    target = f"{stem}.urdf" if f"{stem}.urdf" != use.path else f"{stem}.plain.urdf"
    converts = f"convert it: `xacro {use.path} > {target}`, and name that file"
    repair = converts if fault.repair == "xacro" else fault.repair
    return Diagnostic(
        code,
        f"{use.at(fault.place)} is not a URDF: {fault.text}",
        use.span,
        label="robot_state_publisher refuses it",
        help=(repair or f"`check_urdf {use.path}` shows what ROS reads",),
    )


@rule("URDF005", needs="ros1-nodes")
def frames(context: RuleContext) -> Iterator[Diagnostic]:
    """Links that do not fit the frames of the driver."""
    for use, urdf in _valid(context):
        for robot in use.robots:
            if (problem := _misfit(context, robot, urdf)) is not None:
                yield _unfit("URDF005", use, *problem)
                break


def _unfit(code: str, use: _Use, message: str, place: Place, repair: str) -> Diagnostic:
    """The finding about a place in a URDF that does not fit its robots."""
    return Diagnostic(code, f"{use.at(place)}: {message}", use.span, label=use.owner, help=(repair,))


def _misfit(context: RuleContext, robot: str, urdf: Urdf) -> tuple[str, Place, str] | None:
    """What is wrong with the frames of a robot, where, and how to repair it."""
    kind, first = context.driven_robots.get(robot), urdf.links[urdf.root]
    base = _BASE if kind is not None else _base_frame(context, robot)
    if base is None:
        return None
    who = "swarmctl's driver" if kind is not None else "its driver"
    if base not in urdf.links:
        return (
            f"it has no link `{base}`, whose pose {who} publishes",
            first,
            f"call its root `{base}`: it is `{urdf.root}` now",
        )
    if base != urdf.root:
        return (
            f"`{base}` is below `{urdf.root}`, and {who} publishes its pose: a frame has one parent",
            urdf.links[base],
            f"make `{base}` the root: turn the joint to `{urdf.root}` round, or remove that link",
        )
    own = next((one for one in _sensor_frames(kind) if one in urdf.links), None) if kind is not None else None
    if own is not None:
        return (
            f"swarmctl's driver publishes the frame of the sensor `{own}` as well: a frame has one parent",
            urdf.links[own],
            "remove that link and its joint, or give it another name",
        )
    return None


def _base_frame(context: RuleContext, robot: str) -> str | None:
    """The base frame that a robot's ROS package is given, without its prefix; None if it is not known."""
    for loc, text in context.ros_drivers[robot].texts:
        if len(loc) == 2 and BASE_FRAME.fullmatch(str(loc[1])):
            frame = text.rpartition("/")[2]
            return frame if frame and "{" not in frame else None
    return None


def _sensor_frames(kind: RobotType) -> Iterator[str]:
    for name, sensor in kind.sensors.items():
        if isinstance(sensor, Range):
            yield from (f"{name}_{one.name}" for one in sensor.elements)
        elif isinstance(sensor, Image):
            yield f"{name}_optical"
