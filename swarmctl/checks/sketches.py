"""The sketches that swarmctl writes: wired so that they can work, and asked of robots that have one."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic
from swarmctl.spec.firmware import Firmware, clashes
from swarmctl.spec.settings import merged


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


RULES: tuple[Rule, ...] = (pins_used_twice, wiring_of_nothing)
