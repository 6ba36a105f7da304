"""Which emulator stands for a robot of which type: one of ours, or a file of one's own beside the type."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from swarmctl.lab.boards import WIRED, board_of
from swarmctl.lab.emulators import TYPES, Robot
from swarmctl.lab.emulators.own import built, load

SAME_ROBOT = {"epuck-binary": "epuck"}  # types that are other ways to speak to a robot of another type
OWN = ".emulator.py"  # robots/beetle.yaml has its emulator in robots/beetle.emulator.py


@dataclass(frozen=True)
class Measured:
    """What a spec says was measured on a robot: in a lab that is how it really is, so odometry is right."""

    distance_scale: float = 1.0
    wheel_separation: float = 0.0  # m; that of its type for 0


AS_ITS_TYPE = Measured()


def own_emulators(folder: Path) -> dict[str, Path]:
    """The emulators that lie in a folder of robot types, by type."""
    return {file.name.removesuffix(OWN): file.resolve() for file in sorted(folder.glob(f"*{OWN}"))}


def emulator_of(type_name: str, own: Mapping[str, Path]) -> str:
    """What emulates a robot of this type: the path of a file, or a type of ours; nothing if there is none."""
    if type_name in own:
        return str(own[type_name])
    ours = SAME_ROBOT.get(type_name, type_name)
    return ours if ours in TYPES else ""


def robot_of(emulator: str, measured: Measured = AS_ITS_TYPE) -> Robot:
    """A robot at rest: what ``emulator_of`` has found, or what ``boards.wired`` has written.

    A board's wheels are as the spec has them already. Raises ``OwnRobotError`` for a wrong file.
    """
    if emulator.endswith(WIRED):
        return board_of(Path(emulator))
    robot = built(load(Path(emulator)) if emulator.endswith(OWN) else TYPES[emulator], {})
    robot.chassis.stretch = measured.distance_scale
    robot.chassis.wheel_separation = measured.wheel_separation or robot.chassis.wheel_separation
    return robot
