"""Robots in use that a change would touch, or that would lose their commander, master or a bridge. Pure.

The drivers of the latter may run on any host. Such a robot stops only by its dead-man, and may drive off by
itself once the unit is back.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from swarm_onboard.agent.motion_gate import RobotUse, hint
from swarm_onboard.agent.steps import Kind

from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import HostPlan, Problem
from swarmctl.render.bundle import Bundle
from swarmctl.render.multimaster import provider_of
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Commander, Robot, Swarm, carrier, island_by_host

BUSY = "busy"
Stops = Mapping[str, Collection[str]]
"""The units that stop or restart, by host."""
_Needs = Callable[[Robot, Sequence[Commander], str], bool]
"""Whether a robot needs a unit for the commands of these commanders, sent by this node if that is known."""


@dataclass(frozen=True)
class Dependent:
    """A robot in use, the ``units`` on ``host`` on which it depends, and the end of a sentence about that."""

    robot: Robot
    host: str
    units: tuple[str, ...]
    why: str

    def __str__(self) -> str:
        return f"{self.robot.name} on {self.robot.host} {self.why}, and depends on {', '.join(self.units)}"


def stops_of(plan: HostPlan) -> tuple[str, ...]:
    """Returns the units that a plan stops or restarts."""
    return plan.targets(Kind.STOP, Kind.RESTART)


def not_busy(plan: HostPlan, bundle: Bundle, observed: Observed) -> HostPlan:
    """Returns the plan, with a problem if it would touch a robot that must not be touched now."""
    robots = {unit.name: unit.robot for unit in bundle.units}
    if observed.manifest is not None:
        robots |= {unit["name"]: unit.get("robot", "") for unit in observed.manifest["units"]}
    touched = {robots.get(unit, "") for unit in stops_of(plan)}
    found = [f"{robot} {why}" for robot, why in observed.busy.items() if robot in touched]
    text = "; ".join(found)
    return replace(plan, problem=Problem(BUSY, text, hint(text))) if found else plan


class Dependents:
    """What the robots of a swarm need for their commands, beside their own drivers."""

    def __init__(self, swarm: Swarm) -> None:
        self.swarm = swarm
        self._home = island_by_host(swarm.islands)

    def units_on(self, host: str) -> tuple[str, ...]:
        """Returns the units of a host on which robots may depend."""
        swarm = self.swarm
        parts = [one.name for one in swarm.programs_on(host) if one.runs_by_itself]
        if any(island.hub == host for island in swarm.islands):
            parts += [names.MASTER, names.MULTIMASTER]
        return tuple(names.unit(swarm.name, part) for part in parts)

    def robots(self, stops: Stops) -> dict[str, list[str]]:
        """Returns the robots that may depend on these units, by the host of their driver."""
        found: dict[str, list[str]] = {}
        needs = [one for _, _, one in self._needs(stops)]
        for robot in self.swarm.robots.values() if needs else ():
            if any(one(robot, robot.commanders, "") for one in needs):
                found.setdefault(robot.host, []).append(robot.name)
        return found

    def in_use(self, stops: Stops, uses: Mapping[str, RobotUse]) -> list[Dependent]:
        """Returns those of the robots in use that depend on these units, an entry for each host of units."""
        found: dict[tuple[str, str], list[str]] = {}
        robots = self.swarm.robots
        for host, unit, needs in self._needs(stops):
            for name, use in uses.items():
                if name in robots and needs(robots[name], *_sender(robots[name], use.commander)):
                    found.setdefault((name, host), []).append(unit)
        return [
            Dependent(robots[name], host, tuple(units), uses[name].why)
            for (name, host), units in sorted(found.items())
        ]

    def unknown(self, stops: Stops, errors: Mapping[str, str]) -> list[Dependent]:
        """Returns the robots that may depend on these units, on hosts of which only an error is known."""
        uses = {
            robot.name: RobotUse(f"may be in use: {errors[robot.host]}", "")
            for robot in self.swarm.robots.values()
            if robot.host in errors
        }
        return self.in_use(stops, uses)

    def _needs(self, stops: Stops) -> Iterator[tuple[str, str, _Needs]]:
        """Each of the units on which robots may depend: its host, its name, and for which robots."""
        for host, units in stops.items():
            for unit in units:
                part = unit.removeprefix(f"swarm-{self.swarm.name}.").removesuffix(".service")
                if part == names.MASTER:
                    yield host, unit, self._needs_master(host)
                elif part == names.MULTIMASTER:
                    yield host, unit, self._needs_multimaster(host)
                elif "." not in part and part not in self.swarm.robots and part != names.WLAN:
                    yield host, unit, self._needs_program(host, part)

    def _needs_master(self, host: str) -> _Needs:
        islands = [island for island in self.swarm.islands if island.hub == host]
        served = {one for island in islands for one in island.hosts}

        def needs(robot: Robot, commanders: Sequence[Commander], node: str) -> bool:
            # The master of an earlier release may have served any host.
            return not islands or bool(served & {robot.host, *map(self._host_of, commanders)})

        return needs

    def _needs_multimaster(self, host: str) -> _Needs:
        own = [island for island in self.swarm.islands if island.hub == host]
        everywhere = [
            one for one in own if not provider_of(self.swarm.multimaster, one.distro).only_receivers
        ]

        def needs(robot: Robot, commanders: Sequence[Commander], node: str) -> bool:
            to = self._home.get(robot.host)
            origins = [self._home.get(self._host_of(one)) for one in commanders]
            crossing = [one for one in origins if one != to]
            carried = [carrier(one, to) for one in crossing if one is not None and to is not None]
            return bool(crossing) and (
                not own or any(one in own for one in carried) or any(one in everywhere for one in crossing)
            )

        return needs

    def _needs_program(self, host: str, name: str) -> _Needs:
        program = self.swarm.programs.get(name)
        address = self.swarm.hosts[host].advertised
        named = program is None or program.declared.names_its_node
        own = program.node if program else f"/{name.replace('-', '_')}"

        def needs(robot: Robot, commanders: Sequence[Commander], node: str) -> bool:
            if any(one.name == name for one in commanders):
                return True
            if program is not None and program.declared.use is not None:
                return False  # a program of swarmctl commands the robots that `control` gives it
            if node and named:
                return node == own
            return any(one.includes(own, address) for one in commanders)

        return needs

    def _host_of(self, commander: Commander) -> str:
        """The host from which a commander sends; its own name if it is none of the spec's."""
        swarm, name = self.swarm, commander.name
        if name in swarm.programs:
            return swarm.programs[name].host
        return swarm.robots[name].host if name in swarm.robots else name


def problems(found: Iterable[Dependent]) -> dict[str, Problem]:
    """Returns the problem of each host on whose units robots in use depend."""
    texts: dict[str, list[str]] = {}
    for one in found:
        texts.setdefault(one.host, []).append(str(one))
    return {host: Problem(BUSY, text := "; ".join(those), hint(text)) for host, those in texts.items()}


def _sender(robot: Robot, commander: str) -> tuple[Sequence[Commander], str]:
    """The commander that a driver names, as NAME (NODE), and the node; all that it has if none is named."""
    name, _, node = commander.partition(" (")
    if not name:
        return robot.commanders, ""
    known = [one for one in robot.commanders if one.name == name]
    return known or [Commander(name, 0)], node.rstrip(")")
