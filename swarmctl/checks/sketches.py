"""The sketches that swarmctl writes: wired so that they can work, and asked of robots that have one."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.checks.lines import BAUDS
from swarmctl.spec.diagnostics import Diagnostic
from swarmctl.spec.firmware import DEFAULTS, Firmware, clashes
from swarmctl.spec.model import Serial
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.settings import merged
from swarmctl.topology.sketches import good_bauds, most_pulses, wrong_baud


def pins_used_twice(case: Case) -> Iterator[Diagnostic]:
    """BOARD010: each pin of a board has one use."""
    general = case.spec.defaults.robot
    ours = {name for name, kind in case.types.items() if kind.sketch is not None and kind.sketch.firmware}
    for name, robot in case.spec.robots.items() if ours else ():
        if robot.type not in ours:
            continue
        layers = {("robots", name, "settings"): robot.settings, ("defaults", "robot"): general}
        said = {loc: one.firmware for loc, one in layers.items() if "firmware" in one.model_fields_set}
        if not said:
            continue
        wiring = merged(general, case.types[robot.type].settings, robot.settings).firmware
        for second, first, pin in clashes(wiring):
            places = ((loc, one) for loc in said for one in (second, first) if _says(said[loc], one))
            loc, place = next(places, ((), ()))
            if place:
                other = first if place == second else second
                yield Diagnostic(
                    "BOARD010",
                    f"pin {pin} of robot `{name}`'s board has two uses",
                    case.span(*loc, "firmware", *place),
                    label=f"it is `{'.'.join(other)}` too",
                    help=("give one of them another pin; docs/firmware.md shows the wiring",),
                )


def _says(layer: Firmware, place: tuple[str, str]) -> bool:
    side, pin = place
    return getattr(getattr(layer, side), pin) is not None


def wiring_of_nothing(case: Case) -> Iterator[Diagnostic]:
    """BOARD011: a sketch is described only where swarmctl writes it."""
    for name, robot in case.spec.robots.items():
        if "firmware" not in robot.settings.model_fields_set:
            continue
        kind = case.types[robot.type]
        if kind.sketch is None or kind.sketch.firmware is None:
            yield Diagnostic(
                "BOARD011",
                f"swarmctl writes no sketch for robot `{name}`",
                case.span("robots", name, "settings", "firmware", key=True),
                label=f"`{robot.type}` has no `protocol.firmware`",
                help=("remove it, or choose a type whose sketch is swarmctl's, like arduino-rover",),
            )


def more_than_it_bears(case: Case) -> Iterator[Diagnostic]:
    """BOARD012: the line and the encoders are ones that our sketch keeps up with."""
    ours = {name: one for name, one in case.types.items() if one.sketch is not None and one.sketch.firmware}
    for index, link in case.lines if ours else ():
        kind = ours.get(case.spec.robots[link.robot].type)
        if kind is None or kind.sketch is None:
            continue
        said = link.baud if isinstance(link, Serial) else None
        dead_man = kind.sketch.firmware_timeout
        if trouble := wrong_baud(said or kind.link.baud, dead_man):
            good = ", ".join(map(str, good_bauds(BAUDS, dead_man)))
            yield Diagnostic(
                "BOARD012",
                f"{trouble}: robot `{link.robot}` would not hear its orders",
                case.span("links", index, *(("baud",) if said else ())),
                label="not for this board",
                help=(f"one of these works: {good}" if good else "raise `firmware_timeout`",),
            )
        yield from _too_many_pulses(case, link.robot, kind)


def _too_many_pulses(case: Case, name: str, kind: RobotType) -> Iterator[Diagnostic]:
    """Layers are looked at one by one: to merge them for each robot takes long."""
    layers = (case.spec.robots[name].settings, kind.settings, case.spec.defaults.robot)
    said = [one.firmware.pulses_per_turn for one in layers]
    pulses = next((one for one in said if one is not None), DEFAULTS.pulses_per_turn) or 0
    shape = kind.kinematics
    most = most_pulses(shape.wheel_speed_max, shape.wheel_radius or 1.0)
    if pulses > most:
        place = ("settings", "firmware", "pulses_per_turn") if said[0] else ("type",)
        yield Diagnostic(
            "BOARD012",
            f"the board of robot `{name}` cannot count {pulses} pulses a turn "
            f"at {shape.wheel_speed_max:g} m/s",
            case.span("robots", name, *place),
            label=f"it can count {most}",
            help=("take the pulses from a slower shaft, or write the speed that the robot really reaches",),
        )


RULES: tuple[Rule, ...] = (pins_used_twice, wiring_of_nothing, more_than_it_bears)
