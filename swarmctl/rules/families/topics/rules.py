"""Declared topics: one type per topic, not shared by robots, and with somebody at the other end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.robot_types.effective_settings import rates_of
from swarmctl.rules.context import RuleContext, rule
from swarmctl.suggest import is_near, nearest
from swarmctl.swarm.command_topics import COMMAND
from swarmctl.swarm.topics import (
    Endpoint,
    sensor_behind,
)
from swarmctl.yamltext.edits import make_fix, replace_value
from swarmctl.yamltext.source import Loc


@rule("TOPIC001")
def clashing_types(context: RuleContext) -> Iterator[Diagnostic]:
    """One topic with two message types."""
    first: dict[tuple[str, str], Endpoint] = {}
    reached, common = bridged(context), context.middleware.topics
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
    shown = "; `rostopic type` shows it on a running system" if context.middleware.ros1 else ""
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
            *(() if is_program else (f"if it uses {one.type}, it cannot use this topic: choose another",)),
        ),
        fix=None
        if is_program or not is_near(one.type, other)
        else make_fix(f"write `{other}`", replace_value(context.source, loc, other), safe=False),
    )


@rule("TOPIC003")
def sensors_off(context: RuleContext) -> Iterator[Diagnostic]:
    """A subscription to a sensor that is turned off."""
    for one in context.endpoints:
        driven = None if one.publishes else _of_a_driver(context, one.topic)
        sensor = sensor_behind(context.split_topic(one.topic)[1])
        if driven is None or one.topic in context.robots_by_command:
            continue
        if one.topic in context.publishers.programs:
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
            f"program `{one.owner}` subscribes to `{one.topic}`, which robot `{driven[0]}` does not publish",
            context.span(*one.loc, "topic"),
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
    reached, common = bridged(context), context.middleware.topics
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
