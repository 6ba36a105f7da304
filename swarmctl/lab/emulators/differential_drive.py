"""A differential drive: exact arcs between commands, and position counters that wrap."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Wall:
    """A straight wall between two points of the ground, in m."""

    x1: float
    y1: float
    x2: float
    y2: float


@dataclass(frozen=True)
class Sensor:
    """Position (m) and direction (degrees, counter-clockwise from ahead) of a range sensor on its robot."""

    x: float
    y: float
    heading: float


def distance(sensor: Sensor, pose: tuple[float, float, float], walls: Sequence[Wall]) -> float:
    """Returns the metres from ``sensor``, on a robot at ``pose``, to the first wall ahead; infinite without
    one.
    """
    x, y, theta = pose
    sine, cosine = math.sin(theta), math.cos(theta)
    x, y = x + sensor.x * cosine - sensor.y * sine, y + sensor.x * sine + sensor.y * cosine
    theta += math.radians(sensor.heading)
    return min((_along(x, y, math.cos(theta), math.sin(theta), wall) for wall in walls), default=math.inf)


def _along(x: float, y: float, dx: float, dy: float, wall: Wall) -> float:
    """Returns the distance at which the ray from (x, y) along the unit vector (dx, dy) meets ``wall``."""
    wx, wy = wall.x2 - wall.x1, wall.y2 - wall.y1
    cross = dx * wy - dy * wx
    if cross == 0.0:
        return math.inf
    px, py = wall.x1 - x, wall.y1 - y
    along_ray, along_wall = (px * wy - py * wx) / cross, (px * dy - py * dx) / cross
    return along_ray if along_ray >= 0.0 and 0.0 <= along_wall <= 1.0 else math.inf


def ripple(channel: int, sample: int) -> int:
    """Returns the noise of a reading, 0..6: different per channel and reading, but not random."""
    return (5 * channel + 3 * sample) % 7


def wrap(value: int, bits: int) -> int:
    """Returns ``value`` as a signed two's complement number of ``bits`` bits."""
    half = 1 << (bits - 1)
    return (value + half) % (2 * half) - half


def clamp(value: int, limit: int) -> int:
    """Returns ``value`` limited to ``-limit .. limit``."""
    return max(-limit, min(limit, value))


@dataclass
class Wheel:
    """One driven wheel.

    A new speed applies at once: the lag of these robots is shorter than a command period.

    ``speed`` is in m/s at its rim, ``travelled`` in m; ``target`` is the travel at which it stops itself.
    """

    metres_per_count: float
    counter_bits: int
    speed: float = 0.0
    travelled: float = 0.0
    target: float | None = None
    origin: float = 0.0

    @property
    def count(self) -> int:
        """The position counter."""
        return wrap(round((self.travelled - self.origin) / self.metres_per_count), self.counter_bits)

    @count.setter
    def count(self, value: int) -> None:
        self.origin = self.travelled - wrap(value, self.counter_bits) * self.metres_per_count

    @property
    def arrived(self) -> bool:
        """True if the wheel has no target position to reach."""
        return self.target is None

    def drive(self, speed: float) -> None:
        """Sets the speed, in m/s."""
        self.speed, self.target = speed, None

    def go_to(self, count: int, speed: float) -> None:
        """Turns at ``speed`` m/s (its sign is ignored) until the counter reaches ``count``."""
        target = self.origin + count * self.metres_per_count
        if target == self.travelled:
            self.drive(0.0)
        else:
            self.speed, self.target = math.copysign(abs(speed), target - self.travelled), target

    def due(self) -> float:
        """Returns the seconds until the target is reached; infinite without one."""
        if self.target is None or self.speed == 0.0:
            return math.inf
        return max(0.0, (self.target - self.travelled) / self.speed)

    def roll(self, dt: float) -> None:
        """Turns the wheel for ``dt`` seconds."""
        if self.target is not None and dt >= self.due():
            self.travelled = self.target
            self.drive(0.0)
        else:
            self.travelled += self.speed * dt


class Chassis:
    """Two wheels on one axle. x forward, y left, theta counter-clockwise, not wrapped: two turns are 4 pi.

    ``distance_scale`` is the distance on the ground per metre of the wheels: how much larger they are than
    the type says. Speeds and counters do not include it.
    """

    def __init__(
        self,
        *,
        wheel_separation: float,
        metres_per_count: float,
        counter_bits: int,
    ) -> None:
        if not wheel_separation > 0.0:
            raise ValueError(f"'wheel_separation' is a distance in m, not {wheel_separation!r}")
        self.wheel_separation = wheel_separation
        self.distance_scale = 1.0
        self.x = self.y = self.theta = 0.0
        self.left = Wheel(metres_per_count, counter_bits)
        self.right = Wheel(metres_per_count, counter_bits)
        self.distance = 0.0
        self.time = 0.0

    def place(self, x: float, y: float, theta: float) -> None:
        """Sets the pose (m, m, rad)."""
        self.x, self.y, self.theta = x, y, theta

    @property
    def wheels(self) -> tuple[Wheel, Wheel]:
        """The left and the right wheel."""
        return self.left, self.right

    @property
    def v(self) -> float:
        """Forward speed of the axle's centre, m/s."""
        return self.distance_scale * (self.left.speed + self.right.speed) / 2

    @property
    def omega(self) -> float:
        """Turning rate, rad/s, positive to the left."""
        return self.distance_scale * (self.right.speed - self.left.speed) / self.wheel_separation

    def advance(self, dt: float) -> None:
        """Moves for ``dt`` s. Speeds are constant between commands and targets, so each piece is an arc.

        Raises ``ValueError`` for a negative ``dt``.
        """
        if not (math.isfinite(dt) and dt >= 0.0):
            raise ValueError(f"a duration cannot be {dt!r} s")
        while dt > 0.0:
            step = min(dt, self.left.due(), self.right.due())
            self._arc(step)
            dt -= step

    def _arc(self, dt: float) -> None:
        half_turn = self.omega * dt / 2
        chord = self.v * dt * (math.sin(half_turn) / half_turn if half_turn else 1.0)
        self.x += chord * math.cos(self.theta + half_turn)
        self.y += chord * math.sin(self.theta + half_turn)
        self.theta += 2 * half_turn
        self.distance += abs(self.v) * dt
        self.time += dt
        for wheel in self.wheels:
            wheel.roll(dt)

    def drive(self, left: float, right: float) -> None:
        """Sets both wheel speeds, m/s."""
        self.left.drive(left)
        self.right.drive(right)

    def power_cycle(self) -> None:
        """Stops the wheels and clears the counters; the robot stays where it is."""
        self.drive(0.0, 0.0)
        self.left.count = self.right.count = 0
