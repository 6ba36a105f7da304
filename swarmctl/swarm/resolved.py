"""The resolved swarm: names looked up, defaults applied, drivers placed. What render, health and lab read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

from swarm_onboard.tunnel.keys import Keys

from swarmctl.links.ip_link import IpLink
from swarmctl.links.link_base import Device, RobotLink
from swarmctl.plugins import SECURITY_LEVELS
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.robot_types.kinematics import Motion
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.robot_types.sensors import ODOM
from swarmctl.robot_types.settings import RobotSettings
from swarmctl.ros_packages.builds import Built
from swarmctl.ros_packages.package import DeliveredPackage
from swarmctl.ros_packages.urdf import Urdf
from swarmctl.spec import model
from swarmctl.spec import program_model as declared_program
from swarmctl.spec.install_model import Install
from swarmctl.spec.maintenance_model import NO_TERMS, Maintenance
from swarmctl.spec.model import Mode
from swarmctl.spec.reach import HostLogin
from swarmctl.spec.ros_model import Multimaster
from swarmctl.spec.selection_candidates import Candidates
from swarmctl.swarm import names
from swarmctl.swarm.command_topics import CommandTopic, is_gated
from swarmctl.swarm.discovery import Discovery, has_master
from swarmctl.swarm.flow import Flow, peers_of
from swarmctl.swarm.shipped_programs import INTERACTIVE
from swarmctl.swarm.topics import DriverTopic


@dataclass(frozen=True, kw_only=True)
class Host(HostLogin):
    """A computer of the swarm. ``address``: for SSH; ``ros_address``: for ROS, and in a sealed swarm another.

    ``advertised``: what the URIs of its nodes contain, an address or a name.

    ``platform`` is what its compiled programs are for, such as ``debian-12-x86_64-ros-1.15.15``; empty while
    it is unknown.
    """

    ros_address: str
    advertised: str
    optional: bool
    install: Install = field(default_factory=Install)
    workspaces: tuple[str, ...] = ()
    platform: str = ""


@dataclass(frozen=True)
class Network:
    """A wlan or an ethernet with its hosts and its subnet."""

    name: str
    kind: str
    hosts: tuple[str, ...]
    subnet: str | None
    multicast: bool | None


_Placed = TypeVar("_Placed", "Robot", "Program")


@dataclass(frozen=True)
class Commander:
    """A source of commands: nodes by name, or all in a namespace, on ``hosts``; and all at ``addresses``.

    Both are addresses as nodes advertise them. If several command at once, the driver follows the one with
    the highest ``priority``.
    """

    name: str
    priority: int
    nodes: tuple[str, ...] = ()
    namespace: str | None = None
    hosts: tuple[str, ...] = ()
    addresses: tuple[str, ...] = ()

    def includes(self, node: str, address: str) -> bool:
        """True if ``node`` at ``address`` belongs to this commander; the driver decides the same way.

        An empty address is that of a graph without hosts.
        """
        named = node in self.nodes or (self.namespace is not None and node.startswith(self.namespace + "/"))
        host = address.lower()
        return host in map(str.lower, self.addresses) or (
            named and (not host or host in map(str.lower, self.hosts))
        )


@dataclass(frozen=True)
class Program:
    """A program with its host. ``declared`` is its entry in the spec, ``commands`` the robots it commands."""

    name: str
    host: str
    node: str
    declared: declared_program.Program
    commands: tuple[str, ...] = ()
    beside: Mapping[str, bytes] = field(
        default_factory=dict
    )  # the files beside the spec that it gets, by path

    @property
    def runs_by_itself(self) -> bool:
        """True if a systemd unit starts it; False for terminal programs and a teleop without robots."""
        return not self.is_interactive and (self.declared.use is None or bool(self.commands))

    @property
    def is_interactive(self) -> bool:
        """True if a person starts it at a terminal."""
        return self.declared.use in INTERACTIVE or self.declared.lifecycle == "interactive"

    @property
    def namespace(self) -> str:
        """Its ROS namespace, such as /k3; empty if it has none."""
        return self.node.rpartition("/")[0]


@dataclass(frozen=True)
class SwarmctlDriver:
    """swarmctl's own driver, with what it needs to know of the robot."""

    type: RobotType
    line: Device
    baud: int
    codec: bytes = b""  # the Python file with the protocol class of the type; empty if it has none


@dataclass(frozen=True)
class ForeignDriver:
    """A ROS package as driver.

    ``ros`` has its placeholders filled in, ``motion`` is within the robot's limits, ``command_timeout`` is
    how long without a command, s, until the gate in front of it sends zeros.
    """

    ros: RosDriver
    motion: Motion
    command_timeout: float

    @property
    def gated(self) -> bool:
        """True if swarmctl's gate stands in front of its command topic."""
        return is_gated(self.ros, self.motion)


