"""Who is told what, tick by tick: orders while somebody drives, then zeros, then silence. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

ZEROS = 5  # a stop is said so often, since one may be lost; then others may command


@dataclass(frozen=True)
class Twist:
    """Drive so: m/s forward, rad/s to the left."""

    linear: float
    angular: float


STOP = Twist(0.0, 0.0)
Orders = Tuple[Tuple[int, Twist], ...]


class Fanout:
    """One order for many robots, by their index."""

    def __init__(self, robots: int) -> None:
        self._zeros_due = [0] * robots

    def step(self, wanted: Twist | None, chosen: int | None = None) -> Orders:
        """What to say to whom now. ``chosen`` is the one that is driven, or nothing for all of them."""
        told = []
        for robot, due in enumerate(self._zeros_due):
            if wanted is not None and chosen in (None, robot):
                self._zeros_due[robot] = ZEROS
                told.append((robot, wanted))
            elif due:
                self._zeros_due[robot] = due - 1
                told.append((robot, STOP))
        return tuple(told)

    @property
    def silent(self) -> bool:
        """Whether everybody who was driven has been stopped."""
        return not any(self._zeros_due)
