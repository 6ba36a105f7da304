"""Robots that answer on a pty as their manuals say, and move as their wheels turn."""

from __future__ import annotations

from typing import Any

from swarmctl.lab.emulators.epuck import EPuck
from swarmctl.lab.emulators.khepera3 import Khepera3
from swarmctl.lab.emulators.koala import Koala
from swarmctl.lab.emulators.robot import Robot, State

TYPES: dict[str, type[Robot]] = {robot.type_name: robot for robot in (Koala, Khepera3, EPuck)}


def emulator(type_name: str, **options: Any) -> Robot:
    """A robot of ``type_name``, at rest.

    All take ``pose``, ``walls`` and ``wheel_separation``, a khepera3 also ``firmware``. Raises ``KeyError``
    for a type that is not in ``TYPES``, ``TypeError`` or ``ValueError`` for a wrong option.
    """
    return TYPES[type_name](**options)


__all__ = ["TYPES", "Robot", "State", "emulator"]
