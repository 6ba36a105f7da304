"""The modes of a wiring: which one it is, and what it looks like in another mode."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.links.link_base import RobotLink
from swarmctl.spec.model import Mode, Spec
from swarmctl.swarm.authority import Authority
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.modes import hub_of
from swarmctl.yamltext import hostlist


@dataclass(frozen=True)
class Inference:
    """The mode, the host that runs its one master (None if there are several), and the reasons."""

    mode: Mode
    hub: str | None
    because: tuple[str, ...]


def infer(index: SwarmIndex) -> Inference:
    """The mode of a spec whose names all resolve (paper, section 4)."""
    spec = index.spec
    if len(spec.islands) > 1:
        return Inference(
            Mode.COMBINED,
            None,
            (f"the hosts are split into {len(spec.islands)} islands, each with a master",),
        )
    hub = named_hub(spec)
    if hub is None and len(spec.hosts) > 1:
        return Inference(
            Mode.STANDALONE, None, ("no `leader` or `hub` is declared: each host runs its own master",)
        )
    hub = hub or next(iter(spec.hosts))
    elsewhere = sorted({host for host in index.line_hosts.values() if host != hub} | _busy(spec, hub))
    if not elsewhere:
        return Inference(Mode.SINGLE_MINDED, hub, (f"every line and every program is on `{hub}`",))
    facts = [f"one master, on `{hub}`; robots or programs are also on {_listed(elsewhere)}"]
    return Inference(*_by_authority(index, hub, facts))


def _by_authority(index: SwarmIndex, hub: str, because: list[str]) -> tuple[Mode, str, tuple[str, ...]]:
    """Leader or central: the same wiring; only in mode leader nobody but the leader commands."""
    commands = _commands(index)
    led = sorted(robot for by, robot in commands if by == hub and index.line_hosts.get(robot) != hub)
    others = sorted(robot for by, robot in commands if by != hub)
    if others:
        because.append(f"{_listed(others)} are commanded from hosts other than `{hub}`")
        return Mode.CENTRAL, hub, tuple(because)
    island = next(iter(index.spec.islands.values()), None)
    if index.spec.hub is not None or (island is not None and island.hub is not None):
        because.append(f"`{hub}` is declared as `hub`, so each robot's own programs may command it")
        return Mode.CENTRAL, hub, tuple(because)
    if led:
        because.append(f"`{hub}` alone commands the robots of other hosts: {_listed(led)}")
    else:
        because.append(f"`{hub}` is declared as `leader`, and no other host commands")
    return Mode.LEADER, hub, tuple(because)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{text}`" for text, _ in hostlist.ranges_of(names))


def named_hub(spec: Spec) -> str | None:
    """The host that `leader`, `hub` or the first of `islands` declares to run the one master."""
    island = next(iter(spec.islands.values()), None)
    return spec.leader or spec.hub or (hub_of(island) if island is not None else None)


def _commands(index: SwarmIndex) -> set[tuple[str, str]]:
    """Who may command whom, as pairs of the commander's host and a robot."""
    found: set[tuple[str, str]] = set()
    for control in index.spec.control:
        host = commander_line_host(index.spec, control.by, index.line_hosts)
        if host is not None:
            found.update((host, robot) for robot in control.of)
    return found


def commander_line_host(spec: Spec, by: str, line_hosts: Mapping[str, str]) -> str | None:
    """The host of a commander in `control`; a robot counts at the host of its line, as no mode is known."""
    if by in spec.programs:
        program = spec.programs[by]
        return program.host or line_hosts.get(program.robot or "")
    return line_hosts.get(by) if by in spec.robots else by


def _busy(spec: Spec, hub: str) -> set[str]:
    """Hosts other than ``hub`` that programs are placed on."""
    return {one.host for one in spec.programs.values() if one.host is not None and one.host != hub}


Islands = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class ControlEntry:
    """A new entry of `control`."""

    by: str
    of: tuple[str, ...]


@dataclass(frozen=True)
class Arrangement:
    """What a mode determines. ``driver_hosts``: by robot, the host with its line and its driver.

    ``control`` has what the old mode allowed without an entry and the new one does not.
    """

    mode: Mode
    hub: str
    driver_hosts: Mapping[str, str]
    programs: Mapping[str, str]  # host by program, of programs with a `host`
    control: tuple[ControlEntry, ...]
    islands: Islands


class ArrangementError(Exception):
    """The swarm lacks what the mode needs. The first argument is the problem, the others are fixes."""


