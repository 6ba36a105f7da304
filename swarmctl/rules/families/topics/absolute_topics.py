"""Topics of drivers with absolute names: those of two robots mix, whatever their namespaces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.diagnostics import Diagnostic, Span, note_of_other
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.families.topics.rules import bridged
from swarmctl.swarm.command_topics import COMMAND
from swarmctl.swarm.topics import JOINTS

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


@rule("TOPIC011", ros1=True)
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
    return topic not in context.middleware.topics and topic != f"/{JOINTS}"