@dataclass(frozen=True)
class Robot:
    """A robot with its driver placed: on which host, over which line, with which settings.

    ``link`` is None for a robot that needs none. ``line`` is the device of a serial or Bluetooth link, and
    ``baud`` its bits per second.
    """

    name: str
    namespace: str  # in ROS, such as /k3 or /lab/k3
    type_name: str
    type: AnyRobotType
    settings: RobotSettings
    host: str
    link: RobotLink | None
    line: Device | None
    baud: int | None
    optional: bool
    commanders: tuple[Commander, ...]
    driver: SwarmctlDriver | ForeignDriver
    topics: tuple[DriverTopic, ...]  # what its driver publishes
    command: CommandTopic | None  # where it takes commands; None if it takes none
    start: model.StartPose | None = None
    maintenance: Maintenance = NO_TERMS
    urdf: Urdf | None = None  # of its own, or of its type, in place of the one that is made from a type

    @property
    def command_type(self) -> str:
        """The message type of its commands; empty if it takes none."""
        return self.command.type if self.command is not None else ""

    @property
    def odom_frame(self) -> str:
        """The frame of its odometry."""
        driver = self.driver
        return (
            driver.ros.odometry_frame if isinstance(driver, ForeignDriver) else f"{self.namespace[1:]}/{ODOM}"
        )

    @property
    def frame_prefix(self) -> str:
        """What its frames begin with, without the slash behind it; empty if its driver adds nothing."""
        return self.odom_frame.rpartition("/")[0]

    def full_name(self, topic: str) -> str:
        """The full name of one of its ``topics``."""
        return topic if topic.startswith("/") else f"{self.namespace}/{topic}"

    @property
    def node_address(self) -> str | None:
        """The address of a robot that runs nodes of ROS itself, such as a Create 3; None for others."""
        runs_nodes = isinstance(self.driver, ForeignDriver) and self.driver.ros.peer
        return self.link.address if runs_nodes and isinstance(self.link, IpLink) else None

    @property
    def host_address(self) -> str | None:
        """The address at which such a robot reaches its host, if that is another than the host's own."""
        if self.node_address is None or not isinstance(self.link, IpLink):
            return None
        usual = self.type.link if isinstance(self.type, RosRobotType) else None
        return self.link.host_address or (usual.host_address if usual is not None else None)

    @property
    def is_described(self) -> bool:
        """True if its `robot_description` is set: by swarmctl's driver, else from a URDF beside the spec."""
        return self.urdf is not None or isinstance(self.driver, SwarmctlDriver)

    @property
    def driver_node(self) -> str:
        """The name of the driver's node."""
        return names.driver_node(self.namespace)

    @property
    def gate_node(self) -> str:
        """The name of the node of the gate in front of its driver."""
        return names.gate_node(self.namespace)

    @property
    def gated(self) -> bool:
        """True if swarmctl's gate stands in front of its driver."""
        return isinstance(self.driver, ForeignDriver) and self.driver.gated


def _by_host(placed: Iterable[_Placed]) -> Mapping[str, tuple[_Placed, ...]]:
    """Robots or programs by host, in the order of the spec."""
    found: dict[str, list[_Placed]] = {}
    for one in placed:
        found.setdefault(one.host, []).append(one)
    return {host: tuple(on_host) for host, on_host in found.items()}


@dataclass(frozen=True)
class Island:
    """Hosts that share one ROS graph. ``hub`` runs its master; ROS 2 reads ``discovery`` instead."""

    name: str
    hub: str
    hosts: tuple[str, ...]
    distro: str
    master_port: int
    discovery: Discovery
    security: str = SECURITY_LEVELS.default

    @property
    def has_master(self) -> bool:
        """Whether its nodes register at a master, as those of ROS 1 do."""
        return has_master(self.distro)

    @property
    def filtered(self) -> bool:
        """Whether its hosts accept the packets of declared flows only."""
        return bool(SECURITY_LEVELS.get(self.security).filters)


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


def joinable(islands: Collection[Island]) -> frozenset[str]:
    """Returns the islands that a provider could join with others: those with masters, or those without."""
    numbers = Counter(one.has_master for one in islands)
    return frozenset(one.name for one in islands if numbers[one.has_master] > 1)


def carriers(islands: Iterable[Island], bridges: Iterable[Bridge]) -> frozenset[str]:
    """Returns the islands whose hubs carry topics: those that receive; of ROS 1 and ROS 2 that of ROS 2."""
    by_name = {one.name: one for one in islands}
    ends = ((by_name[bridge.origin], by_name[to]) for bridge in bridges for to in bridge.to)
    return frozenset(carrier(origin, to).name for origin, to in ends)


