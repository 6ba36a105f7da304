"""A rover with a simulated Arduino UNO: real firmware drives its motors and counts its pulses."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from swarmctl.lab.emulators.bootloader import FLASH, WAIT, Bootloader
from swarmctl.lab.emulators.differential_drive import Chassis
from swarmctl.lab.emulators.robot import Robot
from swarmctl.lab.emulators.uno import LEFT, RIGHT, Fault, Motor, Truth, Uno, image

SLICE = 0.002  # s; the period of reading the board, and the length of the arcs of its path


class SimulatedBoard(Robot):
    """A differential drive whose board runs ``firmware``, an Intel HEX file for an ATmega328P at 16 MHz.

    The board sends at its own pace, so ``replies`` returns nothing: all output comes from ``unsolicited``.
    ``faults`` and ``load`` may be set at any time. After a reset from outside its boot loader runs, for
    ``boot`` seconds without input. It is a process: call ``close`` at the end.
    """

    type_name: ClassVar[str] = "arduino-rover"
    refusal = b""
    uses_rosserial: ClassVar[bool] = True

    def __init__(
        self,
        firmware: Path,
        *,
        baud: int = 57600,
        wheel_radius: float = 0.0325,
        wheel_separation: float = 0.13,
        left: Motor = LEFT,
        right: Motor = RIGHT,
        boot: float = WAIT,
    ) -> None:
        super().__init__(Chassis(wheel_separation=wheel_separation, metres_per_count=1.0, counter_bits=32))
        self.faults = Fault.NONE
        self.load = (0.0, 0.0)
        self._radius = wheel_radius
        program = image(firmware)
        self.bootloader = Bootloader(bytearray(program.ljust(FLASH, b"\xff")), boot)
        self._uno = Uno(baud=baud, left=left, right=right)
        self._truth, self._output = self._uno.run(0, b"", self.faults, self.load, program)
        self._received = b""
        self._time = 0.0  # s, as requested; the board's own follows it to the microsecond
        self._since_read = 0.0

    @property
    def truth(self) -> Truth:
        """The true state of the board and its wheels."""
        return self._truth

    def replies(self, data: bytes) -> list[bytes]:
        """Sends bytes to the board's UART; its answers come later, by ``unsolicited``."""
        self._received += data
        if data:
            self._note(data.hex())
        return []

    def power_cycle(self) -> bytes:
        """Presses the reset button: pins are released and the boot loader starts. The wheels roll on."""
        self.bootloader.enter()
        self._run(0, Fault.RESET)
        return b""

    def opened(self) -> None:
        """The DTR line is wired to the reset, as on every UNO."""
        self.power_cycle()

    def closed(self) -> None:
        """The board does not notice."""

    def crash(self) -> None:
        """Makes the program hang, as a broken one might."""
        self._run(0, Fault.HANG)

    def advance(self, dt: float) -> None:
        while dt > 0.0:
            step = min(dt, SLICE)
            self._step(step)
            dt -= step

    def unsolicited_due(self) -> float:
        return max(0.0, SLICE - self._since_read)

    def unsolicited(self) -> list[bytes]:
        self._since_read = 0.0
        output, self._output = self._output, b""
        return [output] if output else []

    def close(self) -> None:
        """Ends the simulator process."""
        self._uno.close()

    def _step(self, dt: float) -> None:
        before = self._truth.angles
        self._time += dt
        self._since_read += dt
        if self.bootloader.active:
            self._load(dt)
        self._run(max(0, round((self._time - self._truth.time) * 1e6)))
        rolled = (after - angle for after, angle in zip(self._truth.angles, before, strict=True))
        left, right = (angle * self._radius for angle in rolled)
        self.chassis.drive(left / dt, right / dt)
        self.chassis.advance(dt)
        self.chassis.drive(*(speed * self._radius for speed in self._truth.speeds))

    def _load(self, dt: float) -> None:
        """Runs the boot loader; when it ends, the sketch in the flash starts."""
        loader = self.bootloader
        received, self._received = self._received, b""
        self._output += loader.run_for(dt, received)
        if not loader.active:
            self._run(0, Fault.RESET, bytes(loader.memory) if loader.has_written else b"")
            loader.has_written = False

    def _run(self, us: int, once: Fault = Fault.NONE, flash: bytes = b"") -> None:
        faults, received = self.faults | once, b""
        if self.bootloader.active:
            faults |= Fault.HELD
        else:
            received, self._received = self._received, b""
        self._truth, output = self._uno.run(us, received, faults, self.load, flash)
        self._output += output
