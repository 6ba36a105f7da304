"""What is commanded: manoeuvres as pieces of constant speed, and where they lead exactly. Pure."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

CRAWL = (0.015, 0.010)  # m/s; a Khepera III regulates nothing below 13.9 mm/s


@dataclass(frozen=True)
class Twist:
    """m/s forward, rad/s to the left."""

    linear: float
    angular: float

    @property
    def curvature(self) -> float:
        """1/m, positive to the left; not for turns in place."""
        return self.angular / self.linear


@dataclass(frozen=True)
class Leg:
    """One twist for some seconds."""

    twist: Twist
    seconds: float


@dataclass(frozen=True)
class Manoeuvre:
    """What a person at a joystick does, leg by leg; then they let go."""

    name: str
    legs: tuple[Leg, ...]

    def each(self, driven: Callable[[Twist], Twist]) -> Manoeuvre:
        """The same times with other twists."""
        return replace(self, legs=tuple(replace(leg, twist=driven(leg.twist)) for leg in self.legs))

    @property
    def curved(self) -> Twist | None:
        """Its twist, if it is one curve."""
        (first, *others) = (leg.twist for leg in self.legs)
        return first if not others and first.linear and first.angular else None


@dataclass(frozen=True)
class Place:
    """Where a robot is, m and rad; ``heading`` is not wrapped, ``driven`` is the length of the path."""

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0
    driven: float = 0.0

    def away(self, other: Place) -> float:
        return math.hypot(self.x - other.x, self.y - other.y)


@dataclass(frozen=True)
class Wheels:
    """What a differential drive can do: m between the wheels, m/s at most, m/s of one step of its commands.

    A wheel slower than ``slowest`` stands, or goes at ``slowest``.
    """

    separation: float
    fastest: float
    unit: float
    slowest: float = 0.0

    def speeds(self, twist: Twist) -> tuple[float, float]:
        """Left and right, m/s."""
        half = twist.angular * self.separation / 2
        return twist.linear - half, twist.linear + half

    def twist(self, left: float, right: float) -> Twist:
        return Twist((left + right) / 2, (right - left) / self.separation)

    def limited(self, twist: Twist) -> Twist:
        """The same curve, as fast as the faster wheel can drive it."""
        excess = max(1.0, max(map(abs, self.speeds(twist))) / self.fastest)
        return Twist(twist.linear / excess, twist.angular / excess)

    def rounded(self, twist: Twist) -> list[Twist]:
        """The farthest that rounding to whole units can take ``twist``; equal wheels are rounded alike."""
        left, right = self.speeds(twist)
        equal = abs(left) == abs(right)
        corners = itertools.product(self._corners(left), self._corners(right))
        kept = [(a, b) for a, b in corners if not equal or abs(a) == abs(b)]
        return [self.twist(a, b) for a, b in kept]

    def _corners(self, speed: float) -> tuple[float, float]:
        off = self.slowest / 2 if abs(speed) < self.slowest else self.unit / 2
        return (speed - off, speed + off) if speed else (speed, speed)


def after(place: Place, twist: Twist, seconds: float) -> Place:
    """``place`` after an exact arc."""
    way, turn = twist.linear * seconds, twist.angular * seconds
    chord = way * (math.sin(turn / 2) / (turn / 2) if turn else 1.0)
    middle = place.heading + turn / 2
    return Place(
        x=place.x + chord * math.cos(middle),
        y=place.y + chord * math.sin(middle),
        heading=place.heading + turn,
        driven=place.driven + abs(way),
    )


def commanded(manoeuvre: Manoeuvre, wheels: Wheels) -> Place:
    """Where ``manoeuvre`` leads a robot that follows its commands within its limits."""
    place = Place()
    for leg in manoeuvre.legs:
        place = after(place, wheels.limited(leg.twist), leg.seconds)
    return place


def reachable(manoeuvre: Manoeuvre, wheels: Wheels, wait: float) -> Iterator[Place]:
    """Yields where rounding to whole units can lead, and a new command that waits up to ``wait`` seconds.

    The same command is rounded alike each time.
    """
    commands = list(dict.fromkeys(leg.twist for leg in manoeuvre.legs))
    waits = list(itertools.product((0.0, wait), repeat=len(manoeuvre.legs) + 1))
    for choice in itertools.product(*(wheels.rounded(wheels.limited(one)) for one in commands)):
        rounded = dict(zip(commands, choice, strict=True))
        for late in waits:
            place = Place()
            for leg, before, behind in zip(manoeuvre.legs, late, late[1:], strict=False):
                place = after(place, rounded[leg.twist], leg.seconds + behind - before)
            yield place


def bend(twist: Twist, wheels: Wheels) -> float:
    """How far rounding can take the curvature of ``twist``, 1/m; infinite if it may turn in place."""
    rounded = wheels.rounded(wheels.limited(twist))
    if min(one.linear * twist.linear for one in rounded) <= 0.0:
        return math.inf
    return max(abs(one.curvature - twist.curvature) for one in rounded)


def manoeuvres(wheels: Wheels) -> Iterator[Manoeuvre]:
    """The course that every robot drives, in proportion to its size and speed."""
    fastest, separation = wheels.fastest, wheels.separation
    spin = 2 * fastest / separation
    side = 2.0 if separation > 0.2 else 0.5

    def straight(name: str, speed: float, way: float) -> Manoeuvre:
        return Manoeuvre(name, (Leg(Twist(speed, 0.0), way / min(speed, fastest)),))

    def turning(name: str, twist: Twist, angle: float) -> Manoeuvre:
        return Manoeuvre(name, (Leg(twist, angle / abs(wheels.limited(twist).angular)),))

    yield straight("straight, 1 m", fastest / 2, 1.0)
    yield straight("straight, 1 m, twice too fast", 2 * fastest, 1.0)
    yield turning("half circle to the left", Twist(fastest / 2, fastest / 2 / (2 * separation)), math.pi)
    yield turning("half circle, outer wheel too fast", Twist(fastest, -fastest / separation), math.pi)
    yield turning("turn in place, 3 times", Twist(0.0, spin / 2), 6 * math.pi)
    yield turning("turn in place, 3 times, twice too fast", Twist(0.0, -2 * spin), 6 * math.pi)
    corner = Leg(Twist(0.0, spin / 4), math.pi / 2 / (spin / 4))
    yield Manoeuvre(f"square of {side:g} m", (Leg(Twist(fastest / 2, 0.0), side / (fastest / 2)), corner) * 4)
    for speed in CRAWL:
        yield straight(f"crawl at {1000 * speed:g} mm/s, 10 s", speed, 10 * speed)