def carrier(origin: Island, to: Island) -> Island:
    """Returns the island whose hub brings topics of ``origin`` to ``to``."""
    return origin if to.has_master and not origin.has_master else to


def appears_on(host: str, homes: Mapping[str, Island], island: Island | None) -> str:
    """Returns the host on which nodes of ``host`` run for the graph of ``island``.

    Between ROS 1 and ROS 2 that is the hub that publishes in their names.
    """
    home = homes.get(host)
    if home is None or island is None or home.has_master is island.has_master:
        return host
    return carrier(home, island).hub


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
    flows: tuple[Flow, ...] = ()  # between its units of ROS
    programs: Mapping[str, Program] = field(default_factory=dict)
    multimaster: Multimaster = field(default_factory=Multimaster)
    time: model.Time = field(default_factory=model.Time)
    candidates: Candidates = field(default_factory=Candidates, compare=False, repr=False)  # of selections
    packages: Mapping[str, DeliveredPackage] = field(default_factory=dict)
    builders: tuple[str, ...] = ()
    builds: Mapping[str, Built] = field(default_factory=dict, repr=False)  # by their keys
    use_sim_time: bool = False
    sros2: bool = False
    keystore: Mapping[str, bytes] = field(default_factory=dict, repr=False)  # by path from the spec's folder
    ipv6: bool = False
    security: str = SECURITY_LEVELS.default
    overlay: str = ""  # the network of its WireGuard, if it has one
    relays: Mapping[str, Mapping[str, str]] = field(default_factory=dict)  # of WireGuard, by host and peer
    wireguard_keys: str = field(default="", repr=False)  # public ones, in lines of swarm_onboard.tunnel.keys

    @cached_property
    def received(self) -> Mapping[str, Mapping[str, Mapping[str, str]]]:
        """The bridged topics with their types, by receiving island, then by island of origin."""
        found: dict[str, dict[str, dict[str, str]]] = {}
        for bridge in self.bridges:
            for to in bridge.to:
                found.setdefault(to, {}).setdefault(bridge.origin, {}).setdefault(bridge.topic, bridge.type)
        return found

    @cached_property
    def carriers(self) -> frozenset[str]:
        """The islands whose hubs carry bridged topics."""
        return carriers(self.islands, self.bridges)

    @cached_property
    def keys(self) -> Keys:
        """The public WireGuard keys of its hosts."""
        return Keys(self.wireguard_keys)

    @cached_property
    def peers(self) -> Mapping[str, frozenset[str]]:
        """The other hosts with which the units of ROS of a host exchange packets, by host."""
        return peers_of(self.flows)

    @cached_property
    def command_topics(self) -> Mapping[str, CommandTopic]:
        """The topic on which each robot takes commands; robots that take none are left out."""
        return {name: one.command for name, one in self.robots.items() if one.command is not None}

    @cached_property
    def _islands_by_host(self) -> Mapping[str, Island]:
        return island_by_host(self.islands)

    @cached_property
    def _robots_by_host(self) -> Mapping[str, tuple[Robot, ...]]:
        return _by_host(self.robots.values())

    @cached_property
    def _programs_by_host(self) -> Mapping[str, tuple[Program, ...]]:
        return _by_host(self.programs.values())

    def island_of(self, host: str) -> Island:
        """Returns the island of ``host``.

        Raises KeyError for a host that runs no ROS (mode single-minded).
        """
        return self._islands_by_host[host]

    def distro_of(self, host: str) -> str:
        """Returns the ROS distribution of ``host``: that of its island."""
        island = self._islands_by_host.get(host)
        return island.distro if island is not None else self.distro

    @cached_property
    def distros(self) -> tuple[str, ...]:
        """The ROS distributions of its islands."""
        return tuple(dict.fromkeys(one.distro for one in self.islands)) or (self.distro,)

    def appears_on(self, host: str, island: Island) -> str:
        """Returns the host on which nodes of ``host`` run for the graph of ``island``."""
        return appears_on(host, self._islands_by_host, island)

    def robots_on(self, host: str) -> tuple[Robot, ...]:
        """Returns the robots whose drivers run on ``host``."""
        return self._robots_by_host.get(host, ())

    def programs_on(self, host: str) -> tuple[Program, ...]:
        """Returns the programs that run on ``host``."""
        return self._programs_by_host.get(host, ())

    def uri_hosts_of(self, island: Island) -> tuple[str, ...]:
        """Returns what URIs of the island's nodes may contain as host: addresses and names, in lower case."""
        texts = (text.lower() for name in island.hosts for text in (self.hosts[name].ros_address, name))
        return tuple(dict.fromkeys(texts))

    def master_uri(self, island: Island) -> str:
        """Returns the same text for every host of the island, the hub included."""
        return f"http://{self.hosts[island.hub].advertised}:{island.master_port}"
