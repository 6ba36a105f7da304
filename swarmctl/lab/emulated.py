"""Which emulator stands for a robot of which type: one of ours, or a file of one's own beside the type."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from swarmctl.lab.boards import WIRED, board_of
from swarmctl.lab.emulators import TYPES, Robot
from swarmctl.lab.emulators.own import built, load

SAME_ROBOT = {"epuck-binary": "epuck"}  # types that are other ways to speak to a robot of another type
OWN = ".emulator.py"  # robots/beetle.yaml has its emulator in robots/beetle.emulator.py


def own_emulators(folder: Path) -> dict[str, Path]:
    """The emulators that lie in a folder of robot types, by type."""
    return {file.name.removesuffix(OWN): file.resolve() for file in sorted(folder.glob(f"*{OWN}"))}


def emulator_of(type_name: str, own: Mapping[str, Path]) -> str:
    """What emulates a robot of this type: the path of a file, or a type of ours; nothing if there is none."""
    if type_name in own:
        return str(own[type_name])
    ours = SAME_ROBOT.get(type_name, type_name)
    return ours if ours in TYPES else ""


def robot_of(emulator: str) -> Robot:
    """A robot at rest: what ``emulator_of`` has found, or what ``boards.wired`` has written.

    Raises ``OwnRobotError`` for a wrong file.
    """
    if emulator.endswith(WIRED):
        return board_of(Path(emulator))
    return built(load(Path(emulator)) if emulator.endswith(OWN) else TYPES[emulator], {})
