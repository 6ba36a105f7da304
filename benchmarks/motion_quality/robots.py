"""Who drives the course: every robot type that has an emulator, with each firmware that changes its units."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from swarm_onboard.driver.config import Config, Kinematics, parse
from swarm_onboard.driver.protocols import RosserialProtocol

from motion_quality.papers import FORMULAS, Formula, OnBoard
from motion_quality.paths import Wheels
from swarmctl.lab.emulators import TYPES, Robot, emulator
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.driver_params import params_of
from swarmctl.spec.catalog import load_catalog

#: Types that are another language of the same robot.
EMULATED_BY = {"epuck-binary": "epuck"}
#: Settings of an emulator that make another row of the same type.
VARIANTS: Mapping[str, Sequence[Mapping[str, Any]]] = {"khepera3": ({"firmware": 2}, {"firmware": 3})}
BOARD_STEP = 1e-6  # m/s: a command to a board is a fraction, not a whole number of units
UNKNOWN = "it has no emulator"


@dataclass(frozen=True)
class Entrant:
    """A robot type with an emulated robot of it; ``formula`` is the papers' own, where they have one."""

    name: str
    config: Config
    count: float  # m of a wheel's way for one count of it
    wheels: Wheels
    make: Callable[[], Robot]
    formula: Formula | OnBoard | None


def left_out() -> dict[str, str]:
    """Types that do not drive here, each with the reason."""
    types = with_protocol(load_catalog().types)
    return {name: UNKNOWN for name in sorted(types) if _emulator_of(name) not in TYPES}


def entrants() -> Iterator[Entrant]:
    """By type and firmware."""
    types = with_protocol(load_catalog().types)
    for name in sorted(types.keys() - left_out().keys()):
        params = params_of(types[name], robot="robot", namespace="/robot", port="/dev/robot")
        config = parse({**params, "commanders": []})
        for settings in VARIANTS.get(name, ({},)):
            unit, count = _units(config, settings.get("firmware"))
            yield Entrant(
                name=", ".join([name, *(f"{key} {value}" for key, value in settings.items())]),
                config=config,
                count=count,
                wheels=_wheels(config.kinematics, unit),
                make=partial(emulator, _emulator_of(name), **settings),
                formula=FORMULAS.get(name),
            )


def _emulator_of(type_name: str) -> str:
    return EMULATED_BY.get(type_name, type_name)


def _wheels(kinematics: Kinematics, unit: float) -> Wheels:
    return Wheels(
        separation=kinematics.wheel_separation,
        fastest=kinematics.wheel_speed_max,
        unit=unit,
        slowest=kinematics.wheel_speed_min,
    )


def _units(config: Config, firmware: float | None) -> tuple[float, float]:
    """One step of the commanded speed (m/s), and one count of a wheel (m)."""
    if isinstance(config.protocol, RosserialProtocol):
        ticks = config.protocol.ticks
        assert ticks is not None  # the catalog's rover counts
        return BOARD_STEP, math.tau * ticks.wheel_radius / ticks.counts_per_turn
    scale = config.kinematics.scale_for(firmware)
    if scale is None:
        raise ValueError(f"{config.title} needs a firmware among VARIANTS")
    return 1 / scale.speed_units_per_mps, scale.metres_per_count
