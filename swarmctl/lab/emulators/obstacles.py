"""Walls and what range sensors measure of them."""

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
