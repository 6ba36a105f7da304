"""Terms of `maintenance` that nothing measures: they would never hold."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic
from swarmctl.robot_types.effective_settings import rates_of
from swarmctl.robot_types.sensors import Battery
from swarmctl.rules.context import RuleContext, rule
from swarmctl.swarm import names
from swarmctl.swarm.robot_maintenance import maintenance_of, power_topics
from swarmctl.swarm.topics import declared_topics
from swarmctl.yamltext.source import Loc

_WHY = {
    "idle": "no driver or gate of swarmctl stands before its wheels",
    "battery": "neither swarmctl's driver nor a gate reads its battery",
    "docked": "no gate reads a topic of its driver that shows it",
}
_NOTHING = {"docked": "false"}


@rule("SET009")
def unmeasured_terms(context: RuleContext) -> Iterator[Diagnostic]:
    """A term that swarmctl does not measure on a robot."""
    found: dict[tuple[Loc, str], list[str]] = {}
    for name, robot in context.spec.robots.items():
        wanted = maintenance_of(context.spec, name)
        if not wanted.model_fields_set:
            continue
        battery, docked = _read_by_gate(context, name)
        measured = {
            "idle": _has_gate(context, name),
            "battery": battery or _reads_battery(context, name),
            "docked": docked or battery,
        }
        for term in wanted.model_fields_set:
            if not measured[term]:
                own = getattr(robot.maintenance, term) is not None
                found.setdefault((("robots", name) if own else (), term), []).append(name)
    for (place, term), (first, *others) in found.items():
        more = f" and {len(others)} more" if others else ""
        loc = (*place, "maintenance", term)
        yield Diagnostic(
            "SET009",
            f"`{term}` of `maintenance` never holds for robot `{first}`{more}: {_WHY[term]}",
            context.span(*loc),
            label="is not measured",
            help=(f"remove it, or write `maintenance: {{{term}: {_NOTHING.get(term, '0')}}}` at the robot",),
        )


def _has_gate(context: RuleContext, robot: str) -> bool:
    return robot in context.driven_robots or robot in context.gated


def _read_by_gate(context: RuleContext, robot: str) -> tuple[bool, bool]:
    """Whether the gate of a robot reads its battery, and a topic that says whether it is docked."""
    if robot not in context.gated:
        return False, False
    node = names.driver_node(context.namespaces[robot])
    battery, docked = power_topics(declared_topics(context.ros_drivers[robot], node))
    return battery is not None, docked is not None


def _reads_battery(context: RuleContext, robot: str) -> bool:
    kind = context.driven_robots.get(robot)
    if kind is None or kind.driver_protocol is None:
        return False
    rates = rates_of(kind, context.settings_of(robot))
    return any(isinstance(one, Battery) and rates[name] > 0 for name, one in kind.sensors.items())
