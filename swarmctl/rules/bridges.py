"""The topics of `multimaster.topics`: publishers, destinations, and nodes of one name."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.diagnostics import Diagnostic, Span, note_of_other
from swarmctl.linter.context import RuleContext, rule
from swarmctl.linter.launch_uses import LaunchUse
from swarmctl.rules.launch_files import named_nodes
from swarmctl.spec.ros_model import Crossing
from swarmctl.suggest import did_you_mean, nearest
from swarmctl.swarm.modes import MULTIMASTER
from swarmctl.swarm.names import driver_node, resolved
from swarmctl.swarm.topics import DIAGNOSTICS
from swarmctl.yamltext.edits import make_fix, replace_value
from swarmctl.yamltext.source import Loc

#: Of packages that both have, what only one has, or what has other fields in the other one.
_TYPES_OF_ONE_ROS = {
    *("std_msgs/Time", "std_msgs/Duration", "rosgraph_msgs/Log", "rosgraph_msgs/TopicStatistics"),
    *("visualization_msgs/Marker", "visualization_msgs/MarkerArray"),
    *("tf2_msgs/LookupTransformActionGoal", "tf2_msgs/LookupTransformActionResult"),
}
_PACKAGES_OF_ONE_ROS = {
    *("actionlib", "dynamic_reconfigure", "move_base_msgs", "roscpp", "rosserial_msgs", "tf", "topic_tools"),
    *("rcl_interfaces", "action_msgs", "lifecycle_msgs", "nav2_msgs", "unique_identifier_msgs"),
}


def crossings(context: RuleContext) -> Iterator[tuple[Loc, Crossing]]:
    """Yields the entries of `multimaster.topics` with their places, where islands are joined."""
    settings = context.spec.multimaster
    if settings is not None and context.spec.mode in MULTIMASTER and context.joins_islands:
        for index, crossing in enumerate(settings.topics):
            yield ("multimaster", "topics", index), crossing


@rule("MM010", "MM013")
def destinations(context: RuleContext) -> Iterator[Diagnostic]:
    """A topic bridged to an unknown island, or only to its own."""
    islands = {island.name: None for island in context.islands}
    for loc, crossing in crossings(context):
        for place, to in enumerate(crossing.to):
            if to in islands:
                continue
            home = context.home.get(to)
            meant = home.name if home is not None else nearest(to, islands)
            where = (*loc, "to", place)
            yield Diagnostic(
                "MM010",
                f"unknown island `{to}`",
                context.span(*where),
                label="a host, not an island" if to in context.spec.hosts else "not defined",
                help=(f"host `{to}` is on island `{home.name}`",)
                if home is not None
                else did_you_mean(to, islands, "the islands are"),
                fix=make_fix(
                    f"write `{meant}`", replace_value(context.source, where, meant), safe=home is not None
                )
                if meant
                else None,
            )
        origins = context.publishers.of(crossing.topic)
        if len(origins) == 1 and set(crossing.to) == set(origins):
            yield Diagnostic(
                "MM013",
                f"`{crossing.topic}` is published on island `{crossing.to[0]}` and bridged to no other",
                context.span(*loc, "to"),
                label="its own island",
                help=("list the islands that have to receive it",),
            )


@rule("MM011", "MM012")
def origins(context: RuleContext) -> Iterator[Diagnostic]:
    """A bridged topic without a publisher, or one that every island has."""
    for loc, crossing in crossings(context):
        where, topic = (*loc, "topic"), crossing.topic
        if topic in context.common_topics and topic != DIAGNOSTICS:
            yield Diagnostic(
                "MM012",
                f"bridging `{topic}` would send all its messages to the other islands",
                context.span(*where),
                label="every island has this topic",
                help=("bridge specific topics; `odom` has a robot's position",),
            )
        elif topic.startswith("/") and not context.publishers.of(topic):
            near = _nearest(context, topic)
            yield Diagnostic(
                "MM011",
                f"the bridged topic `{topic}` has no declared publisher",
                context.span(*where),
                label="origin unknown",
                help=(f"did you mean `{near}`?",)
                if near
                else ("correct the name, or declare it under `publishes` of its program",),
                fix=make_fix(f"write `{near}`", replace_value(context.source, where, near), safe=False)
                if near
                else None,
            )


def _nearest(context: RuleContext, topic: str) -> str | None:
    space = context.split_topic(topic)[0]
    known = [*context.publishers.programs]
    if (robot := context.robot_by_namespace.get(space)) is not None:
        known += [f"{space}/{one}" for one in context.sensors_of(robot)]
    return nearest(topic, tuple(known))


@rule("MM018")
def types_of_one_ros(context: RuleContext) -> Iterator[Diagnostic]:
    """A topic bridged between ROS 1 and ROS 2 whose message type one of them lacks, or has otherwise."""
    masters = {island.name: island.has_master for island in context.islands}
    for bridge in context.bridges:
        package = bridge.type.partition("/")[0]
        apart = [to for to in bridge.to if masters[to] is not masters[bridge.origin]]
        if apart and (package in _PACKAGES_OF_ONE_ROS or bridge.type in _TYPES_OF_ONE_ROS):
            yield Diagnostic(
                "MM018",
                f"`{bridge.topic}` cannot cross from `{bridge.origin}` to `{apart[0]}`: "
                f"ROS 1 and ROS 2 do not both have `{bridge.type}`",
                context.span(*_loc(bridge.cause)),
                label="needs it there",
                help=("publish it as a type that both have, such as one of sensor_msgs or geometry_msgs",),
            )


def _loc(cause: str) -> Loc:
    """The place of the entry of the spec that needs a bridge."""
    return tuple(int(one) if one.isdigit() else one for one in re.findall(r"[^.\[\]]+", cause))


@dataclass(frozen=True)
class _Started:
    """The nodes of one program or driver, all of whose names are known, on their island."""

    owner: str
    island: str
    nodes: frozenset[str]
    span: Span
    file: tuple[str | None, str | None] = (None, None)  # package and launch file


@rule("MM017")
def equal_nodes(context: RuleContext) -> Iterator[Diagnostic]:
    """A bridged topic brings a node to an island that has another node of its name.

    Which node of a launch file publishes the topic is not known: all of its names must be taken.
    """
    if not context.launches or not context.bridges:
        return
    local = tuple(_local(context))
    taken = {(one.island, node): one for one in local for node in one.nodes}
    masters = {island.name: island.has_master for island in context.islands}
    by_owner = {one.owner: one for one in local}
    publishers = tuple(_publishers(context))
    brought: dict[str, list[_Started]] = {}
    reported: set[frozenset[str]] = set()
    for bridge in context.bridges:
        sources = (owner for topic, owner in publishers if topic == bridge.topic)
        for own in (by_owner[owner] for owner in dict.fromkeys(sources) if owner in by_owner):
            for to in bridge.to if own.island == bridge.origin and own.nodes else ():
                others = [taken.get((to, node)) for node in sorted(own.nodes)]
                other = others[0] if None not in others else None
                other = other or next((one for one in brought.get(to, ()) if _meet(one, own)), None)
                brought.setdefault(to, []).append(own)
                if other is None or frozenset((own.owner, other.owner)) in reported:
                    continue
                reported.add(frozenset((own.owner, other.owner)))
                shuts_down = masters[bridge.origin] and masters[to]
                yield _finding(own, other, bridge.topic, to, shuts_down=shuts_down)


def _meet(one: _Started, other: _Started) -> bool:
    """True if the same topic's publishers of both have one name, wherever they are brought."""
    same = one.nodes == other.nodes and (len(one.nodes) == 1 or one.file == other.file)
    return one.owner != other.owner and same


