"""A robot's own firmware on a simulated board: what a lab is told of it, in a file beside the firmware."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from swarmctl.lab.emulators.board import SimulatedBoard
from swarmctl.lab.emulators.uno import Motor

WIRED = ".board.json"


def wired(
    firmware: Path, *, baud: int, wheel_radius: float, wheel_separation: float, left: Motor, right: Motor
) -> Path:
    """Write down what hangs on the board that runs ``firmware`` (Intel HEX); lengths in m. Gives the file."""
    told = {
        "firmware": str(firmware.resolve()),
        "baud": baud,
        "wheel_radius": wheel_radius,
        "wheel_separation": wheel_separation,
        "left": asdict(left),
        "right": asdict(right),
    }
    file = firmware.with_suffix(WIRED).resolve()
    file.write_text(json.dumps(told, indent=2) + "\n", "utf-8")
    return file


def board_of(file: Path) -> SimulatedBoard:
    """The board that ``wired`` has written down, switched on."""
    told = json.loads(file.read_text("utf-8"))
    left, right = Motor(**told.pop("left")), Motor(**told.pop("right"))
    return SimulatedBoard(Path(told.pop("firmware")), **told, left=left, right=right)
