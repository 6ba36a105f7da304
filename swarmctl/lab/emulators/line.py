"""What comes out of a robot's line: its answers, with the faults they meet on the way."""

from __future__ import annotations

from random import Random

from swarmctl.lab.emulators.faults import Faults
from swarmctl.lab.emulators.robot import Robot

Pieces = list[tuple[float, bytes]]  # each with the seconds to wait before it


class Line:
    """One robot and the faults of its line, which may be set at any time and begin anew with their seed."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._faults = Faults()
        self._random = Random()

    @property
    def faults(self) -> Faults:
        return self._faults

    @faults.setter
    def faults(self, faults: Faults) -> None:
        self._faults = faults.fitting(self.robot)
        self._random = Random(faults.seed)

    def sent(self, answer: bytes, refusal: bytes | None = None) -> Pieces | None:
        """What goes out in place of ``answer``; None if the cable is pulled instead.

        Only what was asked for has a ``refusal``.
        """
        if self._faults.strikes(self._faults.vanish, self._random):
            return None
        if self._faults.strikes(self._faults.banner, self._random):
            return [(0.0, self.robot.power_cycle())]
        frame = self.robot.spoilt(answer, self._faults, self._random)
        return self._faults.pieces(frame, refusal, self._random)
