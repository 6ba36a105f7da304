"""The commands that both e-puck generations have in common, as text and binary."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping

from swarmctl.lab.emulators.epuck_body import EPuckBody, acknowledged
from swarmctl.lab.emulators.robot import reply
from swarmctl.lab.emulators.sercom import scan

CALIBRATION = (
    b"k, Starting calibration - Remove any object in sensors range\r\n"
    b"k, Calibration finished\r\n"
)  # fmt: skip
REMOTE_CONTROL = b"g IR check : 0x0, address : 0x0, data : 0x0\r\n"
WELCOME = (
    b"\f\aWELCOME to the SerCom protocol on e-Puck\r\n"
    b'the EPFL education robot type "H" for help\r\n'
)  # fmt: skip
HELP = b"\n" + b"".join(
    b'"%b"\t%b\r\n' % line
    for line in (
        (b"A", b"accelerometer"),
        (b"D,#,#", b"set speed left,right"),
        (b"E", b"speed left,right"),
        (b"N", b"proximity"),
        (b"Q", b"position left,right"),
        (b"S", b"stop, lights off"),
    )
)


# Text


def _body_light(robot: EPuckBody, parameters: str) -> None:
    robot.light[1] = _number(robot, parameters, robot.light[1])
    robot.set_light("body", robot.light[1])


def _front_light(robot: EPuckBody, parameters: str) -> None:
    robot.light[1] = _number(robot, parameters, robot.light[1])
    robot.set_light("front", robot.light[1])


def _ring(robot: EPuckBody, parameters: str) -> None:
    scan(parameters, robot.light, robot.int_bits)
    robot.set_lights_of_ring(*robot.light)


def _speeds(robot: EPuckBody, parameters: str) -> None:
    scan(parameters, robot.speeds, robot.int_bits)
    robot.take_up_speeds()


def _steps(robot: EPuckBody, parameters: str) -> None:
    scan(parameters, robot.positions, robot.int_bits)
    robot.set_steps(robot.positions)


def _stop(robot: EPuckBody, _: str) -> None:
    robot.chassis.drive(0.0, 0.0)
    robot.set_lights_of_ring(-1, 0)


def _sound(robot: EPuckBody, parameters: str) -> None:
    scan(parameters, robot.sound_number, robot.int_bits)
    robot.play(robot.sound_number[0])


def _number(robot: EPuckBody, parameters: str, before: int) -> int:
    values = [before]
    scan(parameters, values, robot.int_bits)
    return values[0]


def _calibrate(robot: EPuckBody, _: str) -> bytes:
    robot.set_lights_of_ring(-1, 0)
    return CALIBRATION


def _read_i2c(robot: EPuckBody, parameters: str) -> bytes:
    scan(parameters, robot.i2c, robot.int_bits)
    return reply("y", *robot.i2c[:2]) + reply("y", robot.background(20, 1)[0])


TEXTS: Mapping[str, Callable[..., bytes]] = {
    "A": lambda robot, _: reply("a", *robot.acceleration()),
    "B": acknowledged("b", _body_light),
    "C": lambda robot, _: reply("c", robot.selector),
    "D": acknowledged("d", _speeds),
    "E": lambda robot, _: reply("e", *robot.speeds),
    "F": acknowledged("f", _front_light),
    "G": lambda robot, _: REMOTE_CONTROL,
    "g": lambda robot, _: reply("g", *robot.rotation()),
    "H": lambda robot, _: HELP,
    "I": lambda robot, _: reply("i", *robot.image_settings, robot.image_size),
    "J": acknowledged("j", lambda robot, parameters: robot.set_images(parameters)),
    "K": _calibrate,
    "L": acknowledged("l", _ring),
    "M": lambda robot, _: reply("m", *robot.floor(5)),
    "N": lambda robot, _: reply("n", *robot.proximity()),
    "O": lambda robot, _: reply("o", *robot.ambient()),
    "P": acknowledged("p", _steps),
    "Q": lambda robot, _: reply("q", *robot.steps()),
    "S": acknowledged("s", _stop),
    "T": acknowledged("t", _sound),
    "U": lambda robot, _: reply("u", *robot.background(14, 3)),
    "W": acknowledged("w", lambda robot, parameters: scan(parameters, robot.i2c, robot.int_bits)),
    "Y": _read_i2c,
    "Z": lambda robot, _: b"192: 0\r\n",
}


# Binary

PAYLOADS = {"D": 4, "L": 2, "P": 4, "W": 3, "w": 35, "Y": 2}


def _binary_light(robot: EPuckBody, payload: bytes) -> bytes:
    number, action = payload
    if number in (8, 9):
        robot.set_light("body" if number == 8 else "front", action)
    else:
        robot.set_lights_of_ring(number, action)
    return b""


def _binary_steps(robot: EPuckBody, payload: bytes) -> bytes:
    robot.set_steps(struct.unpack("<2h", payload))
    return b""


def low16(values: list[int]) -> bytes:
    """Returns the low 16 bits of each value, little-endian."""
    return struct.pack(f"<{len(values)}H", *(value & 0xFFFF for value in values))


BINARIES: Mapping[str, Callable[..., bytes]] = {
    "a": lambda robot, _: low16(robot.acceleration()),
    "A": lambda robot, _: struct.pack("<3f", *robot.spherical()),
    "E": lambda robot, _: low16(robot.speeds),
    "g": lambda robot, _: low16(robot.rotation()),
    "I": lambda robot, _: robot.image(),
    "L": _binary_light,
    "N": lambda robot, _: low16(robot.proximity()),
    "O": lambda robot, _: low16(robot.ambient()),
    "P": _binary_steps,
    "Q": lambda robot, _: low16(robot.steps()),
    "u": lambda robot, _: low16(robot.background(14, 3)),
    "W": lambda robot, _: b"",
    "w": lambda robot, _: b"",
    "Y": lambda robot, _: bytes([robot.background(20, 1)[0]]),
}
