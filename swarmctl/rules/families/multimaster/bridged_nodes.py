"""Nodes of one name that a bridge brings together: a publisher is registered elsewhere under its own name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.diagnostics import Diagnostic, Span, note_of_other
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.families.packages.launched_nodes import named_nodes
from swarmctl.rules.launch_uses import LaunchUse
from swarmctl.swarm.names import driver_node, resolved


@dataclass(frozen=True)
class _Started:
    """The nodes of one program or driver, all of whose names are known, on their island."""

    owner: str
    island: str
    nodes: frozenset[str]
    span: Span
    file: tuple[str | None, str | None] = (None, None)  # package and launch file


@rule("MM017", ros1=True)
def equal_nodes(context: RuleContext) -> Iterator[Diagnostic]:
    """A bridged topic brings a node to a master that has another node of its name.

    Which node of a launch file publishes the topic is not known: all of its names must be taken.
    """
    if not context.launches or not context.bridges:
        return
    local = tuple(_local(context))
    taken = {(one.island, node): one for one in local for node in one.nodes}
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
                yield _finding(own, other, bridge.topic, to)


def _meet(one: _Started, other: _Started) -> bool:
    """True if the same topic's publishers of both have one name, wherever they are brought."""
    same = one.nodes == other.nodes and (len(one.nodes) == 1 or one.file == other.file)
    return one.owner != other.owner and same


def _finding(own: _Started, other: _Started, topic: str, to: str) -> Diagnostic:
    listed = ", ".join(f"`{node}`" for node in sorted(own.nodes))
    nodes = f"node {listed}" if len(own.nodes) == 1 else f"the publisher among {listed}"
    has = f"where {other.owner} has" if other.island == to else f"as it does that of {other.owner} with"
    return Diagnostic(
        "MM017",
        f"`{topic}` brings {nodes} of {own.owner} to island `{to}`, {has} the same name",
        own.span,
        label="the master there shuts one of them down",
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
    is_complete = len(names) == len(use.launched.nodes) and not use.launched.unfound
    return frozenset(names) if is_complete else frozenset()


def _publishers(context: RuleContext) -> Iterator[tuple[str, str]]:
    """Yields each published topic with whose it is, as ``_local`` names it."""
    for one in context.endpoints:
        if one.publishes:
            yield one.topic, f"program `{one.owner}`"
    for robot, space in context.namespaces.items():
        for topic in context.driver_topics(robot):
            yield resolved(topic.name, driver_node(space), {}), f"the driver of robot `{robot}`"
