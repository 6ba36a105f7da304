"""The resolved swarm: names looked up, defaults applied, drivers placed. What all later rooms read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from swarmctl.spec import model
from swarmctl.spec.model import Mode, Usb
from swarmctl.spec.multimaster import Multimaster
from swarmctl.spec.protocols import DriverName, RosserialProtocol
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.settings import RobotSettings
from swarmctl.topology import names
from swarmctl.topology.programs import INTERACTIVE


@dataclass(frozen=True)
class Host:
    """A computer of the swarm. ``address``: where the others reach it; ``advertised``: what its nodes say."""

    name: str
    address: str
    advertised: str
    user: str
    port: int
    via: str | None
    optional: bool


@dataclass(frozen=True)
class Network:
    """A wlan or an ethernet: who is on it and which addresses it has."""

    name: str
    kind: str
    hosts: tuple[str, ...]
    subnet: str | None
    multicast: bool | None


@dataclass(frozen=True)
class UsbLine:
    """A serial line through a USB adapter, known by its identity."""

    usb: Usb
    path: str


@dataclass(frozen=True)
class FixedLine:
    """A serial line on a device that never changes its name."""

    path: str


@dataclass(frozen=True)
class RfcommLine:
    """A Bluetooth serial line: which robot, over which adapter and channel, bound to which device.

    ``pin`` is the name of the secret that pairs them.
    """

    mac: str
    channel: int
    index: int
    adapter: str
    pin: str | None = None

    @property
    def path(self) -> str:
        return names.rfcomm_device(self.index)


Line = UsbLine | FixedLine | RfcommLine


@dataclass(frozen=True)
class Commander:
    """Who may command a robot: nodes by name, all in a namespace, all on some hosts (as they advertise).

    Of several who command at once the one with the highest ``priority`` is obeyed.
    """

    name: str
    priority: int
    nodes: tuple[str, ...] = ()
    namespace: str | None = None
    addresses: tuple[str, ...] = ()

    def includes(self, node: str, address: str) -> bool:
        """Whether ``node``, which is reached at ``address``, speaks for it: as its robot's driver decides."""
        return (
            node in self.nodes
            or address.lower() in (one.lower() for one in self.addresses)
            or (self.namespace is not None and node.startswith(self.namespace + "/"))
        )


@dataclass(frozen=True)
class Program:
    """A program with its place. ``said`` is what the spec says of it, ``commands`` the robots it commands."""

    name: str
    host: str
    node: str
    said: model.Program
    commands: tuple[str, ...] = ()

    @property
    def runs_by_itself(self) -> bool:
        """A unit runs it; not what is for a person at a terminal, nor a joystick that commands nobody."""
        return self.said.use is None or (self.said.use not in INTERACTIVE and bool(self.commands))


@dataclass(frozen=True)
class Robot:
    """A robot with its driver placed: on which host, over which line, with which settings."""

    name: str
    type_name: str
    type: RobotType
    settings: RobotSettings
    host: str
    line: Line
    baud: int | None
    optional: bool
    commanders: tuple[Commander, ...]
    driver: DriverName
    codec: bytes = b""  # the file with its protocol class, where its type has one

    @property
    def namespace(self) -> str:
        return names.namespace(self.name)

    @property
    def foreign_sketch(self) -> RosserialProtocol | None:
        """What runs on its board, where `rosserial_python` is its driver."""
        return self.type.foreign(self.driver)

    @property
    def driver_node(self) -> str:
        return names.driver_node(self.name)


@dataclass(frozen=True)
class Island:
    """Hosts that share one ROS graph. ``hub`` runs its master."""

    name: str
    hub: str
    hosts: tuple[str, ...]
    master_port: int


@dataclass(frozen=True)
class Bridge:
    """A topic that crosses from one island to others, and what in the spec asks for it."""

    topic: str
    type: str
    origin: str
    to: tuple[str, ...]
    cause: str


@dataclass(frozen=True)
class Swarm:
    """One swarm, resolved. Mappings keep the order of the spec."""

    name: str
    mode: Mode
    distro: str
    workspace: str | None
    hosts: Mapping[str, Host]
    robots: Mapping[str, Robot]
    networks: tuple[Network, ...]
    islands: tuple[Island, ...]
    bridges: tuple[Bridge, ...] = ()
    programs: Mapping[str, Program] = field(default_factory=dict)
    multimaster: Multimaster = field(default_factory=Multimaster)
    time: model.Time = field(default_factory=model.Time)

    @cached_property
    def heard(self) -> Mapping[str, Mapping[str, Mapping[str, str]]]:
        """By island that hears, by island of origin: the topics that cross, with their types."""
        found: dict[str, dict[str, dict[str, str]]] = {}
        for bridge in self.bridges:
            for to in bridge.to:
                found.setdefault(to, {}).setdefault(bridge.origin, {}).setdefault(bridge.topic, bridge.type)
        return found

    def island_of(self, host: str) -> Island:
        """The island of ``host``; in mode single-minded a host without ROS has none: KeyError."""
        for island in self.islands:
            if host in island.hosts:
                return island
        raise KeyError(host)

    def robots_on(self, host: str) -> tuple[Robot, ...]:
        return tuple(robot for robot in self.robots.values() if robot.host == host)

    def programs_on(self, host: str) -> tuple[Program, ...]:
        return tuple(program for program in self.programs.values() if program.host == host)

    def places_of(self, island: Island) -> tuple[str, ...]:
        """What may stand for a host in the URIs of the island's nodes: addresses and names, in lower case."""
        texts = (text.lower() for name in island.hosts for text in (self.hosts[name].address, name))
        return tuple(dict.fromkeys(texts))

    def master_uri(self, island: Island) -> str:
        """The same text for every host of the island, the hub included."""
        return f"http://{self.hosts[island.hub].advertised}:{island.master_port}"
