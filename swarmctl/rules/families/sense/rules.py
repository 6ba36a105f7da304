"""Robot types and settings against physics and the robots of the field: what none is, and what few are."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.robot_types.plausibility import (
    Doubt,
    doubts_about_calibration,
    doubts_about_wheels,
    standstills,
    wrapping_counters,
)
from swarmctl.robot_types.plausible_sensors import doubts_about_sensors
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.sensors import ODOM
from swarmctl.robot_types.settings import RobotSettings, last_rate
from swarmctl.rules.context import RuleContext, rule


@rule("SENSE001", "SENSE002", "SENSE009", "SENSE010")
def implausible_wheels(context: RuleContext) -> Iterator[Diagnostic]:
    """Wheels, speeds and units of a robot type that contradict each other or physics."""
    for name, kind in context.document.own_native_types.items():
        for doubt in doubts_about_wheels(kind):
            yield _of_type(context, name, doubt)


@rule("SENSE011", "SENSE012", "SENSE013", "SENSE014", "SENSE015", "SENSE016")
def implausible_sensors(context: RuleContext) -> Iterator[Diagnostic]:
    """Sensors of a robot type that sit, look or measure as none does."""
    for name, kind in context.document.own_native_types.items():
        for doubt in doubts_about_sensors(kind):
            yield _of_type(context, name, doubt)


@rule("SENSE003", "SENSE004")
def implausible_calibrations(context: RuleContext) -> Iterator[Diagnostic]:
    """A measured value of a robot that is far from its type's."""
    for name, kind in context.document.own_native_types.items():
        for doubt in doubts_about_calibration(kind, kind.settings):
            yield _of_type(context, name, doubt)
    for name, kind in context.native_robots.items():
        robot = context.spec.robots[name]
        if robot.settings.calibration.model_fields_set:
            for doubt in doubts_about_calibration(kind, robot.settings):
                yield _of_robot(context, name, doubt)
    yield from _of_defaults(context, doubts_about_calibration)


@rule("SENSE005", "SENSE006")
def standing_robots(context: RuleContext) -> Iterator[Diagnostic]:
    """A full speed, or a limit, that leaves a robot no speed or only a few."""
    for name, kind in context.document.own_native_types.items():
        for doubt in standstills(kind, kind.settings):
            yield _of_type(context, name, doubt)
    for name, kind in context.driven_robots.items():
        robot = context.spec.robots[name]
        if robot.settings.limits.linear is not None:
            for doubt in standstills(kind, robot.settings):
                if _is_of_settings(doubt):
                    yield _of_robot(context, name, doubt)
    yield from _of_defaults(context, standstills)


@rule("SENSE007", "SENSE008")
def ambiguous_counters(context: RuleContext) -> Iterator[Diagnostic]:
    """Position counters that wrap between two readings."""
    for name, kind in context.document.own_native_types.items():
        doubt = wrapping_counters(kind, _rate(kind, kind.settings))
        if doubt is not None:
            yield _of_type(context, name, doubt)
    defaults = context.spec.defaults.robot
    for name, kind in context.driven_robots.items():
        own = ODOM in context.spec.robots[name].settings.rates
        if not own and ODOM not in defaults.rates:
            continue
        doubt = wrapping_counters(kind, _rate(kind, *context.document.settings_layers(name)))
        if doubt is not None and not kind.sketch:
            at = ("robots", name, "settings") if own else ("defaults", "robot")
            yield _finding(doubt, f"robot `{name}`", context.span(*at, "rates", ODOM))


def _rate(kind: RobotType, *layers: RobotSettings) -> float:
    """How often the counters are read, or published by a sketch, Hz."""
    if kind.sketch is not None:
        published = {one.topic: one.rate or 0.0 for one in kind.sketch.publishes}
        return published.get(kind.sketch.odometry.left, 0.0) if kind.sketch.odometry else 0.0
    return last_rate(kind.sensors[ODOM].rate, ODOM, layers) if ODOM in kind.sensors else 0.0


def _of_defaults(
    context: RuleContext, doubts: Callable[[RobotType, RobotSettings], Iterator[Doubt]]
) -> Iterator[Diagnostic]:
    """The doubts about the settings of all robots, for each type that has robots."""
    defaults = context.spec.defaults.robot
    robots = context.driven_robots if defaults.model_fields_set else ()
    kinds = {context.spec.robots[one].type: context.native_robots[one] for one in robots}
    for name, kind in sorted(kinds.items()):
        for doubt in filter(_is_of_settings, doubts(kind, defaults)):
            span = context.span("defaults", "robot", *doubt.at[1:])
            yield _finding(doubt, f"robots of type `{name}`", span)


def _is_of_settings(doubt: Doubt) -> bool:
    return doubt.at[0] == "settings"


def _of_type(context: RuleContext, name: str, doubt: Doubt) -> Diagnostic:
    return _finding(doubt, f"robot type `{name}`", context.document.span_of_type(name, *doubt.at))


def _of_robot(context: RuleContext, name: str, doubt: Doubt) -> Diagnostic:
    return _finding(doubt, f"robot `{name}`", context.span("robots", name, *doubt.at))


def _finding(doubt: Doubt, whose: str, span: Span) -> Diagnostic:
    return Diagnostic(
        doubt.rule,
        f"{whose}: {doubt.message}",
        span,
        label=doubt.label,
        help=(doubt.help,),
    )
