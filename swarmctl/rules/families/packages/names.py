"""The topics and frames that programs are given belong to robots of the swarm."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic
from swarmctl.rules.context import RuleContext, rule
from swarmctl.suggest import nearest
from swarmctl.swarm.names import namespace, program_node, resolved, split_topic
from swarmctl.swarm.topics import COMMAND, sensors_of
from swarmctl.yamltext.source import Loc

_FRAME = re.compile(r"(^|.*[_/])frame(_id)?", re.I)
_OF_DRIVERS = ("base_link", "odom")  # every robot has these, behind its name
_PUBLISHERS = {"robot_state_publisher", "static_transform_publisher", "state_publisher"}


@rule("PKG012", ros1=True)
def remapped_topics(context: RuleContext) -> Iterator[Diagnostic]:
    """A name is remapped to a topic of a robot that does not exist."""
    known = {one.topic for one in context.endpoints}
    for loc, topic, where in _remaps(context):
        space, name = split_topic(topic)
        if topic in known or space in context.robot_by_namespace:
            continue
        near = nearest(space, tuple(context.robot_by_namespace)) if space else None
        if topic == f"/{COMMAND}" or (near is not None and name in _topics_of(context, near)):
            meant = f"{near}/{name}" if near else None
            yield Diagnostic(
                "PKG012",
                f"no robot has the topic `{topic}`{where}",
                context.span(*loc),
                label="remapped to nobody's topic",
                help=(f"did you mean `{meant}`?",)
                if meant
                else (f"remap to `{namespace(next(iter(context.spec.robots)))}/{name}`, or whose it is",),
            )


def _remaps(context: RuleContext) -> Iterator[tuple[Loc, str, str]]:
    for name, program in context.spec.programs.items():
        node = program_node(name, program.robot)
        for old, new in program.remap.items():
            yield ("programs", name, "remap", old), resolved(new, node, {}), ""
        for one in context.launches[name].nodes if name in context.launches else ():
            for _, new in one.remaps if one.certain and one.name is not None else ():
                full = resolved(new, one.name or "", {})
                yield ("programs", name, "launch"), full, f", to which {one.place} remaps"


def _topics_of(context: RuleContext, space: str) -> set[str]:
    robot = context.spec.robots[context.robot_by_namespace[space]]
    return {COMMAND, *sensors_of(context.types[robot.type], robot.driver)}


@rule("PKG013", ros1=True)
def frames(context: RuleContext) -> Iterator[Diagnostic]:
    """A parameter names a frame that no robot of the swarm has."""
    prefixes = {namespace(robot)[1:] for robot in context.spec.robots}
    published = _others_publish(context)
    for loc, key, value, where in _parameters(context):
        if not _FRAME.fullmatch(key):
            continue
        head, slash, rest = value.strip().removeprefix("/").partition("/")
        if slash and rest in _OF_DRIVERS and head not in prefixes:
            meant = nearest(head, tuple(sorted(prefixes)))
        elif not slash and head == "base_link" and not published:
            meant, rest = next(iter(sorted(prefixes))), head
        else:
            continue
        yield Diagnostic(
            "PKG013",
            f"no robot has the frame `{value}`, which `{key}` names{where}",
            context.span(*loc),
            label="no transform from it or to it",
            help=(f"did you mean `{meant}/{rest}`?",)
            if meant and slash
            else (f"frames begin with the name of their robot, as in `{next(iter(prefixes))}/{rest}`",),
        )


def _others_publish(context: RuleContext) -> bool:
    """True if a program publishes frames of its own, from a URDF or as constants."""
    started = {one.executable for one in context.spec.programs.values()}
    started |= {node.executable for one in context.launches.values() for node in one.nodes}
    return bool(started & _PUBLISHERS)


def _parameters(context: RuleContext) -> Iterator[tuple[Loc, str, str, str]]:
    for name, program in context.spec.programs.items():
        for key, value in program.params.items():
            if isinstance(value, str):
                yield ("programs", name, "params", key), key, value, ""
        given = {value for value in program.params.values() if isinstance(value, str)}
        for one in context.launches[name].parameters if name in context.launches else ():
            if one.value is not None and one.value not in given:
                yield ("programs", name, "launch"), one.name, one.value, f" ({one.place})"
