"""The hosts, networks and robots of a lab, computed from a resolved swarm."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

from swarmctl.lab.emulators.emulator_lookup import NOT_MEASURED, Measured, emulator_for
from swarmctl.lab.errors import LabError
from swarmctl.robot_types.settings import Calibration
from swarmctl.swarm.addresses import Ip, Subnet, ip_of, subnet_of, usual_subnet
from swarmctl.swarm.resolved import Network, RfcommLine, Swarm

OPERATOR = "operator"

UPLINK = "uplink"
INTERFACE_STEMS = {"wlan": "wlan", "ethernet": "eth"}


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
    """A Debian host with the address of the spec; its interfaces are in the order of the links."""

    name: str
    address: str
    user: str
    port: int
    interfaces: tuple[Interface, ...]


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
    """Everything that ``lab up`` creates. Equal plans describe the same lab."""

    name: str
    swarm: str
    hosts: tuple[LabHost, ...]
    networks: tuple[LabNetwork, ...]
    robots: tuple[LabRobot, ...]
    workspace: Workspace | None = None

    def host(self, name: str) -> LabHost:
        """Returns the host of that name. Raises ``LabError`` if there is none."""
        return _named(self.hosts, name, f"lab {self.name} has no host")

    def robot(self, name: str) -> LabRobot:
        """Returns the robot of that name. Raises ``LabError`` if there is none."""
        return _named(self.robots, name, f"lab {self.name} has no robot")

    def robots_on(self, host: str) -> tuple[LabRobot, ...]:
        """Returns the robots whose lines are on ``host``."""
        return tuple(robot for robot in self.robots if robot.host == host)

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
    addresses = {host.name: _address(host.name, host.address) for host in swarm.hosts.values()}
    _check_names(addresses)
    _check_unique(addresses)
    networks = tuple(_networks(swarm, addresses))
    subnets = [_subnet(network, addresses) for network in networks]
    _check_overlaps(networks, subnets)
    labs: list[LabNetwork] = []
    interfaces: dict[str, list[Interface]] = {host: [] for host in addresses}
    for network, subnet in zip(networks, subnets, strict=True):
        free = _free(subnet, addresses.values())
        labs.append(
            LabNetwork(
                name=network.name,
                kind=network.kind,
                subnet=str(subnet),
                operator=_with_prefix(next(free), subnet),
                multicast=network.multicast is not False,
            )
        )
        for host in network.hosts:
            stem = INTERFACE_STEMS[network.kind]
            number = sum(known.name.startswith(stem) for known in interfaces[host])
            address = addresses[host] if addresses[host] in subnet else next(free)
            interfaces[host].append(Interface(f"{stem}{number}", network.name, _with_prefix(address, subnet)))
    _check_subnets(addresses, interfaces)
    return LabPlan(
        name=name or swarm.name,
        swarm=swarm.name,
        hosts=tuple(
            LabHost(host.name, host.address, host.user, host.port, tuple(interfaces[host.name]))
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
                str((boards or {}).get(robot.name) or emulator_for(robot.type_name, own or {})),
                _measured(robot.settings.calibration),
            )
            for robot in swarm.robots.values()
        ),
    )


def _measured(calibration: Calibration) -> Measured:
    return Measured(calibration.distance_scale or 1.0, calibration.wheel_separation or 0.0)


def _address(host: str, given: str) -> Ip:
    found = ip_of(given)
    if found is None:
        raise LabError(
            f"host {host}: the address `{given}` is a name; a lab has no name server",
            "give the host an IP address in the spec",
        )
    return found


def _networks(swarm: Swarm, addresses: Mapping[str, Ip]) -> Iterator[Network]:
    """Yields the swarm's networks, and one per subnet for hosts without a network, so that swarmctl reaches
    them.
    """
    yield from swarm.networks
    linked = {host for network in swarm.networks for host in network.hosts}
    alone: dict[Subnet, list[str]] = {}
    for host, ip in addresses.items():
        if host not in linked:
            alone.setdefault(usual_subnet(ip), []).append(host)
    for number, (subnet, hosts) in enumerate(alone.items()):
        yield Network(f"{UPLINK}{number or ''}", "ethernet", tuple(hosts), str(subnet), None)


def _subnet(network: Network, addresses: Mapping[str, Ip]) -> Subnet:
    if network.subnet is not None:
        return subnet_of(network.subnet)
    found = ", ".join(f"{host} {addresses[host]}" for host in network.hosts)
    raise LabError(
        f"the hosts of network {network.name} are in several subnets: {found}", "set the `subnet` of the link"
    )


def _free(subnet: Subnet, taken: Iterable[Ip]) -> Iterator[Ip]:
    """Yields the unused addresses of ``subnet``, highest first: people number hosts from the lowest."""
    used = set(taken)
    last = int(subnet.broadcast_address) - 1
    for value in range(last, int(subnet.network_address), -1):
        address = type(subnet.network_address)(value)
        if address not in used:
            yield address
    raise LabError(
        f"the subnet {subnet} has no free address for swarmctl", "use a larger subnet for the link"
    )


def _with_prefix(address: Ip, subnet: Subnet) -> str:
    return f"{address}/{subnet.prefixlen}"


def _check_names(hosts: Iterable[str]) -> None:
    if OPERATOR in hosts:
        raise LabError(
            f"`{OPERATOR}` is the lab's name for this machine and cannot be a host", "rename the host"
        )


def _check_unique(addresses: Mapping[str, Ip]) -> None:
    holders: dict[Ip, str] = {}
    for host, address in addresses.items():
        if (first := holders.setdefault(address, host)) != host:
            raise LabError(
                f"hosts {first} and {host} both have the address {address}", "give each host its own address"
            )


def _check_overlaps(networks: Sequence[Network], subnets: Sequence[Subnet]) -> None:
    for index, (network, subnet) in enumerate(zip(networks, subnets, strict=True)):
        for other, another in zip(networks[:index], subnets[:index], strict=True):
            if subnet.version == another.version and subnet.overlaps(another):
                raise LabError(
                    f"networks {other.name} ({another}) and {network.name} ({subnet}) overlap, "
                    "so routes would be ambiguous",
                    "use a separate `subnet` for each link",
                )


def _check_subnets(addresses: Mapping[str, Ip], interfaces: Mapping[str, Sequence[Interface]]) -> None:
    for host, address in addresses.items():
        if not any(ipaddress.ip_interface(one.address).ip == address for one in interfaces[host]):
            raise LabError(
                f"host {host} has the address {address}, which is in none of its networks",
                "correct the address or the `subnet` of its links",
            )
