"""Where something is on the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Pose:
    """Where something is on the ground, in m and rad."""

    x: float
    y: float
    theta: float

    def seen_from(self, origin: Pose) -> Pose:
        """This pose in the frame of ``origin``."""
        dx, dy = self.x - origin.x, self.y - origin.y
        sine, cosine = math.sin(origin.theta), math.cos(origin.theta)
        return Pose(dx * cosine + dy * sine, dy * cosine - dx * sine, wrapped(self.theta - origin.theta))


def wrapped(angle: float) -> float:
    return math.remainder(angle, math.tau)
