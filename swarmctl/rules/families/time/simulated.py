"""Simulated time: each island has one clock, and only where nodes read it."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.families.topics.rules import bridged
from swarmctl.swarm.topics import CLOCK

_PARAMETER = "/use_sim_time"
_PUBLISHES = f"publishes: [{{topic: {CLOCK}, type: rosgraph_msgs/Clock}}]"


@rule("TIME007", ros1=True)
def clocks(context: RuleContext) -> Iterator[Diagnostic]:
    """Nodes use simulated time on an island that has no clock, or two."""
    if not context.spec.ros.use_sim_time:
        return
    by_island: dict[str, list[tuple[str, Span]]] = {}
    reached = bridged(context).get(CLOCK, set())
    for owner, host, span in _publishers(context):
        home = context.home.get(host or "")
        if home is not None:
            for name in reached | {home.name} if home.name in reached else {home.name}:
                by_island.setdefault(name, []).append((owner, span))
    for island in context.islands:
        found = by_island.get(island.name, [])
        if not found:
            where = f" on island `{island.name}`" if len(context.islands) > 1 else ""
            yield Diagnostic(
                "TIME007",
                f"nothing{where} publishes `{CLOCK}`, the time of all nodes there",
                context.span("ros", "use_sim_time"),
                label="without a clock the time stands at 0",
                help=(f"declare it at the simulator or player of that island: {_PUBLISHES}",),
            )
        for owner, span in found[1:]:
            first, place = found[0]
            yield Diagnostic(
                "TIME007",
                f"{first} and {owner} both publish `{CLOCK}`",
                span,
                label="the time jumps between two clocks",
                notes=(Note(place, "the other clock"),),
                help=("keep one clock for each island",),
            )


@rule("TIME008", ros1=True)
def unread_clocks(context: RuleContext) -> Iterator[Diagnostic]:
    """A clock that no node reads, or a launch file that makes nodes read one halfway through a start."""
    if context.spec.ros.use_sim_time:
        return
    for owner, _, span in _publishers(context):
        yield Diagnostic(
            "TIME008",
            f"{owner} publishes `{CLOCK}`, which no node reads without `use_sim_time`",
            span,
            label="nodes use the time of their hosts",
            help=("write ros: {use_sim_time: true}",),
        )
    for use in context.launches:
        private = {id(one) for node in use.launched.nodes for one in node.parameters}
        for one in use.launched.parameters:
            is_set = one.name == _PARAMETER or (one.name == _PARAMETER[1:] and not use.namespace)
            if is_set and id(one) not in private and one.value in ("true", "1", "True"):
                yield Diagnostic(
                    "TIME008",
                    f"the launch file of {use.owner} sets `{_PARAMETER}` ({one.place})",
                    context.launch_span(use, "launch"),
                    label="only nodes that start later read it",
                    help=("write ros: {use_sim_time: true}, so that the master has it before any node",),
                )


def _publishers(context: RuleContext) -> Iterator[tuple[str, str | None, Span]]:
    """Yields what publishes the clock, its host, and its place."""
    for one in context.endpoints:
        if one.publishes and one.topic == CLOCK:
            yield f"program `{one.owner}`", one.host, context.span(*one.loc, "topic")
    for robot in context.ros_drivers:
        if any(one.name == CLOCK for one in context.driver_topics(robot)):
            span = context.span("robots", robot, key=True)
            yield f"the driver of robot `{robot}`", context.driving[robot], span
