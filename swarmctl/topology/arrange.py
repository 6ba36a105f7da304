"""A swarm in another mode, as values: who runs the master, who drives, who commands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from swarmctl.spec.model import Bluetooth, Mode, Serial, Spec
from swarmctl.topology.infer import commander_host, line_hosts, named_hub

Islands = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Order:
    """An entry of `control`: its index in the spec, or None for a new one."""

    index: int | None
    by: str
    of: tuple[str, ...]


@dataclass(frozen=True)
class Arrangement:
    """What a mode decides. ``homes`` says where each robot's line starts and its driver runs."""

    mode: Mode
    hub: str
    homes: Mapping[str, str]
    programs: Mapping[str, str]  # host by program, of those that are placed on a host
    orders: tuple[Order, ...]
    islands: Islands


class ArrangementError(Exception):
    """The swarm has not what the mode is about. The first argument says what, the second what to do."""


def arranged(spec: Spec, mode: Mode) -> Arrangement:
    """``spec`` in ``mode``; ArrangementError where the swarm lacks the hosts for it."""
    hub, homes = _centre(spec), line_hosts(spec)
    programs = {name: one.host for name, one in spec.programs.items() if one.host is not None}
    if mode is Mode.SINGLE_MINDED:
        homes, programs = dict.fromkeys(homes, hub), dict.fromkeys(programs, hub)
        return Arrangement(mode, hub, homes, programs, _from_hub(spec, hub), {})
    if len(spec.hosts) < 2:
        raise ArrangementError(
            f"mode `{mode.value}` needs a second computer, and the swarm has `{hub}` alone",
            "add a host, or stay in mode `single-minded`",
        )
    if set(homes.values()) <= {hub}:
        homes = _spread(spec, homes, hub)
    islands: Islands = {}
    orders = _orders(spec)
    if mode is Mode.LEADER:
        orders = _led(spec, orders, homes, hub)
    elif mode in (Mode.CENTRAL, Mode.STANDALONE):
        orders = _on_their_own(spec, orders, homes, hub)
    else:
        islands = _islands(spec, hub)
    return Arrangement(mode, hub, homes, programs, orders, islands)


def _centre(spec: Spec) -> str:
    """The host to build a mode around: the one named, that commands, that keeps the time, or the first."""
    homes = line_hosts(spec)
    commander = next((commander_host(spec, one.by, homes) for one in spec.control), None)
    return named_hub(spec) or commander or spec.time.root or next(iter(spec.hosts))


def _orders(spec: Spec) -> tuple[Order, ...]:
    return tuple(Order(index, one.by, one.of) for index, one in enumerate(spec.control))


def _from_hub(spec: Spec, hub: str) -> tuple[Order, ...]:
    """Other hosts run no ROS and command no longer; the hub commands their robots, if nobody else does."""
    hosts = set(spec.hosts) - {hub} - set(spec.programs) - set(spec.robots)
    kept = tuple(order for order in _orders(spec) if order.by not in hosts)
    led = {robot for one in kept for robot in one.of}
    freed = tuple(dict.fromkeys(robot for one in spec.control for robot in one.of if robot not in led))
    return (*kept, Order(None, hub, freed)) if freed else kept


def _spread(spec: Spec, homes: Mapping[str, str], hub: str) -> dict[str, str]:
    """Robots that all hang on one host, dealt out: each to the host it names, else in turn, the hub first."""
    hosts = [hub, *(name for name in spec.hosts if name != hub)]
    radios = [name for name in hosts if spec.hosts[name].bluetooth] or hosts
    by_radio = {link.robot for link in spec.links if isinstance(link, Bluetooth)}
    dealt: dict[str, str] = {}
    turn = 0
    for robot in homes:
        own = spec.robots[robot].host
        if own is not None and own != hub:
            dealt[robot] = own
            continue
        choice = radios if robot in by_radio else hosts
        dealt[robot] = choice[turn % len(choice)]
        turn += 1
    if set(dealt.values()) <= {hub}:  # one robot, or all by the hub's radio: the last one moves
        dealt[next(reversed(dealt))] = hosts[1]
    return dealt


def _led(spec: Spec, orders: tuple[Order, ...], homes: Mapping[str, str], hub: str) -> tuple[Order, ...]:
    """The hub's commands stay and those of others go; the hub commands every robot of another host."""
    kept = tuple(order for order in orders if commander_host(spec, order.by, homes) == hub)
    led = {robot for one in kept for robot in one.of}
    missing = tuple(robot for robot in homes if homes[robot] != hub and robot not in led)
    return (*kept, Order(None, hub, missing)) if missing else kept


def _on_their_own(
    spec: Spec, orders: tuple[Order, ...], homes: Mapping[str, str], hub: str
) -> tuple[Order, ...]:
    """The hub no longer commands robots of other hosts; each of these hosts commands its own instead."""
    kept, freed = [], []
    for order in orders:
        of = order.of
        if commander_host(spec, order.by, homes) == hub:
            of = tuple(robot for robot in of if homes[robot] == hub)
            freed += [robot for robot in order.of if robot not in of]
        if of:
            kept.append(Order(order.index, order.by, of))
    commanded = {robot for one in kept for robot in one.of}
    own: dict[str, list[str]] = {}
    for robot in dict.fromkeys(freed):
        if robot not in commanded:
            own.setdefault(homes[robot], []).append(robot)
    return (*kept, *(Order(None, host, tuple(robots)) for host, robots in own.items()))


def _islands(spec: Spec, hub: str) -> Islands:
    """The islands there are; else the hub on its own and the rest about its first host."""
    if len(spec.islands) > 1:
        return {name: island.model_dump(exclude_none=True) for name, island in spec.islands.items()}
    rest = [name for name in spec.hosts if name != hub]
    return {
        "main": {"mode": "central", "hub": hub, "hosts": (hub,)},
        "rest": {"mode": "central", "hub": rest[0], "hosts": tuple(rest)},
    }


def moved_lines(spec: Spec, arrangement: Arrangement) -> list[tuple[int, Serial | Bluetooth, str]]:
    """The lines that start at another host than before: index, link, and where it starts now."""
    return [
        (index, link, arrangement.homes[link.robot])
        for index, link in enumerate(spec.links)
        if isinstance(link, (Serial, Bluetooth)) and link.host != arrangement.homes[link.robot]
    ]
