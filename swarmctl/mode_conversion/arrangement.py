"""What a swarm looks like in another mode, as values: which hosts run the master, drive and command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from swarmctl.mode_conversion.infer import commander_line_host, named_hub
from swarmctl.spec.model import Bluetooth, Mode, Spec
from swarmctl.swarm.index import Line, SwarmIndex

Islands = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class ControlEntry:
    """An entry of `control`: its index in the spec, or None for a new one."""

    index: int | None
    by: str
    of: tuple[str, ...]


@dataclass(frozen=True)
class Arrangement:
    """What a mode determines. ``driver_hosts``: by robot, the host with its line and its driver."""

    mode: Mode
    hub: str
    driver_hosts: Mapping[str, str]
    programs: Mapping[str, str]  # host by program, of programs with a `host`
    control: tuple[ControlEntry, ...]
    islands: Islands


class ArrangementError(Exception):
    """The swarm lacks what the mode needs. The first argument is the problem, the second the fix."""


def arranged(index: SwarmIndex, mode: Mode) -> Arrangement:
    """The swarm in ``mode``. Raises ArrangementError if it lacks the hosts for it."""
    spec, hub, hosts = index.spec, _central_host(index), index.line_hosts
    programs = {name: one.host for name, one in spec.programs.items() if one.host is not None}
    if mode is Mode.SINGLE_MINDED:
        hosts, programs = dict.fromkeys(hosts, hub), dict.fromkeys(programs, hub)
        return Arrangement(mode, hub, hosts, programs, _from_hub(spec, hub), {})
    if len(spec.hosts) < 2:
        raise ArrangementError(
            f"mode `{mode.value}` needs a second computer, but `{hub}` is the only host",
            "add a host, or stay in mode `single-minded`",
        )
    if set(hosts.values()) <= {hub}:
        hosts = _spread(index, hub)
    islands: Islands = {}
    control = _control(spec)
    if mode is Mode.LEADER:
        control = _led(spec, hosts, hub)
    elif mode in (Mode.CENTRAL, Mode.STANDALONE):
        control = _independent(spec, hosts, hub)
    else:
        islands = _islands(spec, hub)
    return Arrangement(mode, hub, hosts, programs, control, islands)


def _central_host(index: SwarmIndex) -> str:
    """The host to build a mode around: the declared hub, else a commander, the time root, or the first."""
    spec = index.spec
    hosts = index.line_hosts
    commander = next((commander_line_host(spec, one.by, hosts) for one in spec.control), None)
    return named_hub(spec) or commander or spec.time.root or next(iter(spec.hosts))


def _control(spec: Spec) -> tuple[ControlEntry, ...]:
    return tuple(ControlEntry(index, one.by, one.of) for index, one in enumerate(spec.control))


def _from_hub(spec: Spec, hub: str) -> tuple[ControlEntry, ...]:
    """Other hosts run no ROS and cannot command; the hub commands their robots unless a program does."""
    hosts = set(spec.hosts) - {hub} - set(spec.programs) - set(spec.robots)
    kept = tuple(entry for entry in _control(spec) if entry.by not in hosts)
    led = {robot for one in kept for robot in one.of}
    freed = tuple(dict.fromkeys(robot for one in spec.control for robot in one.of if robot not in led))
    return (*kept, ControlEntry(None, hub, freed)) if freed else kept


def _spread(index: SwarmIndex, hub: str) -> dict[str, str]:
    """Robots distributed over the hosts: each to its own `host`, else in turn, the hub first."""
    spec = index.spec
    hosts = [hub, *(name for name in spec.hosts if name != hub)]
    radios = [name for name in hosts if spec.hosts[name].bluetooth] or hosts
    by_radio = {link.robot for _, link in index.lines if isinstance(link, Bluetooth)}
    spread: dict[str, str] = {}
    turn = 0
    for robot in index.line_hosts:
        own = spec.robots[robot].host
        if own is not None and own != hub:
            spread[robot] = own
            continue
        choice = radios if robot in by_radio else hosts
        spread[robot] = choice[turn % len(choice)]
        turn += 1
    if set(spread.values()) <= {hub}:  # one robot, or all by the hub's Bluetooth: the last one moves
        spread[next(reversed(spread))] = hosts[1]
    return spread


def _led(spec: Spec, hosts: Mapping[str, str], hub: str) -> tuple[ControlEntry, ...]:
    """Keeps the entries of commanders on the hub; the hub commands every robot of another host."""
    kept = tuple(entry for entry in _control(spec) if commander_line_host(spec, entry.by, hosts) == hub)
    led = {robot for one in kept for robot in one.of}
    missing = tuple(robot for robot in hosts if hosts[robot] != hub and robot not in led)
    return (*kept, ControlEntry(None, hub, missing)) if missing else kept


def _independent(spec: Spec, hosts: Mapping[str, str], hub: str) -> tuple[ControlEntry, ...]:
    """The hub no longer commands robots of other hosts; each of these hosts commands its own instead."""
    kept, freed = [], []
    for entry in _control(spec):
        of = entry.of
        if commander_line_host(spec, entry.by, hosts) == hub:
            of = tuple(robot for robot in of if hosts[robot] == hub)
            freed += [robot for robot in entry.of if robot not in of]
        if of:
            kept.append(ControlEntry(entry.index, entry.by, of))
    commanded = {robot for one in kept for robot in one.of}
    own: dict[str, list[str]] = {}
    for robot in dict.fromkeys(freed):
        if robot not in commanded:
            own.setdefault(hosts[robot], []).append(robot)
    return (*kept, *(ControlEntry(None, host, tuple(robots)) for host, robots in own.items()))


def _islands(spec: Spec, hub: str) -> Islands:
    """The declared islands; else one of the hub alone and one of all other hosts."""
    if len(spec.islands) > 1:
        return {name: island.model_dump(exclude_none=True) for name, island in spec.islands.items()}
    rest = [name for name in spec.hosts if name != hub]
    return {
        "main": {"mode": "central", "hub": hub, "hosts": (hub,)},
        "rest": {"mode": "central", "hub": rest[0], "hosts": tuple(rest)},
    }


def moved_lines(index: SwarmIndex, arrangement: Arrangement) -> list[tuple[int, Line, str]]:
    """The lines that move to another host: index, link, and the new host."""
    hosts = arrangement.driver_hosts
    return [
        (number, link, hosts[link.robot]) for number, link in index.lines if link.host != hosts[link.robot]
    ]
