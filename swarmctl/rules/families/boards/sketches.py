"""The generated sketches: pins, baud rates and encoders that the board can handle."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.analysis.sketch_limits import good_bauds, most_pulses, wrong_baud
from swarmctl.diagnostics import Diagnostic
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.sketch_settings import DEFAULTS, Firmware, clashes
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.families.serial_lines.rules import BAUDS


@rule("BOARD010")
def pins_used_twice(context: RuleContext) -> Iterator[Diagnostic]:
    """A pin with two uses."""
    general = context.spec.defaults.robot
    for name, kind in context.native_robots.items():
        if kind.sketch is None or not kind.sketch.firmware:
            continue
        robot = context.spec.robots[name]
        layers = {("robots", name, "settings"): robot.settings, ("defaults", "robot"): general}
        declared = {loc: one.firmware for loc, one in layers.items() if "firmware" in one.model_fields_set}
        if not declared:
            continue
        wiring = context.settings_of(name).firmware
        for second, first, pin in clashes(wiring):
            places = ((loc, one) for loc in declared for one in (second, first) if _sets(declared[loc], one))
            loc, place = next(places, ((), ()))
            if place:
                other = first if place == second else second
                yield Diagnostic(
                    "BOARD010",
                    f"pin {pin} of the board of robot `{name}` has two uses",
                    context.span(*loc, "firmware", *place),
                    label=f"also used as `{'.'.join(other)}`",
                    help=("assign another pin to one of them; docs/firmware.md shows the wiring",),
                )


def _sets(layer: Firmware, place: tuple[str, str]) -> bool:
    side, pin = place
    return getattr(getattr(layer, side), pin) is not None


@rule("BOARD011")
def wiring_without_sketch(context: RuleContext) -> Iterator[Diagnostic]:
    """Wiring for a robot whose sketch swarmctl does not generate."""
    for name, robot in context.spec.robots.items():
        if "firmware" not in robot.settings.model_fields_set:
            continue
        kind = context.native_robots.get(name)
        if kind is None or kind.sketch is None or kind.sketch.firmware is None:
            yield Diagnostic(
                "BOARD011",
                f"swarmctl generates no sketch for robot `{name}`, so `firmware` has no effect",
                context.span("robots", name, "settings", "firmware", key=True),
                label=f"`{robot.type}` has no `protocol.firmware`",
                help=("remove it, or choose a type with a generated sketch, such as arduino-rover",),
            )


@rule("BOARD012")
def sketch_limits(context: RuleContext) -> Iterator[Diagnostic]:
    """A baud rate or encoders that the generated sketch cannot handle."""
    for index, link, kind in context.native_lines:
        if kind.sketch is None or not kind.sketch.firmware:
            continue
        declared = link.own_baud
        dead_man = kind.sketch.firmware_timeout
        if trouble := wrong_baud(declared or kind.link.baud, dead_man):
            good = ", ".join(map(str, good_bauds(BAUDS, dead_man)))
            yield Diagnostic(
                "BOARD012",
                f"{trouble}: robot `{link.robot}` would not receive its commands",
                context.span("links", index, *(("baud",) if declared else ())),
                label="unsuitable for this board",
                help=(f"use one of {good}" if good else "raise `firmware_timeout`",),
            )
        yield from _too_many_pulses(context, link.robot, kind)


def _too_many_pulses(context: RuleContext, name: str, kind: RobotType) -> Iterator[Diagnostic]:
    """Reads each layer separately, since merging them for every robot is slow."""
    declared = [one.firmware.pulses_per_turn for one in reversed(context.document.settings_layers(name))]
    pulses = next((one for one in declared if one is not None), DEFAULTS.pulses_per_turn) or 0
    shape = kind.kinematics
    most = most_pulses(shape.wheel_speed_max, shape.wheel_radius or 1.0)
    if pulses > most:
        place = ("settings", "firmware", "pulses_per_turn") if declared[0] else ("type",)
        yield Diagnostic(
            "BOARD012",
            f"the board of robot `{name}` cannot count {pulses} pulses per turn "
            f"at {shape.wheel_speed_max:g} m/s",
            context.span("robots", name, *place),
            label=f"at most {most}",
            help=("use an encoder with fewer pulses, or set `wheel_speed_max` to the robot's real maximum",),
        )
