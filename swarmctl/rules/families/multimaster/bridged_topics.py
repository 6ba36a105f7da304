"""The topics of `multimaster.topics`: their publishers and their destinations."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic
from swarmctl.rules.context import RuleContext, rule
from swarmctl.spec.multimaster_model import Crossing
from swarmctl.suggest import did_you_mean, nearest
from swarmctl.swarm.modes import MULTIMASTER
from swarmctl.swarm.topics import DIAGNOSTICS
from swarmctl.yamltext.edits import make_fix, replace_value
from swarmctl.yamltext.source import Loc


def _crossings(context: RuleContext) -> Iterator[tuple[Loc, Crossing]]:
    settings = context.spec.multimaster
    if settings is not None and context.spec.mode in MULTIMASTER:
        for index, crossing in enumerate(settings.topics):
            yield ("multimaster", "topics", index), crossing


@rule("MM010", "MM013")
def destinations(context: RuleContext) -> Iterator[Diagnostic]:
    """A topic bridged to an unknown island, or only to its own."""
    islands = {island.name: None for island in context.islands}
    for loc, crossing in _crossings(context):
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
    for loc, crossing in _crossings(context):
        where, topic = (*loc, "topic"), crossing.topic
        if topic in context.middleware.topics and topic != DIAGNOSTICS:
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
