"""The hosts, networks and robots of a lab, computed from a resolved swarm."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from swarmctl.lab.driver_stand_ins import StandIn, stand_ins_of
from swarmctl.lab.emulators.emulator_lookup import NOT_MEASURED, Measured, emulator_for
from swarmctl.lab.emulators.robot import SilentRobot
from swarmctl.lab.errors import LabError
from swarmctl.lab.lab_addresses import (
    addresses_of,
    check_names,
    check_overlaps,
    check_subnets,
    check_unique,
    free,
    networks_of,
    subnet_on,
    with_prefix,
)
from swarmctl.links.bluetooth_link import RfcommLine
from swarmctl.plugins import LINK_KINDS
from swarmctl.robot_types.settings import Calibration
from swarmctl.spec.program_model import Container
from swarmctl.spec.selection_candidates import Candidates, RobotFacts
from swarmctl.swarm.addresses import ip_of
from swarmctl.swarm.resolved import Swarm
from swarmctl.swarm.used_packages import in_swarm
from swarmctl.yamltext import hostlist


@dataclass(frozen=True)
class LabNetwork:
    """A wlan or an ethernet. ``operator`` is the address of swarmctl in it, with the prefix length."""

    name: str
    kind: str
    subnet: str
    operator: str
    multicast: bool


@dataclass(frozen=True)
class Interface:
    """A network interface of a host; ``address`` includes the prefix length."""

    name: str
    network: str
    address: str


@dataclass(frozen=True)
class LabHost:
    """A Debian host with the address of the spec; its interfaces are in the order of the links.

    ``alias`` is the name that the spec has instead of an address; every host of the lab resolves it.
    ``distro``: of ROS.
    """

    name: str
    address: str
    user: str
    port: int
    interfaces: tuple[Interface, ...]
    alias: str = ""
    distro: str = ""


@dataclass(frozen=True)
class LabRobot:
    """A robot on a serial line.

    ``device`` is its path on the host; ``emulator`` is the emulated type or an emulator file, empty if there
    is none; ``measured`` is how the robot differs from its type.
    """

    name: str
    type: str
    host: str
    device: str
    bluetooth: bool
    emulator: str = ""
    measured: Measured = NOT_MEASURED


@dataclass(frozen=True)
class Workspace:
    """A built catkin workspace of this machine.

    Hosts see its ``folders`` at the same paths, since a build contains absolute paths; ``place``, the path of
    the workspace in the spec, is a link to its ``space`` (devel or install).
    """

    space: str
    place: str
    folders: tuple[str, ...]


@dataclass(frozen=True)
class LabPlan:
    """Everything that ``lab up`` creates. Equal plans describe the same lab.

    ``compilers``: its hosts have what builds packages, and what these run with; ``engines``: of containers,
    such as podman.
    """

    name: str
    swarm: str
    hosts: tuple[LabHost, ...]
    networks: tuple[LabNetwork, ...]
    robots: tuple[LabRobot, ...]
    workspace: Workspace | None = None
    stand_ins: tuple[StandIn, ...] = ()
    compilers: bool = False
    engines: tuple[str, ...] = ()

    def host(self, name: str) -> LabHost:
        """Returns the host of that name. Raises ``LabError`` if there is none."""
        return _named(self.hosts, name, f"lab {self.name} has no host")

    def robot(self, name: str) -> LabRobot:
        """Returns the robot of that name. Raises ``LabError`` if there is none."""
        return _named(self.robots, name, f"lab {self.name} has no robot")

    def robots_on(self, host: str) -> tuple[LabRobot, ...]:
        """Returns the robots whose lines are on ``host``."""
        return tuple(robot for robot in self.robots if robot.host == host)

    @property
    def distros(self) -> tuple[str, ...]:
        """The ROS distributions of its hosts."""
        return tuple(dict.fromkeys(host.distro for host in self.hosts))

    @property
    def aliases(self) -> tuple[tuple[str, str], ...]:
        """The names that hosts have instead of an address in the spec, each with its address in the lab."""
        return tuple((host.alias, host.address) for host in self.hosts if host.alias)

    def to_json(self) -> dict[str, Any]:
        """Returns the plan as JSON data; ``from_json`` reads it."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> LabPlan:
        """Returns the plan in JSON data that ``to_json`` has made."""
        return cls(
            name=data["name"],
            swarm=data["swarm"],
            hosts=tuple(
                LabHost(**{**host, "interfaces": tuple(Interface(**one) for one in host["interfaces"])})
                for host in data["hosts"]
            ),
            networks=tuple(LabNetwork(**network) for network in data["networks"]),
            robots=tuple(
                LabRobot(**{**robot, "measured": Measured(**robot.get("measured", {}))})
                for robot in data["robots"]
            ),
            workspace=None
            if data["workspace"] is None
            else Workspace(**{**data["workspace"], "folders": tuple(data["workspace"]["folders"])}),
            stand_ins=tuple(StandIn.from_json(one) for one in data.get("stand_ins", ())),
            compilers=data.get("compilers", False),
            engines=tuple(data.get("engines", ())),
        )


Named = TypeVar("Named", LabHost, LabRobot)


