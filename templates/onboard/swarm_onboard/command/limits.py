"""Velocities and what a robot can do of them. Pure."""

from __future__ import annotations

import math
from typing import NamedTuple, Sequence

# No robot goes this fast (m/s, rad/s): such a command is a fault, and a fault means stop.
_ABSURD = 1000.0


class Velocity(NamedTuple):
    """A velocity as in geometry_msgs/Twist: m/s forward, to the left, up; rad/s about the same axes."""

    forward: float = 0.0
    left: float = 0.0
    up: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    turn: float = 0.0


STANDSTILL = Velocity()


def plausible(components: Sequence[float]) -> bool:
    """Returns True if every component is finite and no larger than a real robot can drive."""
    return all(math.isfinite(component) and abs(component) < _ABSURD for component in components)


def differential_excess(
    linear: float,
    angular: float,
    *,
    linear_max: float,
    angular_max: float,
    wheel_separation: float,
    wheel_speed_max: float,
) -> float:
    """Returns by which factor a command (m/s, rad/s) is too fast for two wheels; 1 if it is not.

    Divided by it, the robot drives the same curve, and both wheels keep their ratio.
    """
    fastest_wheel = abs(linear) + abs(angular) * wheel_separation / 2
    return max(1.0, abs(linear) / linear_max, abs(angular) / angular_max, fastest_wheel / wheel_speed_max)
