"""From a command (m/s, rad/s) to wheel speeds, and from position counters to a pose. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Sequence, Tuple

from swarm_driver.config import Kinematics, Scale

Units = Tuple[int, int]
STANDSTILL: Units = (0, 0)

# No wheeled robot goes this fast (m/s, rad/s): such a command is a fault, and a fault means stop.
_ABSURD = 1000.0


def plausible(components: Sequence[float]) -> bool:
    """Returns True if every component is finite and no larger than a real robot can drive."""
    return all(math.isfinite(component) and abs(component) < _ABSURD for component in components)


def wheel_units(linear: float, angular: float, kinematics: Kinematics, scale: Scale) -> Units:
    """Returns left and right wheel speed in the robot's units.

    A command too fast is slowed along its curve.
    """
    linear, angular = within_limits(linear, angular, kinematics)
    half = angular * kinematics.wheel_separation / 2
    return _units(linear - half, kinematics, scale), _units(linear + half, kinematics, scale)


def within_limits(linear: float, angular: float, kinematics: Kinematics) -> tuple[float, float]:
    """Returns a command (m/s, rad/s), slowed along its curve if too fast; an implausible one is a stop."""
    if not plausible((linear, angular)):
        return 0.0, 0.0
    fastest_wheel = abs(linear) + abs(angular) * kinematics.wheel_separation / 2
    excess = max(
        1.0,
        abs(linear) / kinematics.linear_max,
        abs(angular) / kinematics.angular_max,
        fastest_wheel / kinematics.wheel_speed_max,
    )
    return linear / excess, angular / excess


def _units(speed: float, kinematics: Kinematics, scale: Scale) -> int:
    slowest = kinematics.wheel_speed_min
    if abs(speed) < slowest / 2:
        return 0
    return round(math.copysign(max(abs(speed), slowest), speed) * scale.speed_units_per_mps)


@dataclass(frozen=True)
class Pose:
    """The estimated pose and speed of a robot, and how far it has driven and turned in all.

    ``left`` and ``right`` are the paths of the wheels, backwards subtracted.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    linear: float = 0.0
    angular: float = 0.0
    driven: float = 0.0
    turned: float = 0.0
    left: float = 0.0
    right: float = 0.0


@dataclass(frozen=True)
class Counters:
    """Both position counters as read at one moment."""

    left: int
    right: int
    stamp: float


@dataclass(frozen=True)
class Odometry:
    """A pose and the counters it was computed from. A new line to the robot starts with no counters."""

    pose: Pose = Pose()
    counters: Counters | None = None
    jumps: int = 0

    def forget(self) -> Odometry:
        """Returns the same pose without counters, to continue from the next reading."""
        return replace(self, pose=replace(self.pose, linear=0.0, angular=0.0), counters=None)

    def update(self, counters: Counters, kinematics: Kinematics, scale: Scale) -> Odometry:
        """Returns the pose after the path between the last reading and this one, taken as an arc."""
        before = self.counters
        if before is None:
            return replace(self, counters=counters)
        elapsed = counters.stamp - before.stamp
        left = _difference(before.left, counters.left, kinematics.counter_bits) * scale.metres_per_count
        right = _difference(before.right, counters.right, kinematics.counter_bits) * scale.metres_per_count
        # Twice what the wheels can do and a push by hand: more than that is a robot reset, not moved.
        if max(abs(left), abs(right)) > 2 * kinematics.wheel_speed_max * elapsed + 0.05:
            return replace(self.forget(), counters=counters, jumps=self.jumps + 1)
        return replace(
            self, pose=_moved(self.pose, left, right, elapsed, kinematics.wheel_separation), counters=counters
        )


def _difference(before: int, after: int, bits: int) -> int:
    """Returns the path from one counter reading to the next, over the wrap if that is shorter."""
    half = 1 << (bits - 1)
    return (after - before + half) % (2 * half) - half


def _moved(pose: Pose, left: float, right: float, elapsed: float, separation: float) -> Pose:
    way, turn = (left + right) / 2, (right - left) / separation
    middle = pose.yaw + turn / 2
    return Pose(
        x=pose.x + way * math.cos(middle),
        y=pose.y + way * math.sin(middle),
        yaw=math.remainder(pose.yaw + turn, math.tau),
        linear=way / elapsed if elapsed > 0 else 0.0,
        angular=turn / elapsed if elapsed > 0 else 0.0,
        driven=pose.driven + abs(way),
        turned=pose.turned + abs(turn),
        left=pose.left + left,
        right=pose.right + right,
    )
