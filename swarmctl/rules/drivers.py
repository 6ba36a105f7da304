"""ROS packages that drive robots: their placeholders, and what roslaunch makes of their texts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import NamedTuple

from swarmctl.diagnostics import Diagnostic, Note, Span, note_of_other
from swarmctl.links.ip_link import IpLink, Tcp
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_launchable import PlaceholderError, filled, meanings, placeholders_in
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.rules.topics import bridged
from swarmctl.swarm.names import driver_node, resolved
from swarmctl.yamltext import edits
from swarmctl.yamltext.source import Loc

# Values that a person may write in a link, with the placeholders by which a driver gets them.
_VALUES = {
    "port": ("link_port", "uri"),
    "local_ports": ("local_port", "local_port_2", "uri"),
    "baud": ("baud", "uri"),
    "system_id": ("system_id",),
}


@rule("DRIVER001")
def unavailable_placeholders(context: RuleContext) -> Iterator[Diagnostic]:
    """A placeholder of a driver's text that the robot's link does not give."""
    for name, driver in context.ros_drivers.items():
        if next(driver.placeholders, None) is None or _lacks_its_link(context, name):
            continue
        known, missing = context.placeholders_of(name), dict[Loc, str]()
        for loc, one in driver.placeholders:
            if one not in known:
                missing.setdefault(loc, one)  # one finding for a text
        yield from (_unavailable(context, name, loc, one, known) for loc, one in missing.items())


def _lacks_its_link(context: RuleContext, robot: str) -> bool:
    """True if the robot has no link of a kind that its type takes; LINK001 and LINK007 report it."""
    link, kinds = context.line_of(robot), context.link_kinds(robot)
    return bool(kinds) and (link is None or link.kind not in kinds)


def _unavailable(
    context: RuleContext, robot: str, loc: Loc, missing: str, known: Iterable[str]
) -> Diagnostic:
    kinds = context.link_kinds(robot)
    given = context.line_of(robot)
    if given is None:
        link = f"connect it by a {' or '.join(kinds)} link" if kinds else "add a link that has it"
    elif isinstance(given, IpLink) and (keys := [key for key, used in _VALUES.items() if missing in used]):
        link = f"write `{keys[0]}` in the link of `{robot}`"
    else:
        link = f"a {given.kind} link has none"
    place = Note(context.span("robots", robot, key=True), f"robot `{robot}`")
    span = place_of_driver(context, robot, *loc)
    return Diagnostic(
        "DRIVER001",
        f"`{{{missing}}}` is not available for robot `{robot}`: it is {meanings()[missing]}",
        span,
        label="no such link" if given is None or not isinstance(given, IpLink) else "its link has none",
        notes=(place,) if span != place.span else (),
        help=(f"{link}, or use one of {', '.join(f'{{{one}}}' for one in known)}",),
    )


@rule("DRIVER005")
def unused_values(context: RuleContext) -> Iterator[Diagnostic]:
    """A value in a link that nothing uses: no text of the robot's driver has a placeholder for it."""
    for index, link in context.lines:
        given = link.model_fields_set & _VALUES.keys()
        driver = context.ros_drivers.get(link.robot)
        if not isinstance(link, IpLink) and (not given or (driver is None and given == {"baud"})):
            continue
        if (driver is None and link.robot not in context.driven_robots) or _lacks_its_link(
            context, link.robot
        ):
            continue
        used = {"baud"}  # by swarmctl's driver
        if driver is not None:
            used = {one for _, one in driver.placeholders}
        for key, placeholders in _VALUES.items():
            if key not in given or not getattr(link, key):  # an empty list: it has none
                continue
            giving = [one for one in placeholders if one in link.placeholders]
            if isinstance(link, Tcp) and key == "local_ports":
                giving.remove("uri")
            if giving and used.isdisjoint(giving):
                yield _unused(context, ("links", index, key), link.robot, giving)
        if isinstance(link, IpLink) and link.host_address and not (driver is not None and driver.peer):
            yield _unused(context, ("links", index, "host_address"), link.robot, [])


def _unused(context: RuleContext, loc: Loc, robot: str, giving: list[str]) -> Diagnostic:
    driver = context.ros_drivers.get(robot)
    texts = " or ".join(f"`{{{one}}}`" for one in giving)
    return Diagnostic(
        "DRIVER005",
        f"`{loc[-1]}` in the link of `{robot}` has no effect: its driver"
        f"{'' if driver is None else f', `{driver.package}`,'} does not use it",
        context.span(*loc),
        label="used by nothing",
        notes=(Note(context.span("robots", robot, key=True), "the robot"),),
        help=(f"remove it, or write {texts} in `params` or `args` of the driver",)
        if driver and texts
        else (),
        fix=edits.make_fix("remove it", edits.remove(context.source, loc), safe=False),
    )


def place_of_driver(context: RuleContext, robot: str, *loc: str | int) -> Span:
    """Returns the place of a value of a robot's driver: of its own, else of its type's, else the robot's."""
    given = context.spec.robots[robot]
    if isinstance(given.driver, RosDriver):
        return context.span("robots", robot, "driver", *loc)
    kind = context.document.own_types.get(given.type)
    if given.driver is None and isinstance(kind, RosRobotType):
        return context.document.span_of_type(given.type, *kind.place_of(context.ros_drivers[robot]), *loc)
    return context.span("robots", robot, key=True)


