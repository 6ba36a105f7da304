"""The terms of `maintenance:` in the spec, under which units of a robot may be stopped or restarted.

Those of the release that runs count. A term that nobody measures does not hold.
"""

from __future__ import annotations

import os

from . import files
from .named_tuple import NamedTuple
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Iterator, Mapping

FILE = "maintenance.json"  # of a release; by robot
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


def terms(home: Home) -> dict[str, Terms] | None:
    """Returns the terms of the current release, by robot; None if they cannot be read."""
    path = f"{home.current_link}/{FILE}"
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


def unmet(
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
