"""Who drives the course: every robot type that has an emulator, with each firmware that changes its units."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from swarm_driver.config import Config, Kinematics, Scale, parse

from motion_quality.papers import FORMULAS, Formula
from motion_quality.paths import Wheels
from swarmctl.lab.emulators import TYPES, Robot, emulator
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.params import params_of

#: Types that are another language of the same robot.
EMULATED_BY = {"epuck-binary": "epuck"}
#: Settings of an emulator that make another row of the same type.
VARIANTS: Mapping[str, Sequence[Mapping[str, Any]]] = {"khepera3": ({"firmware": 2}, {"firmware": 3})}
BOARD = "its board makes wheel speeds of orders; `tests/firmware` drives it, on a simulated board"
UNKNOWN = "it has no emulator"


@dataclass(frozen=True)
class Entrant:
    """A robot type with an emulated robot of it; ``formula`` is the papers' own, where they have one."""

    name: str
    config: Config
    scale: Scale
    wheels: Wheels
    make: Callable[[], Robot]
    formula: Formula | None


def left_out() -> dict[str, str]:
    """Types that do not drive here, each with the reason."""
    types = load_catalog().types
    boards = {name: BOARD for name in types if types[name].sketch}
    unknown = {name: UNKNOWN for name in types if _emulator_of(name) not in TYPES}
    return dict(sorted((unknown | boards).items()))


def entrants() -> Iterator[Entrant]:
    """By type and firmware."""
    types = load_catalog().types
    for name in sorted(types.keys() - left_out().keys()):
        params = params_of(types[name], robot="robot", namespace="/robot", port="/dev/robot")
        config = parse({**params, "commanders": []})
        for settings in VARIANTS.get(name, ({},)):
            scale = _scale(config, settings.get("firmware"))
            yield Entrant(
                name=", ".join([name, *(f"{key} {value}" for key, value in settings.items())]),
                config=config,
                scale=scale,
                wheels=_wheels(config.kinematics, scale),
                make=partial(emulator, _emulator_of(name), **settings),
                formula=FORMULAS.get(name),
            )


def _emulator_of(type_name: str) -> str:
    return EMULATED_BY.get(type_name, type_name)


def _wheels(kinematics: Kinematics, scale: Scale) -> Wheels:
    return Wheels(
        separation=kinematics.wheel_separation,
        fastest=kinematics.wheel_speed_max,
        unit=1 / scale.speed_units_per_mps,
        slowest=kinematics.wheel_speed_min,
    )


def _scale(config: Config, firmware: float | None) -> Scale:
    scale = config.kinematics.scale_for(firmware)
    if scale is None:
        raise ValueError(f"{config.title} needs a firmware among VARIANTS")
    return scale
