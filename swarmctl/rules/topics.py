"""Declared topics: one type per topic, not shared by robots, and with somebody at the other end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from swarmctl.diagnostics import Diagnostic, Note, Span, note_of_other
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.driver_params import rates_of
from swarmctl.robot_types.protocols import RosserialProtocol
from swarmctl.robot_types.ros_driver import VELOCITIES, RosDriver
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.ros_packages.message_types import NoMessage, no_message
from swarmctl.rules.bridges import crossings
from swarmctl.suggest import is_near, nearest, typing_errors
from swarmctl.swarm.command_topics import COMMAND
from swarmctl.swarm.topics import (
    JOINTS,
    Endpoint,
    sensor_behind,
)
from swarmctl.yamltext.edits import make_fix, replace_value
from swarmctl.yamltext.source import Loc

_IN_ROS_1 = {
    "builtin_interfaces/Time": "std_msgs/Time",
    "builtin_interfaces/Duration": "std_msgs/Duration",
    "rcl_interfaces/Log": "rosgraph_msgs/Log",
}
_IN_ROS_2 = {old: new for new, old in _IN_ROS_1.items()} | {"tf/tfMessage": "tf2_msgs/TFMessage"}


@rule("TOPIC001")
def clashing_types(context: RuleContext) -> Iterator[Diagnostic]:
    """One topic with two message types."""
    first: dict[tuple[str, str], Endpoint] = {}
    reached, common = bridged(context), context.common_topics
    for one in sorted(context.endpoints, key=lambda one: not one.publishes):
        if one.topic in common and not context.connect(common[one.topic], one.type):
            yield _clash(context, one, common[one.topic], "ROS itself", None)
        elif (driven := _of_a_driver(context, one.topic)) is not None and not context.connect(
            driven[1], one.type
        ):
            robot, kind = driven
            yield _clash(context, one, kind, f"the driver of `{robot}`", ("robots", robot))
        elif one.topic not in common and driven is None:
            home = context.home.get(one.host)
            islands = {home.name} if home else set()
            for island in islands | (reached.get(one.topic, set()) if islands else set()):
                earlier = first.setdefault((island, one.topic), one)
                if not context.connect(earlier.type, one.type):
                    yield _clash(context, one, earlier.type, f"program `{earlier.owner}`", earlier.loc)
                    break


def bridged(context: RuleContext) -> Mapping[str, set[str]]:
    """Returns by topic the islands between which it is bridged."""
    found: dict[str, set[str]] = {}
    for bridge in context.bridges if context.endpoints else ():
        found.setdefault(bridge.topic, set()).update((bridge.origin, *bridge.to))
    return found


def _of_a_driver(context: RuleContext, topic: str) -> tuple[str, str] | None:
    """Returns the robot whose driver has ``topic``, and its message type."""
    robots = context.robots_by_command.get(topic)
    if robots:
        return robots[0], context.command_topics[robots[0]].type
    return context.publishers.sensed(topic)


def _clash(context: RuleContext, one: Endpoint, other: str, who: str, where: Loc | None) -> Diagnostic:
    loc = (*one.loc, "type")
    shown = "; `rostopic type` shows it on a running system" if context.has_masters else ""
    is_program = where is not None and where[0] == "programs"
    notes = () if where is None else (
        Note(context.span(*where, "type"), "the other type")
        if is_program
        else Note(context.span(*where, key=True), f"its driver uses {other}"),
    )  # fmt: skip
    return Diagnostic(
        "TOPIC001",
        f"`{one.topic}` has type {one.type} in program `{one.owner}`, and {other} in {who}",
        context.span(*loc),
        label="another type",
        notes=notes,
        help=(
            f"write the type that the node uses{shown}",
            *(() if is_program else (_otherwise(context, one),)),
        ),
        fix=None
        if is_program or not is_near(one.type, other)
        else make_fix(f"write `{other}`", replace_value(context.source, loc, other), safe=False),
    )


def _otherwise(context: RuleContext, one: Endpoint) -> str:
    """What to do about a node that does use another type than the driver of a robot, or ROS itself."""
    for robot in context.robots_by_command.get(one.topic, ()):
        if one.type in VELOCITIES and (robot in context.driven_robots or robot in context.gated):
            key = f"`settings: {{command_type: {one.type}}}`"
            return f"if all nodes on this topic use {one.type}, write {key} at robot `{robot}`"
    return f"if it uses {one.type}, it cannot use this topic: choose another"


@rule("TOPIC003")
def sensors_off(context: RuleContext) -> Iterator[Diagnostic]:
    """A subscription to a sensor that is turned off, or a bridge for it."""
    wanted: list[tuple[str, Loc, str]] = [
        (one.topic, (*one.loc, "topic"), f"program `{one.owner}` subscribes to")
        for one in context.endpoints
        if not one.publishes
    ]
    wanted += [(one.topic, (*loc, "topic"), "`multimaster` bridges") for loc, one in crossings(context)]
    for topic, loc, verb in wanted:
        driven = _of_a_driver(context, topic)
        sensor = sensor_behind(context.split_topic(topic)[1])
        if driven is None or topic in context.robots_by_command:
            continue
        if topic in context.publishers.programs:
            continue
        robot = context.spec.robots[driven[0]]
        kind = context.driven_robots.get(driven[0])
        if kind is None or kind.sketch is not None:  # its topics are declared
            continue
        if rates_of(kind, *context.document.settings_layers(driven[0]))[sensor] > 0:
            continue
        off = robot.settings.rates.get(sensor) == 0
        yield Diagnostic(
            "TOPIC003",
            f"{verb} `{topic}`, which robot `{driven[0]}` does not publish",
            context.span(*loc),
            label="sensor is off",
            notes=(Note(context.span("robots", driven[0], "settings", "rates", sensor), "rate 0"),)
            if off
            else (Note(context.span("robots", driven[0], key=True), "this robot"),),
            help=(f"set a rate: settings: {{rates: {{{sensor}: 10.0}}}}",),
        )


@rule("TOPIC004")
def shared_topics(context: RuleContext) -> Iterator[Diagnostic]:
    """Programs of several robots publish one topic, so subscribers receive a mixture."""
    first: dict[tuple[str, str], Endpoint] = {}
    robots = {name: program.robot for name, program in context.spec.programs.items()}
    reached, common = bridged(context), context.common_topics
    for one in context.endpoints:
        robot, home = robots[one.owner], context.home.get(one.host)
        if not one.publishes or robot is None or home is None or one.topic in common:
            continue
        for island in {home.name} | reached.get(one.topic, set()):
            earlier = first.setdefault((island, one.topic), one)
            if robots[earlier.owner] != robot:
                yield Diagnostic(
                    "TOPIC004",
                    f"programs of robots `{robots[earlier.owner]}` and `{robot}` both publish `{one.topic}`",
                    context.span(*one.loc, "topic"),
                    label="mixed with the other robot's",
                    notes=(
                        Note(context.span(*earlier.loc, "topic"), f"published for `{robots[earlier.owner]}`"),
                    ),
                    help=("remove the leading `/`, so that each robot has its own topic in its namespace",),
                )
                break


@rule("TOPIC005")
def commands_without_robot(context: RuleContext) -> Iterator[Diagnostic]:
    """Velocity commands on a topic that no robot and no program subscribes to."""
    subscribed = {one.topic for one in context.endpoints if not one.publishes}
    for one in context.endpoints:
        space, _, name = one.topic.rpartition("/")
        robots = context.robot_by_namespace
        taken = one.topic in context.robots_by_command or one.topic in subscribed
        if not one.publishes or name != COMMAND or taken:
            continue
        if space in robots:
            yield _other_command_topic(context, one, robots[space])
            continue
        near = nearest(space.strip("/"), tuple(other.strip("/") for other in robots)) if space else None
        written = context.spec.programs[one.owner]
        own = context.namespaces[written.robot] if written.robot is not None else next(iter(robots))
        meant = f"/{near}/{COMMAND}" if near else f"{own}/{COMMAND}"
        loc = (*one.loc, "topic")
        as_is = not written.remap and one.topic == _written(one, context)
        yield Diagnostic(
            "TOPIC005",
            f"program `{one.owner}` publishes commands to `{one.topic}`, which no robot subscribes to",
            context.span(*loc),
            label="each robot has its own command topic",
            help=(f"did you mean `{meant}`?",)
            if near
            else (f"remap it, for example remap: {{{COMMAND}: {meant}}}",),
            fix=make_fix(f"write `{meant}`", replace_value(context.source, loc, meant), safe=False)
            if near and as_is
            else None,
        )


def _other_command_topic(context: RuleContext, one: Endpoint, robot: str) -> Diagnostic:
    """Commands in the namespace of a robot that takes them elsewhere, or takes none."""
    command = context.command_topics.get(robot)
    return Diagnostic(
        "TOPIC005",
        f"program `{one.owner}` publishes commands to `{one.topic}`, which no robot subscribes to",
        context.span(*one.loc, "topic"),
        label="each robot has its own command topic",
        notes=(Note(context.span("robots", robot, key=True), f"robot `{robot}`"),),
        help=(f"`{robot}` takes {command.type} on `{command.topic}`; publish that, or remap to it",)
        if command is not None
        else (f"`{robot}` takes no commands: its kinematics is `none`",),
    )


def _written(one: Endpoint, context: RuleContext) -> str:
    """Returns the topic name of an endpoint as written in the spec."""
    topics = getattr(context.spec.programs[one.owner], "publishes" if one.publishes else "subscribes")
    return str(topics[one.loc[-1]].topic)


_PUBLISH, _SUBSCRIBE = "publish", "take commands from"


@dataclass(frozen=True)
class _End:
    """A driver or a program that publishes a topic, or a driver that takes commands from it."""

    topic: str
    verb: str
    owner: str
    host: str | None
    span: Span
    where: str = ""  # in a launch file


@rule("TOPIC011", needs="master")
def absolute_topics(context: RuleContext) -> Iterator[Diagnostic]:
    """The drivers of two robots, or a driver and a program, have one absolute topic in one graph."""
    ends = [*_declared_ends(context), *_launched_ends(context)] if context.ros_drivers else []
    topics = {one.topic for one in ends}
    ends += _ends_of_programs(context, topics) if topics else ()
    first: dict[tuple[str, str, str], _End] = {}
    reached = bridged(context) if ends else {}
    for one in ends:
        home = context.home.get(one.host or "")
        for island in {home.name} | reached.get(one.topic, set()) if home is not None else ():
            earlier = first.setdefault((island, one.topic, one.verb), one)
            if earlier.owner == one.owner or earlier.owner.startswith("program"):
                continue
            name = one.topic.rpartition("/")[2]
            yield Diagnostic(
                "TOPIC011",
                f"{earlier.owner} and {one.owner} both {one.verb} `{one.topic}`{one.where}",
                one.span,
                label="an absolute name does not follow the namespace",
                notes=note_of_other(earlier.span, one.span),
                help=("remove the leading `/` there, so that each robot has its own topic",)
                if one.where
                else (f"move it into the namespace: remap: {{{one.topic}: {name}}}",),
            )
            break


def _declared_ends(context: RuleContext) -> Iterator[_End]:
    """What drivers that are ROS packages have outside of their namespace, as the spec declares."""
    for robot in context.ros_drivers:
        host, owner = context.driving[robot], f"the driver of robot `{robot}`"
        key = "driver" if context.spec.robots[robot].driver is not None else "type"
        span = context.span("robots", robot, key)
        for one in context.driver_topics(robot):
            if one.name.startswith("/") and _has_one_source(context, one.name):
                yield _End(one.name, _PUBLISH, owner, host, span)
        command = context.command_topics.get(robot)
        if command is not None and robot not in context.gated and _is_outside(context, command.topic):
            yield _End(command.topic, _SUBSCRIBE, owner, host, span)


def _launched_ends(context: RuleContext) -> Iterator[_End]:
    """What the launch files of drivers remap out of the robot's namespace."""
    for use in (one for one in context.launches if one.is_driver):
        declared = {one.topic.rpartition("/")[2] for one in context.ros_drivers[use.name].publishes}
        for node in use.launched.nodes:
            for old, new in node.remaps if node.certain else ():
                name = old.rpartition("/")[2]
                if name not in {COMMAND, *declared} or not _has_one_source(context, new):
                    continue
                if new.startswith("/") and _is_outside(context, new):
                    verb = _SUBSCRIBE if name == COMMAND else _PUBLISH
                    span = context.launch_span(use, "launch")
                    yield _End(new, verb, use.owner, use.host, span, f" ({node.place})")


