"""The board behind a pty, in real time: what a program that opens the port meets."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable

import serial
from swarm_onboard.rosserial import frames

from swarmctl.lab.emulators.arduino_rover import SimulatedBoard
from swarmctl.lab.emulators.serial_robot import Port
from tests.timing import PATIENCE


def received(line: serial.Serial, awaited: bytes, seconds: float = PATIENCE) -> bytes:
    data, end = b"", time.monotonic() + seconds
    while awaited not in data and time.monotonic() < end:
        data += line.read(64)
    return data


def test_opening_the_port_resets_the_board_and_then_it_can_be_driven(
    boards: Callable[..., SimulatedBoard],
) -> None:
    board = boards(boot=0.3)
    with Port(board) as port, serial.Serial(str(port.path), 57600, timeout=0.05) as line:
        assert b"swarmctl firmware " in received(line, b"swarmctl firmware "), "it starts anew"
        output, end = b"", time.monotonic() + PATIENCE
        while (
            b"cmd_vel" not in output and time.monotonic() < end
        ):  # the boot loader drops what comes too early
            line.write(frames.REQUEST_TOPICS)
            output += received(line, b"cmd_vel", 0.5)
        assert b"cmd_vel" in output
        end = time.monotonic() + PATIENCE
        while port.snapshot().x < 0.05 and time.monotonic() < end:
            line.write(frames.encode(100, struct.pack("<6d", 0.3, 0, 0, 0, 0, 0)))
            line.read(64)
            time.sleep(0.05)
        assert port.snapshot().x >= 0.05
        end = time.monotonic() + PATIENCE
        while port.snapshot().v and time.monotonic() < end:
            line.read(64)
        assert port.snapshot().v == 0.0, "a lost command stops it"
