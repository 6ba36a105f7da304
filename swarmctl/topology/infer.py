"""Which of the five modes a wiring is: from lines, masters and commands alone, whatever `mode` says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from swarmctl.spec.model import Bluetooth, Mode, Serial, Spec
from swarmctl.topology.modes import hub_of


@dataclass(frozen=True)
class Inference:
    """The mode, the host that everything turns about where there is one, and what tells."""

    mode: Mode
    hub: str | None
    because: tuple[str, ...]


def infer(spec: Spec) -> Inference:
    """The mode of a spec whose names all resolve (paper, section 4)."""
    if len(spec.islands) > 1:
        return Inference(
            Mode.COMBINED,
            None,
            (f"the hosts are split into {len(spec.islands)} islands, each with a master",),
        )
    hub = named_hub(spec)
    homes = line_hosts(spec)
    if hub is None and len(spec.hosts) > 1:
        return Inference(
            Mode.STANDALONE, None, ("no host is named as leader or hub: each runs a master of its own",)
        )
    hub = hub or next(iter(spec.hosts))
    elsewhere = sorted({home for home in homes.values() if home != hub} | _busy(spec, hub))
    if not elsewhere:
        return Inference(
            Mode.SINGLE_MINDED, hub, (f"every robot's line and every program starts at `{hub}`",)
        )
    facts = [f"one master, on `{hub}`; `{'`, `'.join(elsewhere[:3])}` work too"]
    return Inference(*_by_authority(spec, hub, homes, facts))


def _by_authority(
    spec: Spec, hub: str, homes: Mapping[str, str], because: list[str]
) -> tuple[Mode, str, tuple[str, ...]]:
    """Leader or central: the same wiring, told apart by who commands the robots of other hosts."""
    orders = commands(spec, homes)
    from_hub = sorted(robot for by, robot in orders if by == hub and homes.get(robot) != hub)
    others = sorted(robot for by, robot in orders if by != hub)
    if from_hub and not others:
        because.append(f"`{hub}` alone commands the robots of other hosts: `{'`, `'.join(from_hub[:3])}`")
        return Mode.LEADER, hub, tuple(because)
    if others:
        because.append(f"`{'`, `'.join(others[:3])}` are commanded from elsewhere than `{hub}`")
    else:
        because.append(f"nothing on `{hub}` commands a robot of another host")
    return Mode.CENTRAL, hub, tuple(because)


def named_hub(spec: Spec) -> str | None:
    """The host that the spec names to run the one master, under whichever key."""
    island = next(iter(spec.islands.values()), None)
    return spec.leader or spec.hub or (hub_of(island) if island is not None else None)


def line_hosts(spec: Spec) -> dict[str, str]:
    """The host at which each robot's line starts."""
    return {link.robot: link.host for link in spec.links if isinstance(link, (Serial, Bluetooth))}


def commands(spec: Spec, homes: Mapping[str, str]) -> set[tuple[str, str]]:
    """Who may command whom, as pairs of the commander's host and a robot."""
    found: set[tuple[str, str]] = set()
    for control in spec.control:
        host = commander_host(spec, control.by, homes)
        if host is not None:
            found.update((host, robot) for robot in control.of)
    return found


def commander_host(spec: Spec, by: str, homes: Mapping[str, str]) -> str | None:
    """The host on which a commander of `control` sits, by the lines."""
    if by in spec.programs:
        program = spec.programs[by]
        return program.host or homes.get(program.robot or "")
    return homes.get(by) if by in spec.robots else by


def _busy(spec: Spec, hub: str) -> set[str]:
    """Other hosts that programs are placed on."""
    return {one.host for one in spec.programs.values() if one.host is not None and one.host != hub}
