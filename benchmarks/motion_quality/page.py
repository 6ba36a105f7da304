"""The page of tables, in Markdown that reads well as plain text. Pure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from motion_quality.papers import Formula, OnBoard
from motion_quality.paths import Place
from motion_quality.verdict import BEND, MARGIN, WAIT, Row

INTRODUCTION = f"""\
# Motion quality

The pose that each robot reaches when it is commanded to drive straight, along an arc, on the spot and around
a square: with its driver, and with the formula of the papers' own driver for the same commands. `make motion`
drives all of it in two seconds and writes this page.

The driver's core (commands, dead-man, conversion, odometry: the code that runs on a robot's host) controls
the emulated robot over a line on which each byte takes its real time; commands come 10 times a second, as
from a joystick. Emulators are written from the robots' manuals, independently of the robot types in
`templates/robots/`. Time is virtual: the figures are the same on every machine. They are those of the
software alone: on a floor wheels slip, and a robot needs calibration
(`settings.calibration`, see [the spec](spec.md)).

- **commanded**: the exact integral of the commands. A command beyond the robot's limits is scaled down along
  its curve: both wheels by the same factor.
- **off**: the difference to the emulated robot's true position and heading, and for a single curve the
  curvature; then the bound. The bound allows for rounding both wheels to whole units, for a new command
  that waits up to {1000 * WAIT:g} ms for the exchange in progress,
  and for {100 * MARGIN:g} % of the path and of the turn ({100 * BEND:g} % of the curvature).
  Coarse units make a wide bound: a Koala's wheel has steps of 4.5 mm/s. A Khepera III holds no speed below
  13.9 mm/s: a slower wheel turns at that speed or stands, whichever is nearer.
- **odometry off**: the difference between the true pose and the one that the driver publishes on `odom`; its
  bound is one count of each wheel, and {100 * MARGIN:g} % again.
- **paper**: how far the papers' formula drives and turns the same robot, how far its end is off, and its
  curvature. (A robot that does not move ends a square at the right place: compare the path.)

The command exits with 1 if a robot is beyond a bound.
"""

FORMULAS_TEXT = """\
## The papers' formulas

The command for a wheel in the robot's units, v in m/s and ω in rad/s, truncated to a whole number; the upper
sign is the left wheel's. Gansari and Buiu, *Software System Integration of Heterogeneous Swarms of Robots*,
print the Koala's (Fig. 7) and point to https://github.com/pktehgm/newswarm for the others. They suit a
gamepad that gives up to 4 on both axes, as turtlesim expects. The paper's loop sends 1000 lines a second,
more than 115200 baud carry; here each command is sent once, immediately. The rover's formula is computed on
its board ([firmware](firmware.md)).

"""

HEAD = (
    "manoeuvre",
    "commanded",
    "end off, mm",
    "heading off",
    "curvature off",
    "odometry off",
    "paper: way",
    "paper: end off, mm",
    "paper: curvature off",
)


def page(
    results: Mapping[str, Sequence[Row]],
    formulas: Mapping[str, Formula | OnBoard],
    left_out: Mapping[str, str],
) -> str:
    """The rows by robot, the formulas by type, and why a type is left out."""
    parts = [INTRODUCTION, *(f"## {name}\n\n{table(rows)}" for name, rows in results.items())]
    parts.append("".join([FORMULAS_TEXT, *map(_formula, formulas.items())]))
    if left_out:
        parts.append("## Left out\n\n" + "".join(f"- {name}: {why}.\n" for name, why in left_out.items()))
    return "\n".join(parts)


def table(rows: Sequence[Row]) -> str:
    lines = [HEAD, *map(_cells, rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    ruled = [lines[0], tuple("-" * width for width in widths), *lines[1:]]
    return "".join(
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |\n"
        for line in ruled
    )


def _cells(row: Row) -> tuple[str, ...]:
    driven, bar, odometry, paper = row.driven, row.bar, row.odometry, row.paper_off
    return (
        row.manoeuvre.name + (" **beyond**" if row.misses else ""),
        _way(row.wanted),
        f"{1000 * driven.end:.1f} of {1000 * bar.end:.1f}",
        f"{_degrees(driven.heading)} of {_degrees(bar.heading)}",
        f"{_percent(driven.curvature)} of {_percent(bar.curvature)}" if row.manoeuvre.curved else "",
        f"{1000 * odometry.end:.1f} mm, {_degrees(odometry.heading)}",
        _way(row.paper) if row.paper else "",
        f"{1000 * paper.end:.0f}" if paper else "",
        _percent(paper.curvature) if paper else "",
    )


def _formula(item: tuple[str, Formula | OnBoard]) -> str:
    name, formula = item
    return f"- {name}: {formula.source}; {formula.mistakes}.\n"


def _way(place: Place) -> str:
    return f"{place.driven:.2f} m, {math.degrees(place.heading) + 0.0:.0f}°"


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.1f}°"


def _percent(share: float | None) -> str:
    if share is None:
        return ""
    return f"{100 * share:.1f} %" if share < math.inf else "spins or stands"
