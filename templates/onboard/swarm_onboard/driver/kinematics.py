"""From a command (m/s, rad/s) to wheel speeds, and from position counters to a pose. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Tuple

from swarm_onboard.command.limits import differential_excess, plausible
from swarm_onboard.driver.config import Kinematics, Scale
from swarm_onboard.driver.protocols import RosserialProtocol
from swarm_onboard.rosserial.messages import INTEGERS, integer
from swarm_onboard.rosserial.topics import Topic

Units = Tuple[int, int]
STANDSTILL: Units = (0, 0)

TRUSTED_SHARE = 0.75  # of the period of readings: two that come closer came late, the first one more so


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
    excess = differential_excess(
        linear,
        angular,
        linear_max=kinematics.linear_max,
        angular_max=kinematics.angular_max,
        wheel_separation=kinematics.wheel_separation,
        wheel_speed_max=kinematics.wheel_speed_max,
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
class Mark:
    """How far both wheels had come, in m, by the counters that were read at ``stamp``."""

    stamp: float
    left: float
    right: float


@dataclass(frozen=True)
class Odometry:
    """A pose and the counters it was computed from. A new line to the robot starts with no counters.

    ``marks``: the readings that the next speed may be measured from, oldest first.
    """

    pose: Pose = Pose()
    counters: Counters | None = None
    jumps: int = 0
    marks: tuple[Mark, ...] = ()

    def forget(self) -> Odometry:
        """Returns the same pose without counters, to continue from the next reading."""
        pose = replace(self.pose, linear=0.0, angular=0.0)
        return replace(self, pose=pose, counters=None, marks=())

    def update(
        self, counters: Counters, kinematics: Kinematics, scale: Scale, trusted: float = 0.0
    ) -> Odometry:
        """Returns the pose after the path between the last reading and this one, taken as an arc.

        The speed is that since the latest reading ``trusted`` s ago or more, or since the oldest one: a
        reading that came late, just before the next one, would make it too fast. No wheel's speed exceeds
        ``wheel_speed_max``.
        """
        before = self.counters
        if before is None:
            return self._from(counters)
        left = _difference(before.left, counters.left, kinematics.counter_bits) * scale.metres_per_count
        right = _difference(before.right, counters.right, kinematics.counter_bits) * scale.metres_per_count
        marks = _needed(self.marks, counters.stamp - trusted)
        mark = Mark(counters.stamp, self.pose.left + left, self.pose.right + right)
        speeds = _speeds(marks[0], mark, kinematics.wheel_speed_max)
        if speeds is None:
            return replace(self.forget()._from(counters), jumps=self.jumps + 1)
        pose = _moved(self.pose, left, right, speeds, kinematics.wheel_separation)
        return replace(self, pose=pose, counters=counters, marks=(*marks, mark))

    def _from(self, counters: Counters) -> Odometry:
        mark = Mark(counters.stamp, self.pose.left, self.pose.right)
        return replace(self, counters=counters, marks=(mark,))


def _needed(marks: tuple[Mark, ...], latest: float) -> tuple[Mark, ...]:
    """Returns the last of the ``marks`` that is not after ``latest`` and those after it; else all."""
    older = sum(mark.stamp <= latest for mark in marks)
    return marks[max(0, older - 1) :]


def _speeds(since: Mark, now: Mark, fastest: float) -> tuple[float, float] | None:
    """Returns the speed of both wheels, in m/s, at most ``fastest``; None if no wheel moves that far."""
    left, right, elapsed = now.left - since.left, now.right - since.right, now.stamp - since.stamp
    farther = max(abs(left), abs(right))
    # Twice what the wheels can do and a push by hand: more than that is a robot reset, not moved.
    if farther > 2 * fastest * elapsed + 0.05:
        return None
    if elapsed <= 0:
        return 0.0, 0.0
    measured = max(elapsed, farther / fastest)
    return left / measured, right / measured


def _difference(before: int, after: int, bits: int) -> int:
    """Returns the path from one counter reading to the next, over the wrap if that is shorter."""
    half = 1 << (bits - 1)
    return (after - before + half) % (2 * half) - half


def _moved(pose: Pose, left: float, right: float, speeds: tuple[float, float], separation: float) -> Pose:
    way, turn = (left + right) / 2, (right - left) / separation
    middle = pose.yaw + turn / 2
    return Pose(
        x=pose.x + way * math.cos(middle),
        y=pose.y + way * math.sin(middle),
        yaw=math.remainder(pose.yaw + turn, math.tau),
        linear=(speeds[0] + speeds[1]) / 2,
        angular=(speeds[1] - speeds[0]) / separation,
        driven=pose.driven + abs(way),
        turned=pose.turned + abs(turn),
        left=pose.left + left,
        right=pose.right + right,
    )


_APART = 0.03  # s between both counts of a pair at most: two frames, and an adapter that holds one back
_BITS = {"std_msgs/Int16": 16, "std_msgs/Int32": 32}


class Wheels:
    """Pairs the counts of both wheels and computes a pose from each pair, if the sketch counts at all.

    A count whose other half does not arrive in time is not paired with that of the next turn.
    """

    def __init__(self, protocol: RosserialProtocol, kinematics: Kinematics, odometry: Odometry) -> None:
        ticks = protocol.ticks
        self.odometry = odometry
        self._sides = (ticks.left, ticks.right) if ticks else ()
        self.kinematics = kinematics
        way = 2 * math.pi * ticks.wheel_radius / ticks.counts_per_turn if ticks else 0.0
        self.scale = Scale(firmware_below=math.inf, speed_units_per_mps=1.0, metres_per_count=way)
        self._counts: dict[str, int] = {}
        fastest = max((protocol.rates[side] for side in self._sides), default=1.0)
        self._trusted = TRUSTED_SHARE / fastest  # s
        self._apart = min(_APART, 0.5 / fastest)  # s
        self._begun = 0.0  # when the first half of a pair came

    def forget(self) -> None:
        """Drops the counts: the board starts to count anew."""
        self.odometry, self._counts = self.odometry.forget(), {}

    def take(self, topic: Topic, message: bytes, arrived: float) -> Pose | None:
        """Returns the new pose if ``message`` completes a pair, else None. Raises BadMessageError."""
        if topic.name not in self._sides or topic.type not in INTEGERS:
            return None
        if not self._counts or arrived - self._begun > self._apart:
            self._counts, self._begun = {}, arrived
        self._counts[topic.name] = integer(topic.type, message)
        if len(self._counts) < 2:
            return None
        left, right = (self._counts[side] for side in self._sides)
        counters = Counters(left, right, arrived)
        self._counts = {}
        kinematics = replace(self.kinematics, counter_bits=_BITS[topic.type])
        self.odometry = self.odometry.update(counters, kinematics, self.scale, self._trusted)
        return self.odometry.pose
