"""How the papers' own code computes wheel speeds from a Twist: each with its source and its mistakes. Pure.

The rover's is of "Mobile Robot Control Using Robot Operating System". All others are of Gansari and Buiu,
"Software System Integration of Heterogeneous Swarms of Robots": Fig. 7, and the drivers that it points to,
https://github.com/pktehgm/newswarm, robot_drivers/.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from motion_quality.paths import Twist

Units = tuple[int, int]


@dataclass(frozen=True)
class Formula:
    """``units`` gives left and right as the paper's driver sends them, in ``line``."""

    source: str
    mistakes: str
    line: str
    units: Callable[[Twist], Units]

    def request(self, twist: Twist) -> bytes:
        return self.line.format(*self.units(twist)).encode("ascii")


@dataclass(frozen=True)
class OnBoard:
    """A formula that the robot's own sketch computes: ``driven`` returns the resulting twist of a command."""

    source: str
    mistakes: str
    driven: Callable[[Twist], Twist]


def rover(twist: Twist) -> Twist:
    """What is divided by 65 mm for a radius turns wheels of 32.5 mm half as fast."""
    return Twist(twist.linear / 2, twist.angular / 2)


def koala(twist: Twist) -> Units:
    return _clamped(_wheels(twist, half_separation=14.5, diameter=8.5, gain=200, divisor=4), 100)


def khepera3(twist: Twist) -> Units:
    """A right wheel that is too fast gets 100 units, not 35 000."""
    left, right = _wheels(twist, half_separation=_COMMA, diameter=4.1, gain=30_000, divisor=3)
    clamped_left, clamped_right = _clamped((left, right), 35_000)
    return clamped_left, 100 if right > 35_000 else clamped_right


def epuck(twist: Twist) -> Units:
    return _clamped(_wheels(twist, half_separation=_COMMA, diameter=2.1, gain=200, divisor=4), 100)


# The separation is written `8,6`: to C, `8,6 / 2.0` is 6 / 2.0, not 4.3.
_COMMA = 6 / 2.0


def _wheels(twist: Twist, *, half_separation: float, diameter: float, gain: int, divisor: int) -> Units:
    """Metres a second with centimetres, a diameter for a radius, and truncation toward zero."""
    angular = twist.angular / divisor
    left = (twist.linear - half_separation * angular) / diameter
    right = (twist.linear + half_separation * angular) / diameter
    return math.trunc(left * gain), math.trunc(right * gain)


def _clamped(units: Units, most: int) -> Units:
    """Each wheel by itself, so that a curve becomes another one."""
    left, right = (max(-most, min(most, each)) for each in units)
    return left, right


MIXED = "m/s are divided by cm, and each wheel is clamped by itself"
DIAMETER = "a diameter stands for a radius"
COMMA = "the separation `8,6` counts as 6"
FORMULAS: Mapping[str, Formula | OnBoard] = {
    "koala": Formula(
        "(v ∓ 14.5 ω/4) / 8.5 · 200, at most 100 (Fig. 7)", f"{MIXED}; {DIAMETER}", "D,{},{}\n", koala
    ),
    "khepera3": Formula(
        "(v ∓ 3.0 ω/3) / 4.1 · 30 000, at most 35 000 (k3.cpp)",
        f"{MIXED}; {DIAMETER}; {COMMA}; a right wheel above the limit gets 100",
        "D,l{},l{}\n",
        khepera3,
    ),
    "epuck": Formula(
        "(v ∓ 3.0 ω/4) / 2.1 · 200, at most 100 (epuck.cpp)",
        f"{MIXED}; {COMMA}, and is another robot's",
        "D,{},{}\n",
        epuck,
    ),
    "arduino-rover": OnBoard(
        "v/r ∓ (ω/r)(d/2) with r = 65 mm (equation 2 of the second paper)",
        f"{DIAMETER}, so that everything is half of the command",
        rover,
    ),
}
