"""Keeps a change from robots in use, or whose terms of maintenance do not hold, or stops them first."""

from __future__ import annotations

import time

from . import maintenance_terms, robot_motion, stop_latches
from .errors import RefusedError
from .named_tuple import NamedTuple
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Callable, Iterable, Mapping

_LOOK = 1.0  # s for drivers to answer, and for wheels to be confirmed to stand
_STOP = 3.0  # s for robots to stand
_NOBODY = ("", "nobody")  # what drivers and gates answer without a commander
_HINT = "stop them with `swarmctl stop`, or use --stop-robots; they then stand until `swarmctl start`"


class RobotUse(NamedTuple):
    """``why`` a robot counts as in use, as the end of a sentence about it; its ``commander``, or empty."""

    why: str
    commander: str


def robots_of(home: Home, units: Iterable[str]) -> list[str]:
    """Returns the robots to which units of the current release belong."""
    robots = {one["name"]: one.get("robot") for one in home.units(home.current())}
    return sorted({str(robots[unit]) for unit in units if robots.get(unit)})


def busy(home: Home, robots: Iterable[str], *, stop: bool = False) -> dict[str, str]:
    """Returns why robots must not be touched now, by robot: they are in use, or a term does not hold.

    With ``stop`` only what stopping them first does not change. A robot whose driver does not run or does not
    answer is not in use: nothing passes on its commands.
    """
    names = sorted(robots)
    wanted = maintenance_terms.terms(home)
    if wanted is None:
        return dict.fromkeys(names, f"has unknown terms: {maintenance_terms.FILE} of its release is damaged")
    if stop and not any(wanted[one].of_power for one in names if one in wanted):
        return {}
    running = _running(home, names)
    answers = _answers(running, known=not stop)
    now = time.monotonic()
    found = {}
    for robot in names:
        answer, terms = answers.get(robot), wanted.get(robot, maintenance_terms.Terms())
        why = _why(answer) if answer is not None and not stop else ""
        unmet = maintenance_terms.unmet(terms, answer, now, runs=robot in running, stop=stop or bool(why))
        if reasons := [*([why] if why else []), *unmet]:
            found[robot] = ", and ".join(reasons)
    return found


def clear(home: Home, units: Iterable[str], *, stop: bool, who: str, note: Callable[[str], None]) -> None:
    """Returns once the robots of these units stand without a command; with ``stop`` it latches them first.

    Raises ``RefusedError`` for one that is commanded, whose terms do not hold, or whose wheels still turn.
    """
    robots = robots_of(home, units)
    if found := busy(home, robots, stop=stop):
        text = "; ".join(f"{robot} {why}" for robot, why in found.items())
        raise RefusedError(text, hint(text))
    if stop:
        halt(home, robots, who, note)


def in_use(home: Home, robots: Iterable[str]) -> dict[str, RobotUse]:
    """Returns those of the robots that move or are under command."""
    found: dict[str, RobotUse] = {}
    for robot, answer in _answers(_running(home, sorted(robots)), known=True).items():
        commander = _commander(answer)
        why = _commanded_by(commander) if commander else _why(answer)
        if why and not answer.get("held"):
            found[robot] = RobotUse(why, commander)
    return found


def halt(home: Home, robots: Iterable[str], who: str, note: Callable[[str], None]) -> None:
    """Latches robots, and returns once they stand. Raises ``RefusedError`` if wheels still turn."""
    running = _running(home, robots)
    if not running:
        return
    note(f"stopping {', '.join(running)}")
    latch = stop_latches.Latch(who, round(time.time(), 3))
    if failed := stop_latches.close(home, running, latch):
        raise RefusedError("; ".join(failed.values()), "repair the disk")
    answers = robot_motion.ask(running, _STOP, lambda found: robot_motion.proven(found, running))
    stop_latches.sync(home, running)
    turning = [one for one, answer in answers.items() if not _stands(answer)]
    if turning:
        raise RefusedError(
            f"{', '.join(sorted(turning))} was sent its stop, and its wheels still turn",
            "is it on a slope, or pushed? It stays stopped; `swarmctl stop` shows what its wheels do",
        )


def hint(why: str) -> str:
    """Returns what to do about a refusal with this text."""
    return maintenance_terms.HINT if "`maintenance`" in why else _HINT


def _running(home: Home, robots: Iterable[str]) -> dict[str, str]:
    sockets = robot_motion.sockets(home)
    return {one: sockets[one] for one in robots if one in sockets}


def _answers(running: Mapping[str, str], *, known: bool) -> dict[str, Mapping[str, Any]]:
    """The answers by robot; with ``known`` those that show if a robot is in use, as far as they come."""
    return robot_motion.ask(
        running,
        _LOOK,
        lambda found: len(found) == len(running) and (not known or all(map(_known, found.values()))),
    )


def _known(answer: Mapping[str, Any]) -> bool:
    if _commander(answer) and not answer.get("held"):
        return True
    return _stands(answer) and not answer.get("pending")


def _stands(answer: Mapping[str, Any]) -> bool:
    """True if its wheels are confirmed to stand, or nothing could show it."""
    measured = answer.get("measured") and answer.get("zero_at") is not None and not answer.get("pending")
    return answer.get("still_since") is not None or not measured


def _why(answer: Mapping[str, Any]) -> str:
    if not _stands(answer):
        return (
            f"is not confirmed to stand by its {'odometry' if answer.get('by') == 'odometry' else 'wheels'}"
        )
    commander = _commander(answer)
    return _commanded_by(commander) if commander and not answer.get("held") else ""


def _commanded_by(commander: str) -> str:
    return f"is commanded by {commander}"


def _commander(answer: Mapping[str, Any]) -> str:
    name = str(answer.get("commander", ""))
    return "" if name in _NOBODY else name
