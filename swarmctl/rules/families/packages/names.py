"""The topics and frames that programs are given belong to robots of the swarm."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.rules.context import RuleContext, rule
from swarmctl.suggest import nearest
from swarmctl.swarm.command_topics import COMMAND
from swarmctl.swarm.names import resolved

_FRAME = re.compile(r"(^|.*[_/])frame(_id)?", re.I)
_OF_DRIVERS = ("base_link", "odom")  # every robot has these, behind its name
_PUBLISHERS = {"robot_state_publisher", "static_transform_publisher", "state_publisher"}


@rule("PKG012", ros1=True)
def remapped_topics(context: RuleContext) -> Iterator[Diagnostic]:
    """A name is remapped to a topic of a robot that does not exist."""
    known = {one.topic for one in context.endpoints}
    for span, topic, where in _remaps(context):
        space, name = context.split_topic(topic)
        if topic in known or space in context.robot_by_namespace:
            continue
        near = nearest(space, tuple(context.robot_by_namespace)) if space else None
        if topic == f"/{COMMAND}" or (near is not None and name in _topics_of(context, near)):
            meant = f"{near}/{name}" if near else None
            yield Diagnostic(
                "PKG012",
                f"no robot has the topic `{topic}`{where}",
                span,
                label="remapped to nobody's topic",
                help=(f"did you mean `{meant}`?",)
                if meant
                else (f"remap to `{next(iter(context.robot_by_namespace))}/{name}`, or whose it is",),
            )


def _remaps(context: RuleContext) -> Iterator[tuple[Span, str, str]]:
    for name, program in context.spec.programs.items():
        node = context.program_nodes[name]
        for old, new in program.remap.items():
            yield context.span("programs", name, "remap", old), resolved(new, node, {}), ""
    for use in (one for one in context.launches if not one.is_driver):  # TOPIC011 and PKG022 have theirs
        span = context.launch_span(use, "launch")
        for one in use.launched.nodes:
            for _, new in one.remaps if one.certain and one.name is not None else ():
                yield span, resolved(new, one.name or "", {}), f", to which {one.place} remaps"


def _topics_of(context: RuleContext, space: str) -> set[str]:
    robot = context.robot_by_namespace[space]
    command = context.command_topics.get(robot)
    taken = {command.topic.removeprefix(f"{space}/")} if command is not None else set()
    return taken | set(context.sensors_of(robot))


@rule("PKG013", ros1=True)
def frames(context: RuleContext) -> Iterator[Diagnostic]:
    """A parameter names a frame that no robot of the swarm has."""
    prefixes = {namespace[1:] for namespace in context.robot_by_namespace}
    published = _others_publish(context)
    for span, key, value, where in _parameters(context):
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
            span,
            label="no transform from it or to it",
            help=(f"did you mean `{meant}/{rest}`?",)
            if meant and slash
            else (f"frames begin with the name of their robot, as in `{next(iter(prefixes))}/{rest}`",),
        )


def _others_publish(context: RuleContext) -> bool:
    """True if a program publishes frames of its own, from a URDF or as constants."""
    started = {one.executable for one in context.spec.programs.values()}
    started |= {node.executable for one in context.launches for node in one.launched.nodes}
    return bool(started & _PUBLISHERS)


def _parameters(context: RuleContext) -> Iterator[tuple[Span, str, str, str]]:
    for name, program in context.spec.programs.items():
        kind, values = program.named_values
        for key, value in values.items():
            if isinstance(value, str):
                yield context.span("programs", name, kind, key), key, value, ""
    for use in context.launches:
        given = {value for value in use.started.named_values[1].values() if isinstance(value, str)}
        for one in use.launched.parameters:
            if one.value is not None and one.value not in given:
                yield context.launch_span(use, "launch"), one.name, one.value, f" ({one.place})"
