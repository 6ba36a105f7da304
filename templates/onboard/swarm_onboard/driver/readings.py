"""Converts raw numbers of a robot by the settings of their sensor. Pure; SI units.

Distances as in REP-117: +inf means that nothing is in sight, -inf that something is too near to measure, NaN
that there is no reading.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass
from typing import Any, Iterable, Mapping, Sequence, Tuple

from swarm_onboard.driver.codec import Values

Vector = Tuple[float, float, float]
Settings = Mapping[str, Any]
_LARGEST = 0xFFFF
# The shades that 5 and 6 bits of a colour distinguish, in 8 bits.
_OF_5 = [round(255 * shade / 31) for shade in range(32)]
_OF_6 = [round(255 * shade / 63) for shade in range(64)]


@dataclass(frozen=True)
class Motion:
    """Acceleration (m/s2) and rotation (rad/s) along x, y and z; None for what is not measured."""

    acceleration: Vector | None
    rotation: Vector | None


@dataclass(frozen=True)
class Charge:
    """A battery: its voltage, and how full that is, 0 to 1."""

    volts: float
    share: float


class Distances:
    """Converts one raw reading to metres, by interpolation between the pairs of a table."""

    def __init__(self, settings: Settings) -> None:
        pairs = settings["distances"]
        self._readings = [float(reading) for reading, _ in pairs]
        self._metres = [float(metres) for _, metres in pairs]
        self._none_from = settings.get("none_from", math.inf)
        self._none_below = settings.get("none_below", -math.inf)
        self._invalid_from = settings.get("invalid_from", math.inf)
        self.nearest, self.farthest = min(self._metres), max(self._metres)

    def metres(self, reading: float) -> float:
        """Returns the distance of a raw reading, in m; infinite and NaN as in REP-117."""
        if reading >= self._invalid_from:
            return math.nan
        if reading >= self._none_from or reading < self._none_below:
            return math.inf
        if reading < self._readings[0]:
            return self._beyond(self._metres[0])
        if reading > self._readings[-1]:
            return self._beyond(self._metres[-1])
        above = max(1, bisect_left(self._readings, reading))
        low, high = self._readings[above - 1], self._readings[above]
        share = (reading - low) / (high - low)
        return self._metres[above - 1] + share * (self._metres[above] - self._metres[above - 1])

    def _beyond(self, end: float) -> float:
        return -math.inf if end == self.nearest else math.inf


def every(values: Values, stride: int) -> Values:
    """Returns the numbers of one array, ``stride`` apart."""
    return values[::stride]


def whole(values: Iterable[float], largest: int = _LARGEST) -> list[int]:
    """Returns raw readings as unsigned 16-bit numbers; negative readings become zero."""
    return [min(max(0, int(value)), largest) for value in values]


def scaled(values: Iterable[float], settings: Settings) -> list[float]:
    """Returns raw values in the unit of the sensor."""
    scale, offset = settings["scale"], settings["offset"]
    return [value * scale + offset for value in values]


def vector(values: Sequence[float], axes: Settings) -> Vector:
    """Returns three of ``values`` along the robot's axes."""
    first, zero, scale = axes["first"], axes["zero"], axes["scale"]
    x, y, z = ((values[first + axes["order"][one]] - zero[one]) * scale[one] for one in range(3))
    return x, y, z


def motion(values: Sequence[float], settings: Settings) -> Motion:
    """Returns acceleration and rotation, as far as the sensor measures them."""
    acceleration, rotation = settings.get("acceleration"), settings.get("rotation")
    return Motion(
        acceleration=vector(values, acceleration) if acceleration else None,
        rotation=vector(values, rotation) if rotation else None,
    )


def picture(values: Sequence[float], settings: Settings) -> tuple[str, bytes]:
    """Returns an image's encoding and its pixels in ROS's layout. rgb565 comes with its high byte first."""
    data = bytes(int(value) for value in values)
    if settings["encoding"] != "rgb565":
        return settings["encoding"], data
    pixels = (high << 8 | low for high, low in zip(data[::2], data[1::2]))
    return "rgb8", b"".join(
        bytes((_OF_5[one >> 11], _OF_6[one >> 5 & 63], _OF_5[one & 31])) for one in pixels
    )


def pinhole(width: int, height: int, focal: float | None) -> dict[str, list[float]]:
    """Returns K, R and P of a sensor_msgs/CameraInfo: the middle of the image, ``focal`` in its pixels.

    All zero without a focal length: a camera that is not calibrated. No distortion is known.
    """
    if focal is None:
        return {"K": [0.0] * 9, "R": [0.0] * 9, "P": [0.0] * 12}
    x, y = (width - 1) / 2, (height - 1) / 2
    return {
        "K": [focal, 0.0, x, 0.0, focal, y, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [focal, 0.0, x, 0.0, 0.0, focal, y, 0.0, 0.0, 0.0, 1.0, 0.0],
    }


def charge(values: Sequence[float], settings: Settings) -> Charge:
    """Returns voltage and charge of a battery."""
    volts = settings["offset"] + sum(value * each for value, each in zip(values, settings["volts"]))
    empty, full = settings["empty"], settings["full"]
    return Charge(volts, min(1.0, max(0.0, (volts - empty) / (full - empty))))
