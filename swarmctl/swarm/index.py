"""One lazy index over a document: what rules, analysis, resolve and mode conversion look up in a spec.

It serves a document with errors too. Once all names resolve, every attribute can be read; before that, only
those that look nothing up by a name of the spec. Mappings and tuples keep the order of the spec, and a link
is identified by its index in ``links``.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import cached_property

from swarmctl.robot_types.effective_settings import command_timeout_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.settings import RobotSettings, merged
from swarmctl.spec.load import Document
from swarmctl.spec.model import Bluetooth, Computer, NetworkLink, Program, Serial, Spec
from swarmctl.swarm import modes, names
from swarmctl.swarm.addresses import Ip, Subnet
from swarmctl.swarm.resolved import Island, island_by_host
from swarmctl.swarm.subnets import addresses_of, subnet_sources_of, subnets_of
from swarmctl.swarm.topics import Endpoint, program_endpoints
from swarmctl.yamltext.source import Loc

Line = Serial | Bluetooth


class SwarmIndex:
    """A document with its links, hosts, islands and settings by name. Each attribute is computed once."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.spec: Spec = document.spec
        self.types: Mapping[str, RobotType] = document.types
        self.computers: Mapping[str, Computer] = document.computers

    # Serial and Bluetooth lines

    @cached_property
    def lines(self) -> tuple[tuple[int, Line], ...]:
        """The serial and Bluetooth links."""
        found = enumerate(self.spec.links)
        return tuple((index, link) for index, link in found if isinstance(link, (Serial, Bluetooth)))

    @cached_property
    def lines_of(self) -> Mapping[str, list[tuple[int, Line]]]:
        """The lines of every robot; an empty list for a robot without a line."""
        lines: dict[str, list[tuple[int, Line]]] = {name: [] for name in self.spec.robots}
        for index, link in self.lines:
            if link.robot in lines:
                lines[link.robot].append((index, link))
        return lines

    def line_of(self, robot: str) -> Line | None:
        """Returns the line of a robot; a document without errors has at most one."""
        lines = self.lines_of[robot]
        return lines[-1][1] if lines else None

    @cached_property
    def line_hosts(self) -> Mapping[str, str]:
        """The host to which each robot's line is connected, in the order of ``links``."""
        return {link.robot: link.host for _, link in self.lines}

    def adapter_of(self, link: Bluetooth) -> str | None:
        """Returns the Bluetooth adapter that serves a line: as declared, else the first of its host."""
        return link.adapter or next(iter(self.spec.hosts[link.host].bluetooth), None)

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
    def members(self) -> Mapping[int, frozenset[str]]:
        """The hosts of every network, by its index."""
        return {index: frozenset(link.hosts) for index, link in self.networks}

    def meet(self, one: str, other: str) -> bool:
        """True if two hosts share a network. No host counts as a router."""
        return one == other or any(other in self.members[index] for index, _ in self.networks_of[one])

    def shared_networks(self, one: str, other: str) -> tuple[str, ...]:
        """Returns the names of the networks that two hosts share; none for a program without a host."""
        networks = self.networks_of.get(one, ())
        shared = (link.name for index, link in networks if other in self.members[index])
        return tuple(dict.fromkeys(shared))

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

    # Topics

    @cached_property
    def endpoints(self) -> tuple[Endpoint, ...]:
        """What programs publish and subscribe to; the topics of drivers follow from their robot types."""
        return tuple(program_endpoints(self.spec, self.program_hosts))

    @cached_property
    def robot_by_namespace(self) -> Mapping[str, str]:
        """The robot of each namespace, such as ``/koala``."""
        return {names.namespace(robot): robot for robot in self.spec.robots}

    # Settings

    def settings_of(self, robot: str) -> RobotSettings:
        """Returns the settings of a robot with those of its type and of `defaults` merged in."""
        return merged(*self.document.settings_layers(robot))

    @cached_property
    def command_timeouts(self) -> Mapping[str, float]:
        """Seconds without a command after which each robot stops. Robots of a type mostly have the same."""
        known: dict[tuple[str, float | None], float] = {}
        timeouts: dict[str, float] = {}
        for name, robot in self.spec.robots.items():
            key = (robot.type, robot.settings.command_timeout)
            if key not in known:
                layers = self.document.settings_layers(name)
                known[key] = command_timeout_of(self.types[robot.type], *layers)
            timeouts[name] = known[key]
        return timeouts

    def command_timeout_loc(self, robot: str) -> Loc:
        """Returns where the spec sets a robot's command timeout; empty if its type or swarmctl sets it."""
        given = self.spec.robots[robot]
        if given.settings.command_timeout is not None:
            return ("robots", robot, "settings", "command_timeout")
        of_type = self.types[given.type].settings.command_timeout
        if of_type is None and self.spec.defaults.robot.command_timeout is not None:
            return ("defaults", "robot", "command_timeout")
        return ()
