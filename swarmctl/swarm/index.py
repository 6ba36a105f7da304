"""One lazy index over a document: what rules, analysis, resolve and mode conversion look up in a spec.

It serves a document with errors too. Once all names resolve, every attribute can be read; before that, only
those that look nothing up by a name of the spec. Mappings and tuples keep the order of the spec, and a link
is identified by its index in ``links``.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

from swarmctl.links.ip_link import IpLink
from swarmctl.links.link_base import Ends, Line, NetworkLink, RobotLink
from swarmctl.robot_types.any_robot_type import AnyRobotType, with_protocol
from swarmctl.robot_types.driver_params import command_timeout_of, command_type_of
from swarmctl.robot_types.kinematics import Motion, motion_of
from swarmctl.robot_types.robot_type import Link, RobotType
from swarmctl.robot_types.ros_driver import VELOCITIES, RosDriver
from swarmctl.robot_types.ros_robot_type import RosLink
from swarmctl.robot_types.settings import RobotSettings, merged
from swarmctl.spec.load import Document
from swarmctl.spec.model import Computer, Spec
from swarmctl.spec.program_model import Program
from swarmctl.swarm import modes, names
from swarmctl.swarm.addresses import Ip, IpEnds, Subnet, addresses_of, ends_of, subnet_sources_of, subnets_of
from swarmctl.swarm.command_topics import CommandTopic, command_topic, is_gated
from swarmctl.swarm.resolved import Island, island_by_host
from swarmctl.swarm.ros_drivers import placeholder_values, ros_driver_of
from swarmctl.swarm.topics import (
    DriverTopic,
    Endpoint,
    declared_topics,
    driver_topics,
    program_endpoints,
    sensors_of,
)

if TYPE_CHECKING:
    import networkx as nx


class SwarmIndex:
    """A document with its links, hosts, islands and settings by name. Each attribute is computed once."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.spec: Spec = document.spec
        self._settings: dict[tuple[str, str], RobotSettings] = {}
        self._shared: dict[tuple[str, str], list[int]] = {}  # networks of two hosts
        self._topics: dict[tuple[str, str], tuple[DriverTopic, ...]] = {}

    # Robot types and drivers

    @cached_property
    def types(self) -> Mapping[str, AnyRobotType]:
        """The robot types by name."""
        return self.document.types

    @cached_property
    def computers(self) -> Mapping[str, Computer]:
        """The kinds of computers by name."""
        return self.document.computers

    @cached_property
    def native_types(self) -> Mapping[str, RobotType]:
        """The robot types that have a protocol, which swarmctl's driver knows."""
        return with_protocol(self.types)

    @cached_property
    def native_robots(self) -> Mapping[str, RobotType]:
        """The types of the robots whose type has a protocol, by robot, whichever their driver."""
        found = ((name, self.types.get(robot.type)) for name, robot in self.spec.robots.items())
        return {name: one for name, one in found if isinstance(one, RobotType)}

    @cached_property
    def ros_drivers(self) -> Mapping[str, RosDriver]:
        """The ROS packages that drive robots, by robot; their placeholders are not filled in."""
        hosts, native = self.driving, self.native_types
        found = (
            (name, ros_driver_of(self.document, name, self.distro_of_host(hosts[name])))
            for name, robot in self.spec.robots.items()
            if robot.driver is not None or robot.type not in native
        )
        return {name: one for name, one in found if one is not None}

    @cached_property
    def _distros(self) -> Mapping[str, str]:
        return modes.distros_of_hosts(self.spec)

    def distro_of_host(self, host: str | None) -> str:
        """The ROS distribution of a host, or of the swarm."""
        return self._distros.get(host or "", self.spec.ros.distro)

    @cached_property
    def motions(self) -> Mapping[str, Motion]:
        """How the robots of each type move, of the types that robots have and of the spec's own."""
        used = {robot.type: None for robot in self.spec.robots.values()}
        kinematics = {
            name: self.types[name].kinematics
            for name in (used | dict.fromkeys(self.document.own_types))
            if name in self.types
        }
        return {name: one if isinstance(one, Motion) else motion_of(one) for name, one in kinematics.items()}

    @cached_property
    def gated(self) -> frozenset[str]:
        """The robots with swarmctl's gate in front of their driver."""
        foreign, motions, robots = self.ros_drivers.items(), self.motions, self.spec.robots
        return frozenset(name for name, one in foreign if is_gated(one, motions[robots[name].type]))

    @cached_property
    def command_topics(self) -> Mapping[str, CommandTopic]:
        """The topic on which each robot takes commands; robots that take none are left out."""
        drivers, motions, declared = self.ros_drivers, self.motions, self._declared_velocities
        found = (
            (
                name,
                command_topic(
                    self.namespaces[name],
                    drivers.get(name),
                    motions[robot.type],
                    command_type_of(*self.document.settings_layers(name)),
                    declared,
                ),
            )
            for name, robot in self.spec.robots.items()
            if robot.type in motions
        )
        return {name: one for name, one in found if one is not None}

    @cached_property
    def _declared_velocities(self) -> Mapping[str, set[str]]:
        """The message types of commands that programs declare to publish, by full topic."""
        found: dict[str, set[str]] = {}
        for name, program in self.spec.programs.items():
            for one in program.publishes:
                if one.type in VELOCITIES:
                    topic = names.resolved(one.topic, self.program_nodes[name], program.remap)
                    found.setdefault(topic, set()).add(one.type)
        return found

    @cached_property
    def robots_by_command(self) -> Mapping[str, tuple[str, ...]]:
        """The robots that take commands on a topic, by its full name."""
        found: dict[str, list[str]] = {}
        for name, one in self.command_topics.items():
            found.setdefault(one.topic, []).append(name)
        return {topic: tuple(robots) for topic, robots in found.items()}

    @cached_property
    def driven_robots(self) -> Mapping[str, RobotType]:
        """The types of the robots that swarmctl's driver drives, by robot."""
        foreign = self.ros_drivers
        return {name: one for name, one in self.native_robots.items() if name not in foreign}

    # Links between hosts and robots

    @cached_property
    def lines(self) -> tuple[tuple[int, RobotLink], ...]:
        """The links of robots."""
        found = enumerate(self.spec.links)
        return tuple((index, link) for index, link in found if isinstance(link, RobotLink))

    @cached_property
    def ip_links(self) -> Mapping[int, IpEnds]:
        """The udp and tcp links, by index in ``links``."""
        return {index: self.ends_of(link) for index, link in self.lines if isinstance(link, IpLink)}

    @cached_property
    def lines_of(self) -> Mapping[str, list[tuple[int, RobotLink]]]:
        """The links of every robot; an empty list for a robot without a link."""
        lines: dict[str, list[tuple[int, RobotLink]]] = {name: [] for name in self.spec.robots}
        for index, link in self.lines:
            if link.robot in lines:
                lines[link.robot].append((index, link))
        return lines

    def line_of(self, robot: str) -> RobotLink | None:
        """Returns the link of a robot; a document without errors has at most one."""
        lines = self.lines_of[robot]
        return lines[-1][1] if lines else None

    @cached_property
    def line_hosts(self) -> Mapping[str, str]:
        """The host to which each robot's link is connected, in the order of ``links``."""
        return {link.robot: link.host for _, link in self.lines}

    @cached_property
    def native_lines(self) -> tuple[tuple[int, Line, RobotType], ...]:
        """The lines of robots whose type has a protocol, with that type."""
        known = self.native_robots
        return tuple(
            (index, link, known[link.robot])
            for index, link in self.lines
            if isinstance(link, Line) and link.robot in known
        )

    def link_kinds(self, robot: str) -> tuple[str, ...]:
        """Returns the kinds of links that the type of ``robot`` takes; none if it needs no link."""
        link = self.types[self.spec.robots[robot].type].link
        return link.kinds if link is not None else ()

    def bauds_of(self, robot: str) -> tuple[int, ...]:
        """Returns the bits per second that the type of ``robot`` has, its usual rate first."""
        match self.types[self.spec.robots[robot].type].link:
            case Link(baud=usual, other_bauds=others):
                return (usual, *others)
            case RosLink(baud=int() as usual):
                return (usual,)
        return ()

    def baud_of(self, link: RobotLink) -> int | None:
        """Returns the bits per second of a line: as declared, else its robot type's; None if unknown."""
        if not isinstance(link, Line):
            return None
        return link.own_baud or next(iter(self.bauds_of(link.robot)), None)

    def adapter_of(self, link: RobotLink) -> str | None:
        """Returns what serves a link at its host and can serve others as well; None if nothing does."""
        return link.served_by(getattr(self.spec.hosts[link.host], link.adapters_key, ()))

    def ends_of(self, link: IpLink) -> IpEnds:
        """Returns both ends of a udp or tcp link, with what its robot type adds."""
        robot = self.spec.robots.get(link.robot)
        kind = self.types.get(robot.type) if robot is not None else None
        own = self.networks_of.get(link.host, ())
        return ends_of(link, kind, ((network, self.subnets[index]) for index, network in own))

    # Networks and addresses

    @cached_property
    def networks(self) -> tuple[tuple[int, NetworkLink], ...]:
        """The wlan and ethernet links."""
        found = enumerate(self.spec.links)
        return tuple((index, link) for index, link in found if isinstance(link, NetworkLink))

    @cached_property
    def network_at(self) -> Mapping[int, NetworkLink]:
        """The wlan and ethernet links by index."""
        return dict(self.networks)

    @cached_property
    def networks_of(self) -> Mapping[str, list[tuple[int, NetworkLink]]]:
        """The networks of every host; an empty list for a host without a network."""
        networks: dict[str, list[tuple[int, NetworkLink]]] = {name: [] for name in self.spec.hosts}
        for index, link in self.networks:
            for host in link.hosts:
                if host in networks:
                    networks[host].append((index, link))
        return networks

    @cached_property
    def topology(self) -> nx.Graph[Any]:
        """The graph of hosts, by name, and networks, by index: each host has an edge to each of its networks.

        It is bipartite: an edge for each pair of hosts would be 50 million in a network of 10 000.
        """
        import networkx as nx  # noqa: PLC0415  (loads for 0.1 s, and a swarm of one host does not need it)

        graph: nx.Graph[Any] = nx.Graph()
        graph.add_nodes_from((*self.spec.hosts, *self.network_at))
        graph.add_edges_from(
            (host, index) for host, networks in self.networks_of.items() for index, _ in networks
        )
        return graph

    def shared_networks(self, one: str, other: str) -> list[int]:
        """Returns the networks that two hosts share, by index. No host counts as a router."""
        found = self._shared.get((one, other))
        if found is None:
            graph = self.topology
            found = self._shared[one, other] = [index for index in graph[one] if graph.has_edge(index, other)]
        return found

    def meet(self, one: str, other: str) -> bool:
        """True if two hosts share a network, or are one."""
        return one == other or bool(self.shared_networks(one, other))

    @cached_property
    def addresses(self) -> Mapping[str, Ip | None]:
        """The IP address of every host; None for a host whose `address` is a name."""
        return addresses_of(self.spec)

    @cached_property
    def subnet_sources(self) -> Mapping[int, tuple[str, ...]]:
        """By network index, the hosts from whose addresses its subnet is inferred."""
        return subnet_sources_of(self.networks, self.addresses)

    @cached_property
    def subnets(self) -> Mapping[int, Subnet | None]:
        """The subnet of every network, by its index: as declared, else inferred from its hosts."""
        return subnets_of(self.network_at, self.addresses, self.subnet_sources)

    def computer_of(self, host: str) -> str | None:
        """Returns the kind of computer a host is, where the spec declares it."""
        return self.spec.hosts[host].computer or self.spec.defaults.host.computer

    # Islands and what runs where

    @cached_property
    def islands(self) -> tuple[Island, ...]:
        """The islands, without those whose hub is not declared."""
        return modes.islands_of(self.spec)

    @cached_property
    def home(self) -> Mapping[str, Island]:
        """The island of every host that runs ROS."""
        return island_by_host(self.islands)

    @cached_property
    def jump_hosts(self) -> frozenset[str]:
        """Hosts used only as SSH jump hosts."""
        return modes.jump_hosts(self.spec)

    @cached_property
    def driving(self) -> Mapping[str, str | None]:
        """The host that runs each robot's driver."""
        return {name: modes.driving_host(self.spec, name) for name in self.spec.robots}

    def island_of_robot(self, robot: str) -> Island | None:
        """Returns the island in which a robot's driver runs."""
        return self.home.get(self.driving[robot] or "")

    @cached_property
    def program_hosts(self) -> Mapping[str, str | None]:
        """The host of each program: its own, its robot's, or the first that has what it needs."""
        return {name: self._program_host(program) for name, program in self.spec.programs.items()}

    @cached_property
    def namespaces(self) -> Mapping[str, str]:
        """The ROS namespace of every robot, such as ``/koala`` or ``/lab/koala``."""
        return {name: names.robot_namespace(name, one.namespace) for name, one in self.spec.robots.items()}

    @cached_property
    def program_namespaces(self) -> Mapping[str, str]:
        """The ROS namespace of every program: its own, else its robot's, else empty."""
        return {
            name: f"/{one.namespace}" if one.namespace else self.namespaces.get(one.robot or "", "")
            for name, one in self.spec.programs.items()
        }

    @cached_property
    def program_nodes(self) -> Mapping[str, str]:
        """The node of each program, as it is called where the program does not name its nodes itself."""
        return {name: names.program_node(name, self.program_namespaces[name]) for name in self.spec.programs}

    def _program_host(self, program: Program) -> str | None:
        if program.host is not None:
            return program.host
        if program.robot is not None:
            return self.driving.get(program.robot)
        return next(self.able_hosts(program.needs), None) if program.needs else None

    def able_hosts(self, needs: Collection[str]) -> Iterator[str]:
        """Yields the hosts that run ROS and have all of ``needs``."""
        for name, host in self.spec.hosts.items():
            if host.has and set(needs) <= set(host.has) and name in self.home:
                yield name

    def commander_host(self, by: str) -> str | None:
        """Returns the host of a commander in `control` (program, robot or host); None if it has none."""
        if by in self.spec.programs:
            return self.program_hosts[by]
        if by in self.spec.robots:
            return self.driving[by]
        return by if by in self.spec.hosts else None

    def placeholders_of(self, robot: str) -> Mapping[str, str | int]:
        """Returns the placeholders that the driver of a robot may use, each with a value of its type."""
        link = self.line_of(robot)
        of_link = self.placeholders_of_link(link, "/dev") if link is not None else {}
        return placeholder_values(robot, "", "", "", of_link)

    def placeholders_of_link(self, link: RobotLink, device: str) -> Mapping[str, str | int]:
        """Returns what a link gives to placeholders; ``device`` is that of a line."""
        ends = self.ends_of(link) if isinstance(link, IpLink) else None
        ports = (ends.port, ends.local_ports) if ends is not None else ()
        return link.values(Ends(device, self.baud_of(link), *ports))

    # Topics

    def driver_topics(self, robot: str) -> tuple[DriverTopic, ...]:
        """Returns what the driver of ``robot`` publishes with its settings."""
        if (driver := self.ros_drivers.get(robot)) is not None:
            return declared_topics(driver, names.driver_node(self.namespaces[robot]))
        key = self._equipment(robot)
        if key not in self._topics:
            self._topics[key] = driver_topics(self.driven_robots[robot], self.settings_of(robot))
        return self._topics[key]

    def sensors_of(self, robot: str) -> Mapping[str, str]:
        """The message types of what its driver may publish, on or off, by name in its namespace."""
        if (driver := self.ros_drivers.get(robot)) is not None:
            declared = declared_topics(driver, names.driver_node(self.namespaces[robot]))
            return {one.name: one.type for one in declared}
        return self._sensors_of_types[self.spec.robots[robot].type]

    @cached_property
    def _sensors_of_types(self) -> Mapping[str, Mapping[str, str]]:
        used = {self.spec.robots[name].type: kind for name, kind in self.driven_robots.items()}
        return {name: sensors_of(kind) for name, kind in used.items()}

    @cached_property
    def endpoints(self) -> tuple[Endpoint, ...]:
        """What programs publish and subscribe to; the topics of drivers follow from their robot types."""
        return tuple(
            program_endpoints(self.spec, self.program_hosts, self.program_nodes, self.command_topics)
        )

    @cached_property
    def robot_by_namespace(self) -> Mapping[str, str]:
        """The robot of each namespace, such as ``/koala``."""
        return {namespace: robot for robot, namespace in self.namespaces.items()}

    def split_topic(self, topic: str) -> tuple[str, str]:
        """Returns the namespace of a robot and the rest: ``/lab/k3``, ``odom``; else the first namespace."""
        known = self.robot_by_namespace
        space = next((one for one in names.above(topic) if one in known), None)
        return names.split_topic(topic) if space is None else (space, topic[len(space) + 1 :])

    # Settings

    def settings_of(self, robot: str) -> RobotSettings:
        """Returns the settings of a robot with those of its type and of `defaults` merged in.

        Robots of a type with equal settings share them.
        """
        key = self._equipment(robot)
        if key not in self._settings:
            self._settings[key] = merged(*self.document.settings_layers(robot))
        return self._settings[key]

    def _equipment(self, robot: str) -> tuple[str, str]:
        """Returns the type of a robot, and its own settings as text: robots with the same are alike."""
        given = self.spec.robots[robot]
        own = given.settings
        return given.type, own.model_dump_json(exclude_unset=True) if own.model_fields_set else ""

    @cached_property
    def command_timeouts(self) -> Mapping[str, float]:
        """Seconds without a command after which each robot stops. Robots of a type mostly have the same."""
        known: dict[tuple[str, float | None], float] = {}
        timeouts: dict[str, float] = {}
        for name, robot in self.spec.robots.items():
            key = (robot.type, robot.settings.command_timeout)
            if key not in known:
                known[key] = command_timeout_of(*self.document.settings_layers(name))
            timeouts[name] = known[key]
        return timeouts
