"""What is usual for robots with two driven sides, and beyond what none is; each with its reason.

The usual range includes every shipped type and the robots of `tests/robot_types/field_robots.py`, with a
margin on both sides. What lies beyond the wider range contradicts physics or the size of any robot.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Sensible:
    """What is usual of a quantity, ``low`` to ``high``, and possible, ``least`` to ``most``."""

    unit: str
    least: float
    low: float
    high: float
    most: float

    def impossible(self, value: float) -> bool:
        """Returns True if no robot has this value."""
        return not self.least <= value <= self.most

    def unusual(self, value: float) -> bool:
        """Returns True if few robots, or none, have this value."""
        return not self.low <= value <= self.high

    @property
    def usual(self) -> str:
        """The usual range in words."""
        return f"{self.low:g} to {self.high:g} {self.unit}".rstrip()


RANGES: Mapping[str, Sensible] = {
    # From Kilobot (33 mm across) and Zooids (26 mm) to Warthog (1.2 m) and farm machines (3 m).
    "separation": Sensible("m", 0.003, 0.01, 3, 12),
    # From wheels of a Zooid (3 mm) to those of a tractor (0.8 m).
    "radius": Sensible("m", 0.001, 0.002, 0.8, 2),
    # Tracks by radius: e-puck 2.6, Husky 3.5, Koala 6.8, TurtleBot3 Waffle 8.7. Below 0.5 a robot is
    # four times as high as wide; one of the ratio 60 has wheels like coins under a table.
    "proportion": Sensible("", 0.5, 1.2, 20, 60),
    # From Kilobot (0.01 m/s) to Warthog (5 m/s); above 30 m/s it is a racing car.
    "speed": Sensible("m/s", 0.0005, 0.003, 10, 30),
    # Turns of a wheel in a second at full speed: e-puck 1, Jackal 3.2, Khepera IV 6.2. A geared motor of
    # 3000 turns a minute makes 50; a wheel that needs 200 s for a turn is none.
    "revolutions": Sensible("turns/s", 0.005, 0.05, 40, 300),
    # Turning on the spot at full speed: Kilobot 0.8, TurtleBot3 2.8, Jackal 10.6, Khepera IV 15. Two
    # turns a second are 12; above 250 (40 turns a second) tyres do not hold.
    "turning": Sensible("rad/s", 0.01, 0.1, 60, 250),
    # Counts of one turn of a wheel: rover 20, Duckiebot 135, Create 509, e-puck 1000, Husky 80 000.
    "counts per turn": Sensible("", 1, 6, 300_000, 20_000_000),
    # Counts of a second at full speed: rover 49, e-puck 1000, Pioneer 3-DX 150 000. Less than one a
    # second is no odometry.
    "counts per second": Sensible("1/s", 1, 10, 2_000_000, 100_000_000),
    # Steps of speed up to full speed: Koala 100, e-puck 1000, Khepera III 65 000. No protocol holds more
    # than 32 bits.
    "speed units": Sensible("", 0.5, 8, 10_000_000, 2**31),
    # Speed units for one count a second: Koala 0.01 (counts in 10 ms), e-puck 1, Khepera III 6.7.
    "unit of counts": Sensible("", 1e-7, 1e-4, 200, 1e6),
    # Measured by type's separation: Husky's controller takes 1.875 for its skidding wheels, the Koalas
    # 0.86 to 1.03.
    "separation by type": Sensible("", 0.25, 0.5, 2, 4),
    # Wheels wear and tyres flatten by a few per cent; a tenth is a wheel of another size. The format
    # allows 0.5 to 2.
    "distance scale": Sensible("", 0.5, 0.8, 1.25, 2),
    # How far a sensor is from the robot's centre, by the larger of the wheels' separation and four radii:
    # on the ground, and above the axis. e-puck 0.7, Koala 0.6, TurtleBot 4's camera 0.9 above, a
    # telepresence robot's head 4.
    "place": Sensible("", 0, 0, 3, 12),
    "height": Sensible("", 0, 0, 8, 30),
    # Largest distance: e-puck 0.06 m; long-range infrared modules reach 12 m, ultrasound 11 m.
    "range": Sensible("m", 0.001, 0.01, 15, 60),
    # A single LiPo or NiMH cell, or one battery of 48 V; a Kilobot has 3.7 V, a Husky 24 V.
    "voltage": Sensible("V", 0.5, 1, 100, 1000),
    # Acceleration and turning for one unit of the sensor: 16 bits of 2 g to 10 bits of 16 g; a gyroscope
    # 16 bits of 250 deg/s to 8 bits of 2000 deg/s. For the Earth's field (25 to 65 microtesla) a unit is
    # at most a tenth of it.
    "acceleration unit": Sensible("m/s2", 1e-7, 1e-5, 2, 10),
    "rotation unit": Sensible("rad/s", 1e-8, 1e-6, 0.5, 6),
    "magnetic unit": Sensible("T", 1e-13, 1e-11, 5e-6, 5e-5),
}  # fmt: skip

# A camera or a laser looks 360 degrees around; one distance sensor sees a cone, of 15 to 60 degrees
# mostly.
NARROWEST_CONE = 1.6  # degrees; 15 to 90 degrees are 0.26 to 1.57 rad
WIDEST_CONE = 180.0  # degrees
# A battery is empty at two thirds of its full voltage or more (LiPo 3.0 to 4.2, NiMH 0.9 to 1.4, lead
# 10.5 to 12.8).
LARGEST_SWING = 2.5
# Periods between two replies of which three in a row are lost: our choice, 0.3 s of a busy radio at 10 Hz.
LOST_REPLIES = 4
