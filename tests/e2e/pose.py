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


def printed(output: str) -> Pose:
    """The pose that ``rostopic echo -p`` has printed."""
    keys, values = output.strip().splitlines()
    found = dict(zip(keys.split(","), map(float, values.split(",")), strict=True))
    turn = 2 * math.atan2(found["field.orientation.z"], found["field.orientation.w"])
    return Pose(found["field.position.x"], found["field.position.y"], wrapped(turn))


def wrapped(angle: float) -> float:
    return math.remainder(angle, math.tau)
