"""Stopped robots as text: a line for each, and a summary that names those that are not confirmed to stand."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from swarmctl.deploy.robot_stop import RobotStop
from swarmctl.views.escape import printable
from swarmctl.yamltext import hostlist

_LABELS = {
    "stands": ("stands", "bold green"),
    "unproven": ("not proven", "bold yellow"),
}
_PROOF = {
    "confirmed": "the robot confirmed the zero",
    "sent": "a zero was sent",
    "none": "latched",
}


def line(one: RobotStop) -> Text:
    """The result of one robot."""
    name = Text.assemble((one.robot, "bold"), "  ")
    if one.state == "failed":
        label = "not known to stand" if one.may_have_stopped else "NOT STOPPED"
        place = f"{one.host}: " if one.host else ""
        return name.append(label, "bold red").append(f": {place}{printable(one.trouble)}")
    name.append(*_LABELS[one.state])
    if one.state == "stands":
        timed = f"by its {one.proof}, {one.seconds or 0.0:.2f} s after the command"
        name.append(f": {timed if one.seconds else 'stood already'}")
    else:
        name.append(f": {_PROOF[one.proof]}")
        if one.seconds:
            name.append(f", at most {one.seconds:.2f} s after the command")
        if one.trouble:
            name.append(f"; {printable(one.trouble)}")
    if one.commander not in ("", "nobody"):
        name.append(f"; was commanded by {printable(one.commander)}")
    return name


def summary(found: Sequence[RobotStop]) -> Text:
    """How many robots stand, and which are not shown to."""
    stand = sum(one.state == "stands" for one in found)
    parts = [f"{stand} of {len(found)} robots {'stands' if stand == 1 else 'stand'}"]
    for state, label in (("unproven", "not proven"), ("failed", "not stopped or not known to stand")):
        names = [one.robot for one in found if one.state == state]
        if names:
            parts.append(f"{label}: {hostlist.written(names)}")
    return Text("; ".join(parts))