def _ends_of_programs(context: RuleContext, topics: set[str]) -> Iterator[_End]:
    for one in context.endpoints:
        if one.publishes and one.topic in topics:
            owner, span = f"program `{one.owner}`", context.span(*one.loc, "topic")
            yield _End(one.topic, _PUBLISH, owner, one.host, span)


def _is_outside(context: RuleContext, topic: str) -> bool:
    return context.split_topic(topic)[0] not in context.robot_by_namespace


def _has_one_source(context: RuleContext, topic: str) -> bool:
    """False for what several nodes publish by custom: /tf, /diagnostics, /joint_states."""
    return topic not in context.common_topics and topic != f"/{JOINTS}"


@rule("TOPIC007", "TOPIC010", needs="catkin")
def message_types(context: RuleContext) -> Iterator[Diagnostic]:
    """A message type that its package does not have, or whose package looks misspelt."""
    faults: dict[str, NoMessage | None] = {}
    for loc, kind in _declared(context):
        if kind not in faults:
            faults[kind] = no_message(kind, context.messages)
        if (fault := faults[kind]) is not None:
            yield _finding(context, loc, kind, fault)


@rule("TOPIC007", by_distro=True)
def messages_of_the_other_ros(context: RuleContext) -> Iterator[Diagnostic]:
    """A message type that only the other ROS has."""
    ros, other, names = (1, 2, _IN_ROS_1) if context.can("ros1-nodes") else (2, 1, _IN_ROS_2)
    for loc, kind in _declared(context) if ros == 1 or context.can("domains") else ():
        if kind in names and kind.partition("/")[0] not in context.document.packages.by_name:
            yield Diagnostic(
                "TOPIC007",
                f"ROS {ros} has no message type `{kind}`",
                context.span(*loc),
                label=f"of ROS {other}",
                help=(f"write `{names[kind]}`",),
                fix=make_fix(
                    f"write `{names[kind]}`", replace_value(context.source, loc, names[kind]), safe=False
                ),
            )
        elif ros == 2 and kind in context.messages.services:  # the rule above knows the messages of ROS 1
            fault = no_message(kind, context.messages)
            yield from [_finding(context, loc, kind, fault)] if fault is not None else []