def arranged(index: SwarmIndex, mode: Mode) -> Arrangement:
    """The swarm in ``mode``. Raises ArrangementError if hosts for it are missing or a commander is lost."""
    spec, hosts, ros_hosts = index.spec, index.line_hosts, _ros_hosts(index)
    if mode is not spec.mode and any(one.distro != spec.ros.distro for one in index.islands):
        raise ArrangementError(
            f"mode `{mode.value}` has no islands with a ROS distribution of their own",
            "stay in mode `combined` until all have one; `mode convert --ros DISTRO` writes that",
        )
    hub = _central_host(index, mode)
    programs = {name: one.host for name, one in spec.programs.items() if one.host is not None}
    granted = () if mode is spec.mode else implicit_commanders(index)
    if mode is not Mode.SINGLE_MINDED and len(ros_hosts) < 2:
        raise ArrangementError(
            f"mode `{mode.value}` needs a second computer, but `{hub}` is the only host",
            "add a host, or stay in mode `single-minded`",
        )
    if mode is Mode.SINGLE_MINDED:
        hosts, programs = dict.fromkeys(hosts, hub), dict.fromkeys(programs, hub)
    elif set(hosts.values()) <= {hub}:
        hosts = _spread(index, hub)
    if mode in (Mode.SINGLE_MINDED, Mode.LEADER):
        _refuse_other_commanders(index, mode, hub, hosts, granted)
        granted = ()
    islands = _islands(index, hub) if mode is Mode.COMBINED else {}
    return Arrangement(mode, hub, hosts, programs, granted, islands)


def implicit_commanders(index: SwarmIndex) -> tuple[ControlEntry, ...]:
    """What a leader commands without an entry of `control`: the robots of its island that are in no entry."""
    listed = {robot for one in index.spec.control for robot in one.of}
    authority = Authority(index)
    led: dict[str, list[str]] = {}
    for robot in index.spec.robots:
        leader = authority.leader_of(robot)
        if robot not in listed and leader is not None:
            led.setdefault(leader, []).append(robot)
    return tuple(ControlEntry(leader, tuple(robots)) for leader, robots in led.items())


def _refuse_other_commanders(
    index: SwarmIndex, mode: Mode, hub: str, hosts: Mapping[str, str], granted: tuple[ControlEntry, ...]
) -> None:
    """Raises ArrangementError if a host other than ``hub`` commands: the mode would take that away."""
    lost = []
    for by, of in (*((one.by, one.of) for one in index.spec.control), *((one.by, one.of) for one in granted)):
        moves = mode is Mode.SINGLE_MINDED and (by in index.spec.programs or by in index.spec.robots)
        if not moves and _home(index, by, hosts) != hub:
            lost.append(f"{{by: {by}, of: [{', '.join(of)}]}}")
    if lost:
        raise ArrangementError(
            f"in mode `{mode.value}` only `{hub}` commands, which would take authority from others: "
            f"{'; '.join(lost)}",
            f"remove these entries of `control`, or give them to `{hub}` or to a program on it, then convert",
            "or choose a mode in which every host may command: `central`, `standalone` or `combined`",
        )


def _home(index: SwarmIndex, by: str, hosts: Mapping[str, str]) -> str | None:
    return commander_line_host(index.spec, by, hosts) or index.program_hosts.get(by)


def _central_host(index: SwarmIndex, mode: Mode) -> str:
    """The host to build a mode around: the declared hub, else a commander, the time root, or the first.

    A leader is the one host that commands, if one host alone does.
    """
    spec = index.spec
    commanders = [_home(index, one.by, index.line_hosts) for one in spec.control]
    if mode is Mode.LEADER and mode is not spec.mode and len(set(commanders)) == 1 and commanders[0]:
        return commanders[0]
    commander = next((one for one in commanders if one is not None), None)
    return named_hub(spec) or commander or spec.time.root or _ros_hosts(index)[0]


def _spread(index: SwarmIndex, hub: str) -> dict[str, str]:
    """Robots distributed over the hosts: each to its own `host`, else in turn, the hub first."""
    spec = index.spec
    hosts = [hub, *(name for name in _ros_hosts(index) if name != hub)]
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


def _ros_hosts(index: SwarmIndex) -> list[str]:
    """The hosts that may run ROS: all but those used only as SSH jump hosts."""
    return [name for name in index.spec.hosts if name not in index.jump_hosts]


def _islands(index: SwarmIndex, hub: str) -> Islands:
    """The declared islands; else one of the hub alone and one of all other hosts."""
    spec = index.spec
    if len(spec.islands) > 1:
        return {name: island.model_dump(exclude_none=True) for name, island in spec.islands.items()}
    rest = [name for name in _ros_hosts(index) if name != hub]
    return {
        "main": {"mode": "central", "hub": hub, "hosts": (hub,)},
        "rest": {"mode": "central", "hub": rest[0], "hosts": tuple(rest)},
    }


def moved_lines(index: SwarmIndex, arrangement: Arrangement) -> list[tuple[int, RobotLink, str]]:
    """The links of robots that move to another host: index, link, and the new host."""
    hosts = arrangement.driver_hosts
    return [
        (number, link, hosts[link.robot]) for number, link in index.lines if link.host != hosts[link.robot]
    ]
