"""The changes of a swarm, put together from the logs of its hosts, and what it takes to go back. Pure.

Hosts log the run of swarmctl with each change. Runs are in the order of the hosts' clocks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from swarm_agent.history_messages import ChangeEntry

from swarmctl.yamltext import hostlist

APPLIED = "applied"


@dataclass(frozen=True)
class Run:
    """One run that changed hosts. ``time``: s since 1970, of the first host that it changed."""

    name: str
    who: str
    time: float
    changes: Mapping[str, ChangeEntry]

    def to_json(self) -> dict[str, Any]:
        """Returns the run as ``history --json`` prints it."""
        return {"run": self.name, "who": self.who, "time": self.time, "hosts": dict(self.changes)}


class NoWayBackError(Exception):
    """There is nothing to go back to; the text says why."""


def runs(logs: Mapping[str, Sequence[ChangeEntry]]) -> list[Run]:
    """Returns the runs in the logs of hosts, the oldest first."""
    found: dict[str, dict[str, ChangeEntry]] = {}
    for host, entries in logs.items():
        for entry in entries:
            found.setdefault(entry["run"] or entry["txid"], {})[host] = entry
    made = [
        Run(name, next(iter(changes.values()))["who"], min(one["time"] for one in changes.values()), changes)
        for name, changes in found.items()
    ]
    return sorted(made, key=lambda run: run.time)


def before_last(found: Sequence[Run], current: Mapping[str, str | None]) -> Mapping[str, str]:
    """Returns the releases that hosts had before the last run whose change is in place, for its hosts.

    Raises ``NoWayBackError``.
    """
    for run in reversed(found):
        changed = {
            host: one
            for host, one in run.changes.items()
            if one["state"] == APPLIED and one["next"] is not None and current.get(host) == one["next"]
        }
        if changed:
            first = [host for host, one in changed.items() if one["prev"] is None]
            if first:
                raise NoWayBackError(f"it was the first deploy of {hostlist.written(sorted(first))}")
            return {host: str(one["prev"]) for host, one in changed.items() if one["prev"] != one["next"]}
    raise NoWayBackError("no host has a change that could be taken back")


def after(found: Sequence[Run], name: str) -> Mapping[str, str]:
    """Returns the releases that hosts had after the run whose name begins with ``name``.

    Raises ``NoWayBackError`` if there is none, or several.
    """
    numbers = [number for number, run in enumerate(found) if run.name.startswith(name)]
    if len(numbers) != 1:
        raise NoWayBackError(f"`{name}` is {'no' if not numbers else 'more than one'} run of the history")
    releases: dict[str, str | None] = {}
    for number, run in enumerate(found):
        for host, one in run.changes.items():
            if one["state"] != APPLIED:
                continue
            if number <= numbers[0]:
                releases[host] = one["next"]
            else:
                releases.setdefault(host, one["prev"])
    if first := [host for host, release in releases.items() if release is None]:
        raise NoWayBackError(f"no release after that run: {hostlist.written(sorted(first))}")
    return {host: str(release) for host, release in releases.items()}
