"""The record of who commanded a robot: a driver or gate begins it when it starts, and no entry is lost."""

from __future__ import annotations

import os

from swarm_onboard.agent import files, systemd
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.paths import COMMANDS
from swarm_onboard.agent.verbs import command_record
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (
    (
        "the record of a robot's commands is empty while its unit runs, or entries are missing or changed",
        "unhealthy: who commanded the robot is not known",
    ),
)


class Seen(NamedTuple):
    """A robot whose unit runs; ``problem``: what is wrong with its record, empty if nothing is."""

    robot: str
    problem: str


def observe(home: Home) -> list[Seen]:
    """Returns the robots of the release that have a running unit with a record."""
    manifest = home.known_manifest(home.current())
    if manifest is None:
        return []
    robots: dict[str, str] = {}
    for unit in manifest.units:
        robot = _recorded(home, unit)
        if robot:
            robots[unit] = robot
    running = systemd.properties(list(robots), ("Id", "ActiveState"))
    return [
        Seen(robots[unit], command_record.problem(home.outside(f"{COMMANDS}/{home.swarm}/{robots[unit]}")))
        for unit, shown in running.items()
        if shown.get("ActiveState") == "active"
    ]


def _recorded(home: Home, unit: str) -> str:
    """The robot whose commands the unit records, as its StateDirectory has it."""
    start = f"StateDirectory={os.path.basename(COMMANDS)}/{home.swarm}/"
    text = (files.read(f"{home.current_link}/units/{unit}") or b"").decode("utf-8", "replace")
    return next((line[len(start) :] for line in text.splitlines() if line.startswith(start)), "")


def judge(seen: Seen, host: str) -> Judged:
    """Names a record that somebody emptied or edited."""
    if not seen.problem:
        return Judged("ok", "is whole", about=seen.robot)
    hint = (
        "`swarmctl history --commands` shows what is left; to begin a new record, move the files of "
        f"{seen.robot} in {COMMANDS} on {host} away, and restart its unit"
    )
    return Judged("bad", seen.problem, hint, about=seen.robot)
