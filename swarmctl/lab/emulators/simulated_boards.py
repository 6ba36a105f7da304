"""Board files: the wiring of a simulated board that runs a robot's firmware."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from swarmctl.lab.emulators.uno import Motor
from swarmctl.lab.emulators.uno_rover import SimulatedBoard

BOARD_SUFFIX = ".board.json"


def write_board(
    firmware: Path, *, baud: int, wheel_radius: float, wheel_separation: float, left: Motor, right: Motor
) -> Path:
    """Writes the board file of ``firmware`` (Intel HEX); lengths in m. Returns its path."""
    board = {
        "firmware": str(firmware.resolve()),
        "baud": baud,
        "wheel_radius": wheel_radius,
        "wheel_separation": wheel_separation,
        "left": asdict(left),
        "right": asdict(right),
    }
    file = firmware.with_suffix(BOARD_SUFFIX).resolve()
    file.write_text(json.dumps(board, indent=2) + "\n", "utf-8")
    return file


def read_board(file: Path) -> SimulatedBoard:
    """Returns the board described by a file of ``write_board``, switched on."""
    board = json.loads(file.read_text("utf-8"))
    left, right = Motor(**board.pop("left")), Motor(**board.pop("right"))
    return SimulatedBoard(Path(board.pop("firmware")), **board, left=left, right=right)
