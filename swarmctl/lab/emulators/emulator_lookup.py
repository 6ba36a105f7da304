"""Maps robot types to emulators: a built-in one, or the user's file beside the robot type."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from swarmctl.lab.emulators import TYPES, Robot
from swarmctl.lab.emulators.arduino_rover import BOARD_SUFFIX, read_board
from swarmctl.lab.emulators.robot import SilentRobot
from swarmctl.lab.emulators.user_robot import build_user_robot, load_robot_class

EMULATED_AS = {"epuck-binary": "epuck"}  # types that are another protocol of the same robot
EMULATOR_SUFFIX = ".emulator.py"  # robots/beetle.yaml has its emulator in robots/beetle.emulator.py


@dataclass(frozen=True)
class Measured:
    """The calibration in the spec. The emulated robot really has these values, so its odometry is right."""

    distance_scale: float = 1.0
    wheel_separation: float = 0.0  # m; 0: that of the type


NOT_MEASURED = Measured()


def user_emulators(folder: Path) -> dict[str, Path]:
    """Returns the emulator files in a folder of robot types, by type."""
    return {
        file.name.removesuffix(EMULATOR_SUFFIX): file.resolve()
        for file in sorted(folder.glob(f"*{EMULATOR_SUFFIX}"))
    }


def emulator_for(type_name: str, own: Mapping[str, Path]) -> str:
    """Returns the path of the user's emulator of a type, or a built-in type; empty if there is none."""
    if type_name in own:
        return str(own[type_name])
    builtin = EMULATED_AS.get(type_name, type_name)
    return builtin if builtin in TYPES else ""


def build_robot(emulator: str, measured: Measured = NOT_MEASURED) -> Robot:
    """Builds a robot at rest from the result of ``emulator_for`` or the path of a board file.

    The wheels of a board file are calibrated already. Raises ``UserRobotError`` for a wrong emulator file.
    """
    if emulator == SilentRobot.type_name:
        return SilentRobot()
    if emulator.endswith(BOARD_SUFFIX):
        return read_board(Path(emulator))
    robot = build_user_robot(
        load_robot_class(Path(emulator)) if emulator.endswith(EMULATOR_SUFFIX) else TYPES[emulator], {}
    )
    robot.chassis.distance_scale = measured.distance_scale
    robot.chassis.wheel_separation = measured.wheel_separation or robot.chassis.wheel_separation
    return robot
