"""Distance sensors around a robot as the rays of one scan. Pure; m and rad, seen from the robot's centre."""

from __future__ import annotations

import math
from typing import Sequence

from swarm_onboard.driver.readings import Distances, Settings

RAYS = 72
STEP = math.tau / RAYS
FIRST = -math.pi  # straight behind; from there counter-clockwise, as in sensor_msgs/LaserScan
_ROUNDING = 0.001  # m


class Scan:
    """The places and headings of one array of sensors. ``nearest``, ``farthest``: from the robot's centre."""

    def __init__(self, settings: Settings) -> None:
        limits = Distances(settings)
        self._nearest, self._farthest = limits.nearest, limits.farthest
        self._sensors = [
            (one["x"], one["y"], math.cos(heading), math.sin(heading))
            for one in settings["elements"]
            for heading in [math.radians(one["heading_deg"])]
        ]
        ends = [
            math.hypot(*_point(one, end)) for one in self._sensors for end in (self._nearest, self._farthest)
        ]
        self.nearest, self.farthest = max(0.0, min(ends) - _ROUNDING), max(ends) + _ROUNDING

    def ranges(self, distances: Sequence[float]) -> list[float]:
        """Returns the range of each ray: +inf where a sensor sees nothing, NaN where none looks.

        What is too near to measure counts as being at the nearest distance. Of two sensors on one ray, the
        nearer object counts.
        """
        found = [math.nan] * RAYS
        for sensor, distance in zip(self._sensors, distances):
            if math.isnan(distance):
                continue
            x, y = _point(sensor, min(max(distance, self._nearest), self._farthest))
            ray = round((math.atan2(y, x) - FIRST) / STEP) % RAYS
            seen = math.hypot(x, y) if distance <= self._farthest else math.inf
            if not found[ray] <= seen:  # also where there is none yet
                found[ray] = seen
        return found


def _point(sensor: tuple[float, float, float, float], distance: float) -> tuple[float, float]:
    """Returns what a sensor sees at a distance."""
    x, y, cosine, sine = sensor
    return x + distance * cosine, y + distance * sine