def _named(things: Iterable[Named], name: str, message: str) -> Named:
    known = {thing.name: thing for thing in things}
    if name not in known:
        raise LabError(f"{message} `{name}`", f"it has {', '.join(known) or 'none'}")
    return known[name]


def plan_of(
    swarm: Swarm,
    name: str | None = None,
    own: Mapping[str, Path] | None = None,
    boards: Mapping[str, Path] | None = None,
) -> LabPlan:
    """Returns the lab of a resolved swarm. Raises ``LabError`` if its addresses cannot be used in a lab.

    ``own``: the user's emulator files by robot type; ``boards``: board files (``write_board``) by robot.
    """
    addresses = addresses_of(swarm)
    check_names(addresses)
    check_unique(addresses)
    networks = tuple(networks_of(swarm, addresses))
    subnets = [subnet_on(network, addresses) for network in networks]
    check_overlaps(networks, subnets)
    labs: list[LabNetwork] = []
    interfaces: dict[str, list[Interface]] = {host: [] for host in addresses}
    for network, subnet in zip(networks, subnets, strict=True):
        unused = free(subnet, addresses.values())
        labs.append(
            LabNetwork(
                name=network.name,
                kind=network.kind,
                subnet=str(subnet),
                operator=with_prefix(next(unused), subnet),
                multicast=network.multicast is not False,
            )
        )
        for host in network.hosts:
            stem = LINK_KINDS.get(network.kind).interface_stem
            number = sum(known.name.startswith(stem) for known in interfaces[host])
            address = addresses[host] if addresses[host] in subnet else next(unused)
            interfaces[host].append(Interface(f"{stem}{number}", network.name, with_prefix(address, subnet)))
    check_subnets(addresses, {host: [one.address for one in own] for host, own in interfaces.items()})
    emulators = {
        robot.name: str((boards or {}).get(robot.name) or emulator_for(robot.type_name, own or {}))
        for robot in swarm.robots.values()
        if robot.line is not None
    }
    stand_ins = tuple(stand_ins_of(swarm, [name for name, found in emulators.items() if found]))
    silent = {one.robot: SilentRobot.type_name for one in stand_ins}
    return LabPlan(
        name=name or swarm.name,
        swarm=swarm.name,
        compilers=any(one.built_by for one in in_swarm(swarm)),
        hosts=tuple(
            LabHost(
                name=host.name,
                address=str(addresses[host.name]),
                user=host.user,
                port=host.port,
                interfaces=tuple(interfaces[host.name]),
                alias=host.address if ip_of(host.address) is None else "",
                distro=swarm.distro_of(host.name),
            )
            for host in swarm.hosts.values()
        ),
        networks=tuple(labs),
        robots=tuple(
            LabRobot(
                robot.name,
                robot.type_name,
                robot.host,
                robot.line.path,
                isinstance(robot.line, RfcommLine),
                emulators[robot.name] or silent.get(robot.name, ""),
                _measured(robot.settings.calibration),
            )
            for robot in swarm.robots.values()
            if robot.line is not None
        ),
        stand_ins=stand_ins,
        engines=tuple(sorted({one.engine for one in _containers(swarm)})),
    )


def _containers(swarm: Swarm) -> Iterable[Container]:
    found = (program.declared.container for program in swarm.programs.values())
    return [one for one in found if one is not None]


def _measured(calibration: Calibration) -> Measured:
    return Measured(calibration.distance_scale or 1.0, calibration.wheel_separation or 0.0)


def masters_for(swarm: Swarm, hosts: Collection[str]) -> Mapping[str, tuple[str, ...]]:
    """Returns the hosts outside of ``hosts`` that run their masters, each with the hosts that need it."""
    needed = {
        island.hub: tuple(host for host in island.hosts if host in hosts)
        for island in swarm.islands
        if island.hub not in hosts
    }
    return {hub: members for hub, members in needed.items() if members}


def part_of(plan: LabPlan, hosts: Collection[str]) -> LabPlan:
    """Returns the plan with only these hosts. Addresses are those of the whole lab."""
    kept = tuple(host for host in plan.hosts if host.name in hosts)
    networks = {one.network for host in kept for one in host.interfaces}
    return replace(
        plan,
        hosts=kept,
        networks=tuple(one for one in plan.networks if one.name in networks),
        robots=tuple(robot for robot in plan.robots if robot.host in hosts),
        stand_ins=tuple(one for one in plan.stand_ins if one.host in hosts),
    )


def candidates_of(plan: LabPlan) -> Candidates:
    """Returns the hosts, the emulated robots and those with stand-ins.

    Groups, labels and the types of stand-ins' robots are in the spec only.
    """
    stand_ins = {one.robot: RobotFacts("", one.host) for one in plan.stand_ins}
    return Candidates(
        hosts={host.name: () for host in plan.hosts},
        robots=stand_ins | {robot.name: RobotFacts(robot.type, robot.host) for robot in plan.robots},
    )


def names_all(known: Candidates, selections: Iterable[str]) -> bool:
    """Returns True if each selection is a name or a range of names of ``known``: it means the same there."""
    ranges = ((one, hostlist.read(one)) for one in selections)
    names = [found.names if isinstance(found, hostlist.Range) else (one,) for one, found in ranges]
    return all(name in known.hosts_and_robots for some in names for name in some)
