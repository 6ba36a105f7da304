"""The changes of a swarm, put together from the logs of its hosts, and what it takes to go back. Pure.

Hosts log the run of swarmctl with each change. The log of a host has its runs in their order, whatever its
clock; clocks decide only between runs that no log has both of.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from itertools import pairwise
from typing import Any

from swarm_onboard.agent.audit import ChangeEntry
from swarm_onboard.agent.record import State
from swarm_onboard.agent.verbs import history

from swarmctl.yamltext import hostlist

APPLIED = "applied"
FORGOTTEN = "forgotten"


@dataclass(frozen=True)
class Run:
    """One run that changed hosts. ``time``: s since 1970, the median of the clocks of its hosts."""

    name: str
    who: str
    time: float
    changes: Mapping[str, ChangeEntry]

    def to_json(self) -> dict[str, Any]:
        """Returns the run as ``history --json`` prints it."""
        hosts = {host: one._asdict() for host, one in self.changes.items()}
        return {"run": self.name, "who": self.who, "time": self.time, "hosts": hosts}


class NoWayBackError(Exception):
    """There is nothing to go back to; the text says why."""


def runs(logs: Mapping[str, Sequence[ChangeEntry]]) -> list[Run]:
    """Returns the runs in the logs of hosts, the oldest first."""
    found: dict[str, dict[str, ChangeEntry]] = {}
    for host, entries in logs.items():
        for entry in entries:
            found.setdefault(_run_of(entry), {})[host] = entry
    made = {
        name: Run(name, next(iter(changes.values())).who, _time_of(changes), changes)
        for name, changes in found.items()
    }
    return _in_order(made, logs)


def _run_of(entry: ChangeEntry) -> str:
    return entry.run or entry.txid


def _time_of(changes: Mapping[str, ChangeEntry]) -> float:
    times = sorted(one.time for one in changes.values())
    return times[(len(times) - 1) // 2]


def _in_order(made: Mapping[str, Run], logs: Mapping[str, Sequence[ChangeEntry]]) -> list[Run]:
    """The runs, each after those that stand before it in any log, and else by time."""
    later: dict[str, set[str]] = {name: set() for name in made}
    for entries in logs.values():
        for one, following in pairwise(dict.fromkeys(map(_run_of, entries))):
            later[one].add(following)
    waits_for = Counter(name for following in later.values() for name in following)
    ready = [(run.time, name) for name, run in made.items() if not waits_for[name]]
    heapify(ready)
    ordered: list[str] = []
    while ready:
        _, name = heappop(ready)
        ordered.append(name)
        for following in later[name]:
            waits_for[following] -= 1
            if not waits_for[following]:
                heappush(ready, (made[following].time, following))
    contradicting = sorted(made.keys() - set(ordered), key=lambda name: made[name].time)
    return [made[name] for name in (*ordered, *contradicting)]


def state_of(answer: history.Answer) -> State | None:
    """Returns what a host has now; None without a release."""
    return _state(answer.release, answer.secrets)


def _state(release: str | None, secrets: str) -> State | None:
    return None if release is None else State(release, secrets)


def _prev(entry: ChangeEntry) -> State | None:
    return _state(entry.previous, entry.previous_secrets)


def _next(entry: ChangeEntry) -> State | None:
    return _state(entry.next, entry.next_secrets)


def before_last(found: Sequence[Run], current: Mapping[str, State | None]) -> Mapping[str, State]:
    """Returns what hosts had before the last run whose change is in place, for its hosts.

    Raises ``NoWayBackError``.
    """
    for run in reversed(found):
        changed = {
            host: one
            for host, one in run.changes.items()
            if one.state == APPLIED and one.next is not None and current.get(host) == _next(one)
        }
        if changed:
            before = {host: _prev(one) for host, one in changed.items()}
            return _complete(before, "it was the first deploy of")
    raise NoWayBackError("no host has a change that could be taken back")


def of_release(entries: Sequence[ChangeEntry], release: str, current: State | None) -> State:
    """Returns the release with the secrets that it had last; with the ``current`` ones if no entry has it."""
    for entry in reversed(entries):
        for one in (_next(entry) if entry.state == APPLIED else None, _prev(entry)):
            if one and one.release == release:
                return one
    return State(release, current.secrets if current else "")


def after(found: Sequence[Run], name: str) -> Mapping[str, State]:
    """Returns what hosts had after the run whose name begins with ``name``.

    Raises ``NoWayBackError`` if there is none, or several.
    """
    numbers = [number for number, run in enumerate(found) if run.name.startswith(name)]
    if len(numbers) != 1:
        raise NoWayBackError(f"`{name}` is {'not a' if not numbers else 'more than one'} run of the history")
    states: dict[str, State | None] = {}
    for number, run in enumerate(found):
        for host, one in run.changes.items():
            if one.state != APPLIED:
                continue
            if number <= numbers[0]:
                states[host] = _next(one)
            else:
                states.setdefault(host, _prev(one))
    return _complete(states, "no release after that run:")


def _complete(states: Mapping[str, State | None], without: str) -> Mapping[str, State]:
    """Returns the states. Raises ``NoWayBackError`` for hosts that have none."""
    if first := sorted(host for host, state in states.items() if state is None):
        raise NoWayBackError(f"{without} {hostlist.written(first)}")
    return {host: state for host, state in states.items() if state is not None}
