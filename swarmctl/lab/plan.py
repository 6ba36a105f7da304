"""What a lab consists of, as a value: hosts, networks, robots. Knows nothing of how they are made."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

from swarmctl.lab.emulated import AS_ITS_TYPE, Measured, emulator_of
from swarmctl.lab.errors import LabError
from swarmctl.spec.settings import Calibration
from swarmctl.topology.address import Ip, Subnet, ip_of, subnet_of, usual_subnet
from swarmctl.topology.swarm import Network, RfcommLine, Swarm

OPERATOR = "operator"

UPLINK = "uplink"
INTERFACE_STEMS = {"wlan": "wlan", "ethernet": "eth"}


@dataclass(frozen=True)
class LabNetwork:
    """A wlan or an ethernet. ``operator`` is the address (with its prefix) that swarmctl itself has there."""

    name: str
    kind: str
    subnet: str
    operator: str
    multicast: bool


@dataclass(frozen=True)
class Interface:
    """One end of a network inside a host; ``address`` carries its prefix."""

    name: str
    network: str
    address: str


@dataclass(frozen=True)
class LabHost:
    """A Debian machine to boot, at the spec's own address, with its interfaces in the order of the links."""

    name: str
    address: str
    user: str
    port: int
    interfaces: tuple[Interface, ...]


@dataclass(frozen=True)
class LabRobot:
    """A robot on a serial line. ``device`` is the path that the link names on the host; ``emulator`` is the
    type or the file that stands for it, empty if nothing does; ``measured`` is how the robot differs from it.
    """

    name: str
    type: str
    host: str
    device: str
    bluetooth: bool
    emulator: str = ""
    measured: Measured = AS_ITS_TYPE


@dataclass(frozen=True)
class Workspace:
    """A built catkin workspace of this machine. Hosts see its ``folders`` where they are here, since builds
    know their own path; at ``place``, where ROS or the spec's workspace is looked for, lies its ``space``."""

    space: str
    place: str
    folders: tuple[str, ...]


@dataclass(frozen=True)
class LabPlan:
    """Everything that ``lab up`` builds. Equal plans are the same lab."""

    name: str
    swarm: str
    hosts: tuple[LabHost, ...]
    networks: tuple[LabNetwork, ...]
    robots: tuple[LabRobot, ...]
    workspace: Workspace | None = None

    def host(self, name: str) -> LabHost:
        return _named(self.hosts, name, f"lab {self.name} has no host")

    def robot(self, name: str) -> LabRobot:
        return _named(self.robots, name, f"lab {self.name} has no robot")

    def robots_on(self, host: str) -> tuple[LabRobot, ...]:
        return tuple(robot for robot in self.robots if robot.host == host)

    def to_json(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> LabPlan:
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


def _named(things: Iterable[Named], name: str, complaint: str) -> Named:
    known = {thing.name: thing for thing in things}
    if name not in known:
        raise LabError(f"{complaint} `{name}`", f"it has {', '.join(known) or 'none'}")
    return known[name]


def plan_of(
    swarm: Swarm,
    name: str | None = None,
    own: Mapping[str, Path] | None = None,
    boards: Mapping[str, Path] | None = None,
) -> LabPlan:
    """The lab of a resolved swarm. Raises ``LabError`` for a swarm whose addresses no lab can have.

    ``own`` are emulators of one's own, by robot type; ``boards`` what runs a robot's own firmware, by robot.
    """
    addresses = {host.name: _address(host.name, host.address) for host in swarm.hosts.values()}
    _refuse_operator(addresses)
    _refuse_doubles(addresses)
    networks = tuple(_networks(swarm, addresses))
    subnets = [_subnet(network, addresses) for network in networks]
    _refuse_overlaps(networks, subnets)
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
    _refuse_strays(addresses, interfaces)
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
                str((boards or {}).get(robot.name) or emulator_of(robot.type_name, own or {})),
                _measured(robot.settings.calibration),
            )
            for robot in swarm.robots.values()
        ),
    )


def _measured(said: Calibration) -> Measured:
    return Measured(said.distance_scale or 1.0, said.wheel_separation or 0.0)


def _address(host: str, given: str) -> Ip:
    found = ip_of(given)
    if found is None:
        raise LabError(
            f"host {host} has the address `{given}`, a name; a lab has no name server",
            "give the host an IP address in the spec",
        )
    return found


def _networks(swarm: Swarm, addresses: Mapping[str, Ip]) -> Iterator[Network]:
    """The swarm's networks, and one for each subnet of hosts that are on none: swarmctl must reach them."""
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
        f"the hosts of network {network.name} lie in several subnets: {found}", "give the link its `subnet`"
    )


def _free(subnet: Subnet, taken: Iterable[Ip]) -> Iterator[Ip]:
    """Addresses of ``subnet`` that no host has, from the top: people number their hosts from the bottom."""
    used = set(taken)
    last = int(subnet.broadcast_address) - 1
    for value in range(last, int(subnet.network_address), -1):
        address = type(subnet.network_address)(value)
        if address not in used:
            yield address
    raise LabError(
        f"the subnet {subnet} has no free address left for swarmctl itself", "give the link a larger subnet"
    )


def _with_prefix(address: Ip, subnet: Subnet) -> str:
    return f"{address}/{subnet.prefixlen}"


def _refuse_operator(hosts: Iterable[str]) -> None:
    if OPERATOR in hosts:
        raise LabError(
            f"a host is called `{OPERATOR}`, as a lab calls this machine", "give the host another name"
        )


def _refuse_doubles(addresses: Mapping[str, Ip]) -> None:
    holders: dict[Ip, str] = {}
    for host, address in addresses.items():
        if (first := holders.setdefault(address, host)) != host:
            raise LabError(f"hosts {first} and {host} both have the address {address}", "give each its own")


def _refuse_overlaps(networks: Sequence[Network], subnets: Sequence[Subnet]) -> None:
    for index, (network, subnet) in enumerate(zip(networks, subnets, strict=True)):
        for other, another in zip(networks[:index], subnets[:index], strict=True):
            if subnet.version == another.version and subnet.overlaps(another):
                raise LabError(
                    f"networks {other.name} ({another}) and {network.name} ({subnet}) overlap; "
                    "no host could tell which way to send",
                    "give each link its own `subnet`",
                )


def _refuse_strays(addresses: Mapping[str, Ip], interfaces: Mapping[str, Sequence[Interface]]) -> None:
    for host, address in addresses.items():
        if not any(ipaddress.ip_interface(one.address).ip == address for one in interfaces[host]):
            raise LabError(
                f"host {host} has the address {address}, which is in none of its networks",
                "correct the address, or the `subnet` of its links",
            )
