"""The simulated Arduino UNO as a process: `uno.c` compiled once, then an answer to each request."""

from __future__ import annotations

import hashlib
import shutil
import struct
import subprocess
import tempfile
from dataclasses import astuple, dataclass
from enum import IntFlag
from functools import cache
from pathlib import Path

from swarmctl.lab.errors import LabError
from swarmctl.resources import cache_folder

SOURCE = Path(__file__).with_name("uno.c")
_REQUEST = struct.Struct("<IIffII")
_ANSWER = struct.Struct("<5d2i4I")


class Fault(IntFlag):
    """What can happen to a board. RESET and HANG happen once; the others last as long as they are set."""

    NONE = 0
    LEFT_WIRE_BROKEN, LEFT_STALLED, LEFT_NOISE = 1, 2, 4  # the wire is the encoder's
    RIGHT_WIRE_BROKEN, RIGHT_STALLED, RIGHT_NOISE = 16, 32, 64
    RESET = 0x100  # the button, or the DTR line
    HANG = 0x200  # the program hangs with interrupts off
    HELD = 0x400  # its boot loader runs


@dataclass(frozen=True)
class Motor:
    """One motor, its disc and the pins they are on. Speeds in rad/s of the wheel, PWM of 255, times in s.

    ``dead`` is the PWM up to which it does not turn; ``free`` its speed at full PWM without load; ``lag``,
    ``brake`` and ``coast`` are time constants: driven, with its ends shorted, and with its ends open.
    """

    encoder: int
    enable: int
    forward: int
    backward: int
    pulses: int = 20
    free: float = 18.5
    dead: float = 60.0
    lag: float = 0.12
    brake: float = 0.04
    coast: float = 0.25

    def __str__(self) -> str:
        return ",".join(map(str, astuple(self)))


LEFT = Motor(encoder=2, enable=5, forward=7, backward=8)
RIGHT = Motor(encoder=3, enable=6, forward=11, backward=12)


@dataclass(frozen=True)
class Truth:
    """What the board and its wheels did: angles in rad, speeds in rad/s, left first; ``time`` in seconds.

    ``stack`` is the maximum stack of the firmware, bytes; ``resets`` counts those of the watchdog.
    """

    angles: tuple[float, float]
    speeds: tuple[float, float]
    time: float
    drives: tuple[int, int]
    resets: int
    stack: int
    baud: int


class Uno:
    """One board, without a program yet. Time passes only in ``run``: the same calls give the same answers."""

    def __init__(self, *, baud: int, left: Motor, right: Motor) -> None:
        self._process = subprocess.Popen(
            [program(), str(baud), str(left), str(right)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    def run(
        self, us: int, data: bytes, faults: Fault, load: tuple[float, float], flash: bytes = b""
    ) -> tuple[Truth, bytes]:
        """Feeds ``data`` to the UART at its baud rate and runs ``us`` microseconds.

        Returns state and output.

        ``load`` is the part of each motor's speed that its load takes, 0..1; ``flash`` is written to the
        flash first, from address 0. Raises ``LabError``.
        """
        pipe_in, pipe_out = self._process.stdin, self._process.stdout
        assert pipe_in is not None
        assert pipe_out is not None
        try:
            pipe_in.write(_REQUEST.pack(us, faults, *load, len(data), len(flash)) + data + flash)
            pipe_in.flush()
            head = pipe_out.read(_ANSWER.size)
            *numbers, count = _ANSWER.unpack(head)
        except (OSError, struct.error):
            raise LabError(f"the simulated board ended with exit code {self._process.wait()}") from None
        angles, speeds, us_passed, drives = numbers[0:2], numbers[2:4], numbers[4], numbers[5:7]
        truth = Truth(tuple(angles), tuple(speeds), us_passed / 1e6, tuple(drives), *numbers[7:])
        return truth, pipe_out.read(count)

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()


def image(firmware: Path) -> bytes:
    """Returns the flash contents of an Intel HEX file, from address 0. Raises ``LabError``."""
    found = bytearray()
    try:
        for line in firmware.read_text("ascii").split():
            count, high, low, kind, *data, _ = bytes.fromhex(line.removeprefix(":"))
            at = high << 8 | low
            if kind == 0:
                found.extend(b"\xff" * (at - len(found)))
                found[at : at + count] = data
    except (OSError, ValueError) as error:
        raise LabError(f"{firmware} is not a valid HEX file: {error}") from None
    return bytes(found)


@cache
def program() -> str:
    """Returns the path of the compiled simulator, cached by its source. Raises ``LabError``."""
    if shutil.which("gcc") is None:
        raise LabError("gcc is missing; it compiles the simulated board", "sudo apt install gcc libc6-dev")
    source = SOURCE.read_bytes()
    target = cache_folder() / f"uno-{hashlib.sha256(source).hexdigest()[:16]}"
    if not target.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            made = Path(folder) / "uno"
            _compile(made)
            made.replace(target)
    return str(target)


def _compile(target: Path) -> None:
    ran = subprocess.run(
        ["gcc", "-O2", "-std=gnu11", "-o", str(target), str(SOURCE), "-lsimavr", "-lm"],
        capture_output=True,
        text=True,
        check=False,
    )
    if ran.returncode:
        if "simavr" in ran.stderr:
            raise LabError("libsimavr is missing; it runs the firmware", "sudo apt install libsimavr-dev")
        raise LabError("the simulated board does not compile", *ran.stderr.splitlines()[:10])