def _finding(own: _Started, other: _Started, topic: str, to: str, *, shuts_down: bool) -> Diagnostic:
    listed = ", ".join(f"`{node}`" for node in sorted(own.nodes))
    nodes = f"node {listed}" if len(own.nodes) == 1 else f"the publisher among {listed}"
    has = f"where {other.owner} has" if other.island == to else f"as it does that of {other.owner} with"
    return Diagnostic(
        "MM017",
        f"`{topic}` brings {nodes} of {own.owner} to island `{to}`, {has} the same name",
        own.span,
        label="the master there shuts one of them down"
        if shuts_down
        else "the relay cannot use its name there",
        notes=note_of_other(other.span, own.span),
        help=(
            "give each a namespace of its own: robot: ..., or namespace: ...",
            "a leading `/` of its name in the launch file keeps it out of namespaces: remove it",
        ),
    )


def _local(context: RuleContext) -> Iterator[_Started]:
    for island, node, owner, loc in named_nodes(context):
        yield _Started(owner, island, frozenset((node,)), context.span(*loc, key=True))
    for use in context.launches:
        home = context.home.get(use.host or "")
        if home is not None and (nodes := _names(use)):
            file = (use.started.package, use.started.launch)
            yield _Started(use.owner, home.name, nodes, context.launch_span(use, "launch"), file)


def _names(use: LaunchUse) -> frozenset[str]:
    """The names of its nodes; none unless all are known."""
    names = {one.name for one in use.launched.nodes if one.name is not None and one.certain}
    is_complete = len(names) == len(use.launched.nodes) and not (
        use.launched.unfound or use.launched.includes
    )
    return frozenset(names) if is_complete else frozenset()


def _publishers(context: RuleContext) -> Iterator[tuple[str, str]]:
    """Yields each published topic with whose it is, as ``_local`` names it."""
    for one in context.endpoints:
        if one.publishes:
            yield one.topic, f"program `{one.owner}`"
    for robot, space in context.namespaces.items():
        for topic in context.driver_topics(robot):
            yield resolved(topic.name, driver_node(space), {}), f"the driver of robot `{robot}`"
