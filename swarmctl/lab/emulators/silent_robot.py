"""A robot that answers nothing: its line exists, but a stand-in moves it."""

from __future__ import annotations

from swarmctl.lab.emulators.differential_drive import Chassis
from swarmctl.lab.emulators.robot import Robot


class SilentRobot(Robot):
    """Takes every byte and stands still."""

    type_name = "silent"

    def __init__(self) -> None:
        super().__init__(Chassis(wheel_separation=1.0, metres_per_count=1.0, counter_bits=32))

    def replies(self, data: bytes) -> list[bytes]:
        return []