def _declared(context: RuleContext) -> Iterator[tuple[Loc, str]]:
    for name, program in context.spec.programs.items():
        for key in ("publishes", "subscribes"):
            for index, topic in enumerate(getattr(program, key)):
                yield ("programs", name, key, index, "type"), topic.type
    for loc, declared in of_robots(context):
        for key in ("publishes", "subscribes"):
            for index, topic in enumerate(getattr(declared, key)):
                yield (*loc, key, index, "type"), topic.type


def of_robots(context: RuleContext) -> Iterator[tuple[Loc, RosserialProtocol | RosDriver]]:
    """The sketches and drivers of the spec's own types and robots."""
    for name, robot_type in context.spec.types.items():
        if isinstance(robot_type, RosRobotType):
            for driver in robot_type.drivers:
                yield ("types", name, *robot_type.place_of(driver)), driver
        elif robot_type.sketch is not None:
            yield ("types", name, "protocol"), robot_type.sketch
    for name, robot in context.spec.robots.items():
        if isinstance(robot.driver, RosDriver):
            yield ("robots", name, "driver"), robot.driver


def _finding(context: RuleContext, loc: Loc, kind: str, fault: NoMessage) -> Diagnostic:
    meant = fault.meant[0] if fault.meant else None
    return Diagnostic(
        "TOPIC007" if fault.certain else "TOPIC010",
        f"there is no message type `{kind}`: {fault.why}" if fault.certain
        else f"`{kind}` looks misspelt: {fault.why}",
        context.span(*loc),
        label="unknown message type",
        help=(f"did you mean {' or '.join(f'`{one}`' for one in fault.meant[:3])}?",)
        if meant
        else ("`rosmsg package PACKAGE` lists the messages of a package",),
        fix=make_fix(
            f"write `{meant}`",
            replace_value(context.source, loc, meant),
            safe=fault.certain and typing_errors(kind, meant) <= 1,
        )
        if meant and len(fault.meant) == 1
        else None,
    )  # fmt: skip
