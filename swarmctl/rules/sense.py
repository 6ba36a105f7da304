"""Robot types and settings against physics and the robots of the field: what none is, and what few are."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.plausibility import (
    Implausible,
    implausible_separation,
    implausible_wheels,
    standstill,
    wrapping_counters,
)
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.sensors import ODOM
from swarmctl.robot_types.settings import RobotSettings, last_rate


@rule("SENSE001", "SENSE002", "SENSE003", "SENSE005", "SENSE007", "SENSE009", "SENSE010")
def implausible_types(context: RuleContext) -> Iterator[Diagnostic]:
    """Wheels, speeds, encoders and counters of a robot type that contradict each other or physics."""
    for name, kind in context.document.own_native_types.items():
        settings = kind.settings
        doubts = (
            implausible_wheels(kind),
            _of_separation(kind, settings),
            standstill(kind, settings.limits.linear),
            wrapping_counters(kind, _rate(kind, settings)),
        )
        for doubt in doubts:
            if doubt is not None:
                yield _finding(doubt, f"robot type `{name}`", context.document.span_of_type(name, *doubt.at))


@rule("SENSE003", "SENSE005", "SENSE007")
def implausible_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """A measured separation, a limit or a rate, of a robot or of all, that its type contradicts."""
    robots, defaults = context.spec.robots, context.spec.defaults.robot
    for name, kind in context.driven_robots.items():
        own = robots[name].settings
        if not own.model_fields_set and ODOM not in defaults.rates:
            continue
        for doubt in (_of_separation(kind, own), standstill(kind, own.limits.linear)):
            if doubt is not None and doubt.at[0] == "settings":
                yield _finding(doubt, f"robot `{name}`", context.span("robots", name, *doubt.at))
        at = ("robots", name, "settings") if ODOM in own.rates else ("defaults", "robot")
        if (ODOM in own.rates or ODOM in defaults.rates) and not kind.sketch:
            wrapping = wrapping_counters(kind, _rate(kind, *context.document.settings_layers(name)))
            if wrapping is not None:
                yield _finding(wrapping, f"robot `{name}`", context.span(*at, "rates", ODOM))
    kinds = {robots[name].type: kind for name, kind in context.driven_robots.items()}
    for name, kind in sorted(kinds.items()):
        for doubt in (_of_separation(kind, defaults), standstill(kind, defaults.limits.linear)):
            if doubt is not None and doubt.at[0] == "settings":
                span = context.span("defaults", "robot", *doubt.at[1:])
                yield _finding(doubt, f"robots of type `{name}`", span)


def _of_separation(kind: RobotType, settings: RobotSettings) -> Implausible | None:
    measured = settings.calibration.wheel_separation
    return implausible_separation(measured, kind.kinematics.wheel_separation) if measured else None


def _rate(kind: RobotType, *layers: RobotSettings) -> float:
    """How often the counters are read, or published by a sketch, Hz."""
    if kind.sketch is not None:
        published = {one.topic: one.rate or 0.0 for one in kind.sketch.publishes}
        return published.get(kind.sketch.odometry.left, 0.0) if kind.sketch.odometry else 0.0
    return last_rate(kind.sensors[ODOM].rate, ODOM, layers) if ODOM in kind.sensors else 0.0


def _finding(doubt: Implausible, whose: str, span: Span) -> Diagnostic:
    return Diagnostic(doubt.rule, f"{whose}: {doubt.message}", span, label=doubt.label, help=(doubt.help,))
