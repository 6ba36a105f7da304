"""The resolved swarm: names looked up, defaults applied, drivers placed. What render, health and lab read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from swarmctl.robot_types.protocols import DriverName, RosserialProtocol
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.settings import RobotSettings
from swarmctl.spec import model
from swarmctl.spec.model import Mode, Usb
from swarmctl.spec.multimaster_model import Multimaster
from swarmctl.swarm import names
from swarmctl.swarm.shipped_programs import INTERACTIVE


@dataclass(frozen=True)
class Host:
    """A computer of the swarm. ``address``: where others reach it; ``advertised``: what its URIs contain.

    ``declared`` names those of ``user`` and ``port`` that the spec sets; the others are defaults.
    """

    name: str
    address: str
    advertised: str
    user: str
    port: int
    via: str | None
    optional: bool
    declared: frozenset[str] = field(default=frozenset(), compare=False)


@dataclass(frozen=True)
class Network:
    """A wlan or an ethernet with its hosts and its subnet."""

    name: str
    kind: str
    hosts: tuple[str, ...]
    subnet: str | None
    multicast: bool | None


@dataclass(frozen=True)
class UsbLine:
    """A serial line through a USB adapter that is identified by its vendor, product or serial number."""

    usb: Usb
    path: str


@dataclass(frozen=True)
class FixedLine:
    """A serial line on a device with a fixed path."""

    path: str


@dataclass(frozen=True)
class RfcommLine:
    """A Bluetooth serial line: the robot's MAC, the adapter, the channel, and the bound rfcomm device.

    ``pin`` is the name of the secret with the pairing PIN.
    """

    mac: str
    channel: int
    index: int
    adapter: str
    pin: str | None = None

    @property
    def path(self) -> str:
        """The device, such as /dev/rfcomm0."""
        return names.rfcomm_device(self.index)


Line = UsbLine | FixedLine | RfcommLine


@dataclass(frozen=True)
class Commander:
    """A source of commands: nodes by name, every node in a namespace, every node with one of ``addresses``.

    If several command at once, the driver follows the one with the highest ``priority``.
    """

    name: str
    priority: int
    nodes: tuple[str, ...] = ()
    namespace: str | None = None
    addresses: tuple[str, ...] = ()

    def includes(self, node: str, address: str) -> bool:
        """True if ``node`` at ``address`` belongs to this commander; the driver decides the same way."""
        return (
            node in self.nodes
            or address.lower() in (one.lower() for one in self.addresses)
            or (self.namespace is not None and node.startswith(self.namespace + "/"))
        )


@dataclass(frozen=True)
class Program:
    """A program with its host. ``declared`` is its entry in the spec, ``commands`` the robots it commands."""

    name: str
    host: str
    node: str
    declared: model.Program
    commands: tuple[str, ...] = ()

    @property
    def runs_by_itself(self) -> bool:
        """True if a systemd unit starts it; False for terminal programs and a teleop without robots."""
        return self.declared.use is None or (self.declared.use not in INTERACTIVE and bool(self.commands))


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
    codec: bytes = b""  # the Python file with its protocol class; empty if its type has none

    @property
    def namespace(self) -> str:
        """The ROS namespace, such as /k3."""
        return names.namespace(self.name)

    @property
    def foreign_sketch(self) -> RosserialProtocol | None:
        """The sketch on its board if `rosserial_python` is its driver."""
        return self.type.foreign(self.driver)

    @property
    def driver_node(self) -> str:
        """The name of the driver's node."""
        return names.driver_node(self.name)


@dataclass(frozen=True)
class Island:
    """Hosts that share one ROS graph. ``hub`` runs its master."""

    name: str
    hub: str
    hosts: tuple[str, ...]
    master_port: int


def island_by_host(islands: Iterable[Island]) -> Mapping[str, Island]:
    """Returns the island of every host that runs ROS."""
    return {host: island for island in islands for host in island.hosts}


@dataclass(frozen=True)
class Bridge:
    """A topic that is bridged from one island to others, and the entry of the spec that needs it."""

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
    def received(self) -> Mapping[str, Mapping[str, Mapping[str, str]]]:
        """The bridged topics with their types, by receiving island, then by island of origin."""
        found: dict[str, dict[str, dict[str, str]]] = {}
        for bridge in self.bridges:
            for to in bridge.to:
                found.setdefault(to, {}).setdefault(bridge.origin, {}).setdefault(bridge.topic, bridge.type)
        return found

    @cached_property
    def _islands_by_host(self) -> Mapping[str, Island]:
        return island_by_host(self.islands)

    def island_of(self, host: str) -> Island:
        """Returns the island of ``host``.

        Raises KeyError for a host that runs no ROS (mode single-minded).
        """
        return self._islands_by_host[host]

    def robots_on(self, host: str) -> tuple[Robot, ...]:
        """Returns the robots whose drivers run on ``host``."""
        return tuple(robot for robot in self.robots.values() if robot.host == host)

    def programs_on(self, host: str) -> tuple[Program, ...]:
        """Returns the programs that run on ``host``."""
        return tuple(program for program in self.programs.values() if program.host == host)

    def uri_hosts_of(self, island: Island) -> tuple[str, ...]:
        """Returns what URIs of the island's nodes may contain as host: addresses and names, in lower case."""
        texts = (text.lower() for name in island.hosts for text in (self.hosts[name].address, name))
        return tuple(dict.fromkeys(texts))

    def master_uri(self, island: Island) -> str:
        """Returns the same text for every host of the island, the hub included."""
        return f"http://{self.hosts[island.hub].advertised}:{island.master_port}"
