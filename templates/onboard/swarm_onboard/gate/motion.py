"""What of a commanded velocity a robot may carry out: the axes that it has, within its limits. Pure."""

from __future__ import annotations

import math
import struct
import time
from dataclasses import dataclass

from swarm_onboard.command.limits import Velocity, differential_excess

#: The axes of each kind of kinematics, as fields of ``Velocity``.
AXES = {
    "differential": ("forward", "turn"),
    "ackermann": ("forward", "turn"),
    "holonomic": ("forward", "left", "turn"),
    "legged": ("forward", "left", "turn"),
    "aerial": ("forward", "left", "up", "turn"),
}


@dataclass(frozen=True)
class Motion:
    """How a robot moves: the fastest along and about its axes (m/s, rad/s), distance and radius in m."""

    kind: str
    linear_max: float
    lateral_max: float
    vertical_max: float
    angular_max: float
    wheel_separation: float | None = None
    turning_radius: float | None = None


def on_axes(wanted: Velocity, motion: Motion) -> Velocity:
    """Returns the velocity without the components on axes that the robot does not have."""
    axes = AXES[motion.kind]
    return Velocity(**{axis: getattr(wanted, axis) for axis in axes})


def limited(wanted: Velocity, motion: Motion) -> Velocity:
    """Returns the velocity within the robot's limits: all axes divided by one factor, so its curve is kept.

    A robot that steers like a car turns only while it drives, and no tighter than its turning radius.
    ``wanted`` has only axes of the robot.
    """
    if motion.kind == "ackermann":
        wanted = _steerable(wanted, motion.turning_radius or 0.0)
    excess = _excess(wanted, motion)
    return wanted if excess <= 1.0 else Velocity(*(component / excess for component in wanted))


def _steerable(wanted: Velocity, radius: float) -> Velocity:
    if not wanted.forward:
        return Velocity()
    sharpest = abs(wanted.forward) / radius if radius else math.inf
    return wanted._replace(turn=math.copysign(min(abs(wanted.turn), sharpest), wanted.turn))


def _excess(wanted: Velocity, motion: Motion) -> float:
    """Returns by which factor the velocity is too fast; 1 or less if it is not."""
    if motion.wheel_separation is not None:
        half = motion.wheel_separation / 2
        return differential_excess(
            wanted.forward,
            wanted.turn,
            linear_max=motion.linear_max,
            angular_max=motion.angular_max,
            wheel_separation=motion.wheel_separation,
            wheel_speed_max=max(motion.linear_max, motion.angular_max * half),
        )
    fastest = Velocity(
        forward=motion.linear_max, left=motion.lateral_max, up=motion.vertical_max, turn=motion.angular_max
    )
    return max(abs(one) / most for one, most in zip(wanted, fastest) if most)


#: Of the definitions of geometry_msgs.
MD5 = {
    "geometry_msgs/Twist": "9f195f881246fdfa2798d1d3eebca84a",
    "geometry_msgs/TwistStamped": "98d34b0043a2093cf9d9345ab6eef12e",
}
_ZEROS = bytes(6 * 8)  # six float64


def zero(kind: str) -> bytes:
    """Returns a message of type ``kind`` with all velocities 0, and the time of now where it has a stamp."""
    if kind == "geometry_msgs/Twist":
        return _ZEROS
    seconds, nanoseconds = divmod(time.time_ns(), 10**9)
    return struct.pack("<IIII", 0, seconds, nanoseconds, 0) + _ZEROS  # seq, stamp, an empty frame
