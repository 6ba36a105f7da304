"""Robots that `swarmctl stop` has stopped. Pure."""

from __future__ import annotations

from datetime import datetime

from swarmctl.health.check_context import CheckContext
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import warning

TABLE = {"stop": (("a robot was stopped with `swarmctl stop`", "a warning, with who did it, and when"),)}


def compare(found: Findings, context: CheckContext) -> None:
    """Names a robot that stands on purpose: it is not a fault, and it does not obey."""
    for _, robot, answer in context.robots():
        if (latch := answer.latches.get(robot.name)) is not None:
            text = f"stopped by {latch.who}{_since(latch.since)}"
            verdict = warning(text, f"`swarmctl start SPEC {robot.name}` lets it obey again")
            found.add("stop", robot.name, verdict, robot=robot)


def _since(seconds: float) -> str:
    """A moment in words; none if the host's number is none."""
    try:
        moment = datetime.fromtimestamp(seconds).astimezone()
    except (ValueError, OverflowError, OSError):
        return ""
    return f" since {moment:%Y-%m-%d %H:%M:%S}" if seconds else ""
