"""Keeps a change from robots in use, or whose terms of maintenance do not hold, or stops them first.

Those of the release that runs count. A term that nobody measures does not hold.
"""

from __future__ import annotations

import os
import time

from . import files, robot_motion, stop_latches
from .errors import RefusedError
from .named_tuple import NamedTuple
from .release_store import Home

TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Any, Callable, Iterable, Iterator, Mapping


TERMS_FILE = "maintenance.json"  # of a release; by robot
HINT = "wait until it holds; other terms hold once a deploy of nothing but `maintenance` is through"


class Terms(NamedTuple):
    """``idle``: s without a command and without motion; ``battery``: 0 to 1. 0 and False ask for nothing."""

    idle: float = 0.0
    battery: float = 0.0
    docked: bool = False

    @property
    def of_power(self) -> bool:
        """True for terms that stopping the robot does not change."""
        return self.battery > 0 or self.docked


def terms_of(home: Home) -> dict[str, Terms] | None:
    """Returns the terms of the current release, by robot; None if they cannot be read."""
    path = f"{home.current_link}/{TERMS_FILE}"
    if not os.path.exists(path):
        return {}
    try:
        raw = files.read_json(path)
        return {
            robot: Terms(float(one["idle"]), float(one["battery"]), bool(one.get("docked")))
            for robot, one in raw.items()
        }
    except (AttributeError, LookupError, TypeError, ValueError):
        return None


def unmet_terms(
    wanted: Terms, answer: Mapping[str, Any] | None, now: float, *, runs: bool, stop: bool
) -> Iterator[str]:
    """Yields each term that does not hold, as the end of a sentence about the robot.

    ``answer``: of its driver or gate, None without one; ``now``: by its clock; ``runs``: there is something
    to ask; ``stop``: the robot is stopped before it is touched, however long it was idle.
    """
    silent = "does not answer" if runs else "does not run"
    unread = f"its driver {silent}" if answer is None else answer.get("trouble") or "it is not read"
    if wanted.idle and runs and not stop:  # nothing passes commands on to a robot whose driver does not run
        since = (answer or {}).get("idle_since")
        if since is None:
            asks = f"`maintenance` asks for {wanted.idle:g} s"
            yield f"is idle for an unknown time, {asks}: its driver {silent}"
        elif now - since < wanted.idle:
            yield f"has been idle for {max(0.0, now - since):.0f} s of the {wanted.idle:g} s of `maintenance`"
    if wanted.battery:
        share = (answer or {}).get("battery")
        if share is None:
            asks = f"`maintenance` asks for {wanted.battery:g}"
            yield f"has a battery whose charge is not known, {asks}: {unread}"
        elif share < wanted.battery:
            yield f"has its battery at {share:.2f}, `maintenance` asks for {wanted.battery:g}"
    if wanted.docked:
        docked = (answer or {}).get("docked")
        if docked is None:
            yield f"may be away from its dock, and `maintenance` asks for `docked`: {unread}"
        elif not docked:
            yield "is not docked, as `maintenance` asks"


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
    wanted = terms_of(home)
    if wanted is None:
        return dict.fromkeys(names, f"has unknown terms: {TERMS_FILE} of its release is damaged")
    if stop and not any(wanted[one].of_power for one in names if one in wanted):
        return {}
    running = _running(home, names)
    answers = _answers(running, known=not stop)
    now = time.monotonic()
    found = {}
    for robot in names:
        answer, terms = answers.get(robot), wanted.get(robot, Terms())
        why = _why(answer) if answer is not None and not stop else ""
        unmet = unmet_terms(terms, answer, now, runs=robot in running, stop=stop or bool(why))
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
    return HINT if "`maintenance`" in why else _HINT


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
