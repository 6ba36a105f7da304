"""The e-puck's binary requests: negative letters, chained, ended by a zero; answers are unframed."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from swarmctl.lab.emulators.epuck import EPuck

PAYLOAD_SIZES = {"D": 4, "L": 2, "P": 4, "W": 3, "w": 35}
SOUND_SAMPLES = 600
BATTERY = 2400  # 2070 is empty, 2560 full


def letter_of(byte: int) -> str:
    """The command behind a byte: its negative as a character."""
    return chr(-byte & 0xFF)


def answer_binary(robot: EPuck, letter: str, payload: bytes) -> tuple[bytes, bytes]:
    """What is sent at once, and what is added to the answer sent at the end. Unknown letters are ignored."""
    if letter == "D":
        robot.speeds[:] = struct.unpack("<2h", payload)
        robot.take_up_speeds()
    elif letter == "P":
        robot.set_steps(struct.unpack("<2h", payload))
    elif letter == "U":
        return bytes(robot.background(128, SOUND_SAMPLES)), bytes([SOUND_SAMPLES // 6 - 1])
    read = READINGS.get(letter)
    return b"", read(robot) if read else b""


def _spherical(robot: EPuck) -> bytes:
    """Acceleration, orientation and inclination in degrees."""
    sideways, ahead, up = robot.acceleration()
    inclination = math.degrees(math.atan2(math.hypot(sideways, ahead), up))
    orientation = math.degrees(math.atan2(sideways, ahead))
    return struct.pack("<3f", math.hypot(sideways, ahead, up), orientation, inclination)


READINGS: dict[str, Callable[[EPuck], bytes]] = {
    "a": lambda robot: struct.pack("<3h", *robot.acceleration()),
    "A": _spherical,
    "b": lambda robot: struct.pack("<H", BATTERY),
    "E": lambda robot: struct.pack("<2h", *robot.speeds),
    "g": lambda robot: struct.pack("<3h", *robot.rotation()),
    "I": lambda robot: robot.image(),
    "M": lambda robot: struct.pack("<5H", *robot.floor()),
    "N": lambda robot: struct.pack("<8H", *robot.proximity()),
    "O": lambda robot: struct.pack("<8H", *robot.ambient()),
    "Q": lambda robot: struct.pack("<2h", *robot.steps()),
    "t": lambda robot: struct.pack("<b", 24),
    "u": lambda robot: struct.pack("<3H", *robot.volumes()),
}
