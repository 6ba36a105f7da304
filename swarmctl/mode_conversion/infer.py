"""Infers which of the five modes a wiring is: from lines, masters and commands, not from `mode`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from swarmctl.spec.model import Mode, Spec
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
