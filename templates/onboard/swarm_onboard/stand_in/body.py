"""The body of a stand-in: it moves by the velocity it was sent last. Knows no ROS and no clock."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence, Tuple

Axes = Tuple[float, float, float, float]  # along x, y and z, m/s; around z, rad/s
STANDS: Axes = (0.0, 0.0, 0.0, 0.0)
_STRAIGHT = 1e-9  # rad: a smaller turn counts as none


@dataclass(frozen=True)
class Pose:
    """Where the body is in its odometry frame: m, and rad counter-clockwise, not wrapped."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    theta: float = 0.0
    distance: float = 0.0  # m, the length of its path


class Body:
    """Holds its velocity until the next command, for ever: the worst that a vendor's driver does.

    ``limits`` are the fastest on each axis; 0 for an axis that it lacks. Each axis is clipped by itself, as
    the drivers of vendors do. A command with a component that is not a number is ignored.
    """

    def __init__(self, limits: Axes) -> None:
        self.pose = Pose()
        self.velocity = STANDS
        self.commands = 0
        self._limits = limits

    def command(self, axes: Sequence[float]) -> None:
        """Sets the velocity on all axes."""
        self.commands += 1
        if all(math.isfinite(one) for one in axes):
            x, y, z, turn = (max(-top, min(top, one)) for one, top in zip(axes, self._limits))
            self.velocity = (x, y, z, turn)

    def advance(self, seconds: float) -> None:
        """Moves along the arc that the velocity makes in ``seconds``."""
        forward, left, up, turn = self.velocity
        pose, angle = self.pose, turn * seconds
        if abs(angle) < _STRAIGHT:
            along, across = seconds, 0.0
        else:
            along, across = math.sin(angle) / turn, (1.0 - math.cos(angle)) / turn
        ahead, aside = forward * along - left * across, forward * across + left * along
        cos, sin = math.cos(pose.theta), math.sin(pose.theta)
        self.pose = Pose(
            pose.x + ahead * cos - aside * sin,
            pose.y + ahead * sin + aside * cos,
            pose.z + up * seconds,
            pose.theta + angle,
            pose.distance + math.sqrt(forward**2 + left**2 + up**2) * seconds,
        )


STEP = 0.02  # s, the longest step of the body
_SHORTEST = 0.001  # s: a faster rate than 1 kHz is not kept


class Schedule:
    """Topics with their rates in Hz from the moment ``began``, s; 0 for one message at the start.

    A late topic catches up with one message at most.
    """

    def __init__(self, rates: Sequence[float], began: float) -> None:
        self._periods = [1 / rate if rate > 0 else math.inf for rate in rates]
        self._due = [began] * len(self._periods)

    def ready(self, now: float) -> list[int]:
        """Returns the indexes of the topics that are due at ``now``, and plans their next message."""
        found = [index for index, due in enumerate(self._due) if due <= now]
        for index in found:
            self._due[index] = max(self._due[index] + self._periods[index], now)
        return found

    def pause(self, now: float) -> float:
        """Returns the time until the next topic is due, s; at most ``STEP``, the step of the body."""
        return min(STEP, max(_SHORTEST, min(self._due, default=math.inf) - now))
