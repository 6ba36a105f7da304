"""What dies if one part of a swarm dies: a host, master, network, program, adapter, line or robot. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

from swarmctl.spec.model import Spec
from swarmctl.topology import modes
from swarmctl.topology.wiring import KINDS, Needs, Part, Wiring

T = TypeVar("T")


@dataclass(frozen=True)
class Impact:
    """What is lost with one part. Robots whose driver dies are not counted again among the commanded."""

    kind: str
    name: str
    drivers: tuple[str, ...] = ()  # robots that lose their driver, and stop
    command: tuple[str, ...] = ()  # robots that nobody can order about any more, and stop
    masters: tuple[str, ...] = ()  # islands in which nothing joins again
    programs: tuple[str, ...] = ()
    data: tuple[tuple[str, str], ...] = ()  # topics, each with a program that lives and hears it no more
    optional: frozenset[str] = field(default=frozenset())  # those of the robots the swarm is complete without
    shared: bool = False  # whether several hosts had one of the masters in common

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots that are out of service."""
        return (*self.drivers, *self.command)

    @property
    def missed(self) -> tuple[str, ...]:
        """Those of them that the swarm is not complete without."""
        return tuple(robot for robot in self.robots if robot not in self.optional)

    @property
    def weight(self) -> tuple[int, ...]:
        """By how much it hurts: robots first, and of two parts that take as many, who takes drivers."""
        drivers = sum(robot not in self.optional for robot in self.drivers)
        lost = (self.robots, self.masters, self.programs, self.data)
        return (len(self.missed), drivers, *(len(one) for one in lost))

    @property
    def harmless(self) -> bool:
        return not any(self.weight)

    @property
    def single_point(self) -> bool:
        """Whether more dies with the part than the robot that it belongs to."""
        return len(self.robots) > 1 or self.shared or (self.kind == "program" and bool(self.robots))

    def to_json(self) -> dict[str, object]:
        return {
            "kind": self.kind,
            "name": self.name,
            "drivers": list(self.drivers),
            "command": list(self.command),
            "masters": list(self.masters),
            "programs": list(self.programs),
            "data": [{"topic": topic, "program": program} for topic, program in self.data],
            "optional": [robot for robot in self.robots if robot in self.optional],
        }


def impacts(spec: Spec) -> tuple[Impact, ...]:
    """One entry a part, the worst first; parts that hurt alike by their kind, then as in the spec."""
    wiring = Wiring(spec)
    drivers = _by_part((robot, needs) for robot, needs in wiring.drivers.items())
    command = _by_part(_commanded(wiring).items())
    masters = _by_part(wiring.masters.items())
    programs = _by_part((name, needs - {("program", name)}) for name, needs in wiring.programs.items())
    data = _by_part(((one.topic, one.program), one.needs - one.own) for one in wiring.hearings)
    shared = {island.name for island in wiring.islands if len(island.hosts) > 1}
    optional = frozenset(name for name in spec.robots if _is_optional(spec, name))
    found = [
        Impact(
            *part,
            drivers=drivers.get(part, ()),
            command=command.get(part, ()),
            masters=masters.get(part, ()),
            programs=programs.get(part, ()),
            data=data.get(part, ()),
            optional=optional,
            shared=not shared.isdisjoint(masters.get(part, ())),
        )
        for part in wiring.parts
    ]
    return tuple(sorted(found, key=lambda one: (*(-count for count in one.weight), KINDS.index(one.kind))))


def single_points(found: Iterable[Impact]) -> tuple[Impact, ...]:
    """Those parts that take more with them than the one robot they serve."""
    return tuple(one for one in found if one.single_point)


def _is_optional(spec: Spec, robot: str) -> bool:
    """A robot is optional itself, or by the host that drives it."""
    host = modes.driving_host(spec, robot)
    return spec.robots[robot].optional or (host is not None and spec.hosts[host].optional)


def _commanded(wiring: Wiring) -> Mapping[str, Needs]:
    """By robot: what all ways of ordering it about have in common, beside what its driver needs anyway."""
    ways: dict[str, Needs] = {}
    for order in wiring.orders:
        if order.needs is not None:
            ways[order.robot] = ways.get(order.robot, order.needs) & order.needs
    return {robot: needs - wiring.drivers[robot] for robot, needs in ways.items()}


def _by_part(needed: Iterable[tuple[T, Needs]]) -> dict[Part, tuple[T, ...]]:
    """The other way round: what ends with each part."""
    found: dict[Part, list[T]] = {}
    for one, needs in needed:
        for part in needs:
            found.setdefault(part, []).append(one)
    return {part: tuple(dict.fromkeys(ends)) for part, ends in found.items()}
