"""ROS packages that drive robots: their placeholders, and what roslaunch makes of their texts."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.links.ip_link import IpLink
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.placeholders import meanings, placeholders_in
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.yamltext.source import Loc

_PORTS = {"link_port": "port", "uri": "port", "local_port": "local_ports", "local_port_2": "local_ports"}


@rule("DRIVER001")
def unavailable_placeholders(context: RuleContext) -> Iterator[Diagnostic]:
    """A placeholder of a driver's text that the robot's link does not give."""
    for name, driver in context.ros_drivers.items():
        if not any(placeholders_in(value) for _, value in driver.texts) or _lacks_its_link(context, name):
            continue
        known = context.placeholders_of(name)
        for loc, value in driver.texts:
            missing = next((one for one in placeholders_in(value) if one not in known), None)
            if missing is not None:
                yield _unavailable(context, name, loc, missing, known)


def _lacks_its_link(context: RuleContext, robot: str) -> bool:
    """True if the robot has no link of a kind that its type takes; LINK001 and LINK007 report it."""
    link, kinds = context.line_of(robot), context.link_kinds(robot)
    return bool(kinds) and (link is None or link.kind not in kinds)


def _unavailable(
    context: RuleContext, robot: str, loc: Loc, missing: str, known: tuple[str, ...]
) -> Diagnostic:
    kinds = context.link_kinds(robot)
    given = context.line_of(robot)
    if given is None:
        link = f"connect it by a {' or '.join(kinds)} link" if kinds else "add a link that has it"
    elif missing in _PORTS and isinstance(given, IpLink):
        link = f"write `{_PORTS[missing]}` in the link of `{robot}`"
    else:
        link = f"a {given.kind} link has none"
    place = Note(context.span("robots", robot, key=True), f"robot `{robot}`")
    span = _span(context, robot, *loc)
    return Diagnostic(
        "DRIVER001",
        f"`{{{missing}}}` is not available for robot `{robot}`: it is {meanings()[missing]}",
        span,
        label="no such link" if given is None or not isinstance(given, IpLink) else "its link has none",
        notes=(place,) if span != place.span else (),
        help=(f"{link}, or use one of {', '.join(f'{{{one}}}' for one in known)}",),
    )


def _span(context: RuleContext, robot: str, *loc: str | int) -> Span:
    """Returns the place of a value of a robot's driver: of its own, else of its type's, else the robot's."""
    given = context.spec.robots[robot]
    if isinstance(given.driver, RosDriver):
        return context.span("robots", robot, "driver", *loc)
    if given.driver is None and given.type in context.document.own_types:
        return context.document.span_of_type(given.type, "driver", *loc)
    return context.span("robots", robot, key=True)


@rule("DRIVER002", needs="launch-xml")
def substitutions(context: RuleContext) -> Iterator[Diagnostic]:
    """`$(...)` in a driver's text that roslaunch evaluates; it cannot be escaped."""
    for name, driver in context.ros_drivers.items():
        for loc, value in driver.texts:
            if loc[0] != "params" and isinstance(value, str) and "$(" in value:
                yield Diagnostic(
                    "DRIVER002",
                    f"roslaunch would evaluate the `$(` in `{loc[1]}` of the driver of robot `{name}`",
                    _span(context, name, *loc),
                    label="cannot be escaped",
                    help=("write the resulting value", "or set it in a launch file of your package"),
                )
