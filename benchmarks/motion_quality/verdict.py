"""How far a robot deviates from its commands, and how far it may."""

from __future__ import annotations

import math
from dataclasses import dataclass

from motion_quality.papers import Formula, OnBoard
from motion_quality.paths import Manoeuvre, Place, Wheels, bend, commanded, reachable
from motion_quality.robots import Entrant
from motion_quality.trial import Ride, by_paper

WAIT = 0.03  # s that a new command waits at most, for the exchange that is under way
MARGIN = 0.005  # of the way and of the turning, for what type and emulator do not share to the last digit
BEND = 0.001  # of a curvature, for the same
NOTHING = 1e-9


@dataclass(frozen=True)
class Off:
    """By how much: m, rad, and the share of the curvature, of one curve only."""

    end: float
    heading: float
    curvature: float | None = None

    def beyond(self, bar: Off) -> list[str]:
        """What is above ``bar``."""
        found = [name for name in ("end", "heading") if getattr(self, name) > getattr(bar, name) + NOTHING]
        bent = self.curvature is not None and bar.curvature is not None and self.curvature > bar.curvature
        return [*found, "curvature"] if bent else found


@dataclass(frozen=True)
class Row:
    """One manoeuvre of one robot; ``paper`` is where the papers' formula takes it, where they have one."""

    manoeuvre: Manoeuvre
    wanted: Place
    driven: Off
    bar: Off
    odometry: Off
    odometry_bar: Off
    paper: Place | None

    @property
    def paper_off(self) -> Off | None:
        return off(self.paper, self.wanted, self.manoeuvre) if self.paper else None

    @property
    def misses(self) -> list[str]:
        """What is above its bar."""
        return [
            *(f"the {one}" for one in self.driven.beyond(self.bar)),
            *(f"the {one} in odometry" for one in self.odometry.beyond(self.odometry_bar)),
        ]


def row(entrant: Entrant, manoeuvre: Manoeuvre) -> Row:
    """Have ``entrant`` drive, once by its driver and once by the papers' formula."""
    wheels = entrant.wheels
    wanted = commanded(manoeuvre, wheels)
    driven, believed = Ride(entrant.config, entrant.make()).drive(manoeuvre)
    return Row(
        manoeuvre=manoeuvre,
        wanted=wanted,
        driven=off(driven, wanted, manoeuvre),
        bar=bar(manoeuvre, wheels),
        odometry=Off(
            end=math.hypot(believed.x - driven.x, believed.y - driven.y),
            heading=abs(math.remainder(believed.yaw - driven.heading, math.tau)),
        ),
        odometry_bar=odometry_bar(manoeuvre, wheels, entrant.count),
        paper=_by_paper(entrant, manoeuvre),
    )


def _by_paper(entrant: Entrant, manoeuvre: Manoeuvre) -> Place | None:
    match entrant.formula:
        case Formula() as formula:
            return by_paper(formula, manoeuvre, entrant.make)
        case OnBoard(driven=driven):
            return Ride(entrant.config, entrant.make()).drive(manoeuvre.each(driven))[0]
    return None


def off(place: Place, wanted: Place, manoeuvre: Manoeuvre) -> Off:
    return Off(
        end=place.away(wanted),
        heading=abs(place.heading - wanted.heading),
        curvature=_bent(place, manoeuvre),
    )


def bar(manoeuvre: Manoeuvre, wheels: Wheels) -> Off:
    """What rounding to the robot's units and the line's delay explain, and ``MARGIN``."""
    wanted, ends = commanded(manoeuvre, wheels), list(reachable(manoeuvre, wheels, WAIT))
    curve = manoeuvre.curved
    return Off(
        end=max(end.away(wanted) for end in ends) + MARGIN * wanted.driven,
        heading=max(abs(end.heading - wanted.heading) for end in ends) + MARGIN * _turning(manoeuvre, wheels),
        curvature=bend(curve, wheels) / abs(curve.curvature) + BEND if curve else None,
    )


def odometry_bar(manoeuvre: Manoeuvre, wheels: Wheels, count: float) -> Off:
    """One count of each wheel, in ``count`` metres: along the way and as a turn; and ``MARGIN``."""
    way, turn = commanded(manoeuvre, wheels).driven, 2 * count / wheels.separation
    return Off(
        end=MARGIN * way + count + turn * way,
        heading=MARGIN * _turning(manoeuvre, wheels) + turn,
    )


def _turning(manoeuvre: Manoeuvre, wheels: Wheels) -> float:
    """To the left and to the right added up, rad."""
    return sum(abs(wheels.limited(leg.twist).angular) * leg.seconds for leg in manoeuvre.legs)


def _bent(place: Place, manoeuvre: Manoeuvre) -> float | None:
    """The share by which the curvature of the way driven is wrong; infinite if the robot stands or spins."""
    curve = manoeuvre.curved
    if curve is None:
        return None
    if place.driven < NOTHING:
        return math.inf
    driven = place.heading / math.copysign(place.driven, curve.linear)
    return abs(driven / curve.curvature - 1)
