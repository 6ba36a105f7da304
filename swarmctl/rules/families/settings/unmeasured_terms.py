"""Terms of `maintenance` that nothing measures: they would never hold."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic
from swarmctl.robot_types.effective_settings import rates_of
from swarmctl.robot_types.sensors import Battery
from swarmctl.rules.context import RuleContext, rule
from swarmctl.swarm.robot_maintenance import maintenance_of
from swarmctl.yamltext.source import Loc

_WHY = {
    "idle": "no driver or gate of swarmctl stands before its wheels",
    "battery": "swarmctl's driver reads no battery of it",
}


@rule("SET009")
def unmeasured_terms(context: RuleContext) -> Iterator[Diagnostic]:
    """A term that swarmctl does not measure on a robot."""
    found: dict[tuple[Loc, str], list[str]] = {}
    for name, robot in context.spec.robots.items():
        wanted = maintenance_of(context.spec, name)
        if not wanted.model_fields_set:
            continue
        measured = {"idle": _has_gate(context, name), "battery": _reads_battery(context, name)}
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
            help=(f"remove it, or write `maintenance: {{{term}: 0}}` at the robot",),
        )


def _has_gate(context: RuleContext, robot: str) -> bool:
    return robot in context.driven_robots or robot in context.gated


def _reads_battery(context: RuleContext, robot: str) -> bool:
    kind = context.driven_robots.get(robot)
    if kind is None or kind.driver_protocol is None:
        return False
    rates = rates_of(kind, context.settings_of(robot))
    return any(isinstance(one, Battery) and rates[name] > 0 for name, one in kind.sensors.items())
