"""Emulated robots: they answer on a pty as in their manuals, and move as their wheels turn.

Write your own as a class derived from ``LineRobot``; see docs/emulators.md.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from swarmctl.lab.emulators.arduino_rover import ArduinoRover
from swarmctl.lab.emulators.differential_drive import Chassis, Sensor, Wall, distance
from swarmctl.lab.emulators.emulator_settings import build
from swarmctl.lab.emulators.epuck import EPuck
from swarmctl.lab.emulators.epuck2 import EPuck2
from swarmctl.lab.emulators.fault_script import play, read_script
from swarmctl.lab.emulators.khepera3 import Khepera3
from swarmctl.lab.emulators.koala import Koala
from swarmctl.lab.emulators.koala25 import Koala25
from swarmctl.lab.emulators.robot import LineRobot, Robot, State, reply
from swarmctl.lab.emulators.virtual_time import VirtualPort

TYPES: dict[str, type[Robot]] = {
    robot.type_name: robot for robot in (Koala, Koala25, Khepera3, EPuck, EPuck2, ArduinoRover)
}


def emulator(
    type_name: str,
    *,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    walls: Iterable[Wall] = (),
    **settings: Any,
) -> Robot:
    """Returns a robot of ``type_name`` at rest.

    Raises ``KeyError`` for a type that is not in ``TYPES``, ``ValueError`` for a wrong setting.
    """
    robot = build(TYPES[type_name], settings)
    robot.chassis.place(*pose)
    robot.walls = tuple(walls)
    return robot


__all__ = [
    "TYPES",
    "Chassis",
    "LineRobot",
    "Robot",
    "Sensor",
    "State",
    "VirtualPort",
    "Wall",
    "distance",
    "emulator",
    "play",
    "read_script",
    "reply",
]