@rule("DRIVER002", needs="launched")
def substitutions(context: RuleContext) -> Iterator[Diagnostic]:
    """`$(...)` in a driver's text that a launch file evaluates; it cannot be escaped."""
    for name, driver in context.ros_drivers.items():
        if driver.launch is None and not context.launches_executables:
            continue
        for loc, value in driver.texts:
            if loc[0] != "params" and isinstance(value, str) and "$(" in value:
                place = f"`{loc[1]}` of the driver of robot `{name}`"
                yield Diagnostic(
                    "DRIVER002",
                    f"{context.middleware.launcher} would evaluate the `$(` in {place}",
                    place_of_driver(context, name, *loc),
                    label="cannot be escaped",
                    help=("write the resulting value", "or set it in a launch file of your package"),
                )


@rule("DRIVER004")
def drivers_of_other_distros(context: RuleContext) -> Iterator[Diagnostic]:
    """A driver that does not exist for the ROS distribution of the swarm."""
    for name, driver in context.ros_drivers.items():
        distro = context.distro_of_host(context.driving[name])
        if driver.is_for(distro):
            continue
        robot = context.spec.robots[name]
        kind = context.types[robot.type]
        drivers = kind.drivers if robot.driver is None and isinstance(kind, RosRobotType) else (driver,)
        others = " and ".join(f"`{one}`" for each in drivers for one in each.distros)
        yield Diagnostic(
            "DRIVER004",
            f"`{driver.package}`, the driver of robot `{name}`, is not for `{distro}`",
            place_of_driver(context, name),
            label=f"for {others}",
            notes=tuple(Note(context.span(*loc), "the distribution") for loc in _distro_loc(context, name)),
            help=(
                "remove `driver`, so that swarmctl's own drives the robot"
                if name in context.native_robots
                else f"write a `driver` of the robot with a package for `{distro}`",
            ),
        )


def _distro_loc(context: RuleContext, robot: str) -> Iterator[Loc]:
    """Where the spec sets the ROS distribution of a robot's host; nothing if it does not."""
    home = context.home.get(context.driving[robot] or "")
    islands = context.spec.islands
    if home is not None and home.name in islands and islands[home.name].distro is not None:
        yield "islands", home.name, "distro"
    elif "distro" in context.spec.ros.model_fields_set:
        yield "ros", "distro"


class _Transform(NamedTuple):
    """The transform that the driver of a robot publishes."""

    robot: str
    odom: str
    base: str


@rule("DRIVER003")
def shared_transforms(context: RuleContext) -> Iterator[Diagnostic]:
    """The drivers of two robots of one master publish a transform to one frame."""
    found: dict[tuple[str, str, str], list[_Transform]] = {}
    shared: dict[int, tuple[str, str] | None] = {}  # robots of a type share its driver
    joined = bridged(context) if context.ros_drivers else {}
    for name, driver in context.ros_drivers.items():
        if id(driver) not in shared:
            shared[id(driver)] = _shared_frames(driver)
        frames = shared[id(driver)]
        home = context.island_of_robot(name) if frames is not None else None
        if home is None or frames is None:
            continue
        odom, base = (_filled(context, name, one) for one in frames)
        topic = resolved("/tf", driver_node(context.namespaces[name]), driver.remap)
        islands = joined.get(topic, ())
        for island in islands if home.name in islands else {home.name}:
            found.setdefault((island, topic, base), []).append(_Transform(name, odom, base))
    groups = {tuple(one.robot for one in group): group for group in found.values() if len(group) > 1}
    yield from (_shared_transform(context, group) for group in groups.values())


def _shared_frames(driver: RosDriver) -> tuple[str, str] | None:
    """Returns the frames of a driver's transform, unless each robot has a base frame of its own."""
    frames = driver.transform
    return frames if frames is not None and set(placeholders_in(frames[1])) <= {"host"} else None


def _filled(context: RuleContext, robot: str, frame: str) -> str:
    space = context.namespaces[robot][1:]
    known = {"robot": robot, "namespace": space, "frame": space, "host": context.driving[robot] or ""}
    with suppress(PlaceholderError):  # of a link
        return str(filled(frame, known))
    return frame


def _shared_transform(context: RuleContext, group: list[_Transform]) -> Diagnostic:
    first, second = group[:2]
    span, other = (place_of_driver(context, one.robot) for one in (second, first))
    shared = "master" if context.has_masters else "island"
    parents = {one.odom for one in group}
    what = f"one transform, `{first.odom}` to" if len(parents) == 1 else "transforms to one frame,"
    return Diagnostic(
        "DRIVER003",
        f"the drivers of {len(group)} robots of one {shared} publish {what} `{first.base}`",
        span,
        label=f"that of `{second.robot}`, as that of `{first.robot}`",
        notes=note_of_other(other, span),
        help=(
            "begin both frames of the driver with `{frame}/`, by its params or args",
            "or turn its transform off, as args: {kobuki_publish_tf: false} does",
            "or write `remap: {/tf: tf}` in the driver: each robot then has a topic of its own",
        ),
    )
