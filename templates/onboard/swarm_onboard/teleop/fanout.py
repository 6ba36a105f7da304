"""The commands of each tick: the driver's while one drives, then zeros, then none. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

ZEROS = 5  # a stop is sent so often, since one may be lost; then others may command


@dataclass(frozen=True)
class Twist:
    """A command: m/s forward, rad/s to the left."""

    linear: float
    angular: float


STOP = Twist(0.0, 0.0)
Commands = Tuple[Tuple[int, Twist], ...]


class Fanout:
    """One command for many robots, by their index."""

    def __init__(self, robots: int) -> None:
        self._zeros_due = [0] * robots

    def step(self, wanted: Twist | None, chosen: int | None = None) -> Commands:
        """Returns the commands of this tick. ``chosen`` is the robot that is driven, None for all of them."""
        commands = []
        for robot, due in enumerate(self._zeros_due):
            if wanted is not None and chosen in (None, robot):
                self._zeros_due[robot] = ZEROS
                commands.append((robot, wanted))
            elif due:
                self._zeros_due[robot] = due - 1
                commands.append((robot, STOP))
        return tuple(commands)

    @property
    def silent(self) -> bool:
        """Whether every robot that was driven has been stopped."""
        return not any(self._zeros_due)
