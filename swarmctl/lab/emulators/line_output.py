"""The output of a robot's line: its answers with the faults of the line applied."""

from __future__ import annotations

from random import Random

from swarmctl.lab.emulators.robot import Robot
from swarmctl.lab.emulators.serial_faults import Faults

Pieces = list[tuple[float, bytes]]  # each with the seconds to wait before it


class Line:
    """A robot and the faults of its line.

    Setting ``faults`` restarts their random sequence with their seed.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._faults = Faults()
        self._random = Random()

    @property
    def faults(self) -> Faults:
        """The faults that the line injects."""
        return self._faults

    @faults.setter
    def faults(self, faults: Faults) -> None:
        self._faults = faults.checked(uses_rosserial=self.robot.uses_rosserial)
        self._random = Random(faults.seed)

    def sent(self, answer: bytes, refusal: bytes | None = None) -> Pieces | None:
        """Returns what is sent instead of ``answer``; None if the cable is disconnected instead.

        Unsolicited output has no ``refusal``.
        """
        if self._faults.strikes(self._faults.vanish, self._random):
            return None
        if self._faults.strikes(self._faults.banner, self._random):
            return [(0.0, self.robot.power_cycle())]
        frame = self.robot.corrupt(answer, self._faults, self._random)
        return self._faults.pieces(frame, refusal, self._random)
