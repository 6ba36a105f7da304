"""What the rules look at: one document, and what several of them ask of it, worked out once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property

from swarmctl.spec.diagnostics import Diagnostic, Span
from swarmctl.spec.load import Document
from swarmctl.spec.model import Bluetooth, Computer, NetworkLink, Serial, Spec
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.source import Loc, Source
from swarmctl.spec.tuning import command_timeout_of
from swarmctl.topology import modes
from swarmctl.topology.address import Ip, Subnet
from swarmctl.topology.authority import Authority
from swarmctl.topology.bridges import bridges_of
from swarmctl.topology.capacity import HostBudget, host_budgets
from swarmctl.topology.interfaces import Endpoint, program_endpoints
from swarmctl.topology.lines import LineBudget, layers, line_budgets
from swarmctl.topology.networks import addresses_of, subnets_of, witnesses_of
from swarmctl.topology.ports import Listener, listeners
from swarmctl.topology.publishers import Publishers
from swarmctl.topology.swarm import Bridge, Island

Line = Serial | Bluetooth


class Case:
    """A document under examination. Indexes keep the order of the spec; ``index`` counts in ``links``."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.spec: Spec = document.spec
        self.types: Mapping[str, RobotType] = document.types
        self.computers: Mapping[str, Computer] = document.computers

    @property
    def source(self) -> Source:
        return self.document.source

    def span(self, *loc: str | int, key: bool = False) -> Span:
        return self.document.span(*loc, key=key)

    @cached_property
    def lines(self) -> tuple[tuple[int, Line], ...]:
        """The serial and Bluetooth links."""
        found = enumerate(self.spec.links)
        return tuple((index, link) for index, link in found if isinstance(link, (Serial, Bluetooth)))

    @cached_property
    def lines_of(self) -> Mapping[str, list[tuple[int, Line]]]:
        """The lines of every robot; an empty list for a robot without."""
        lines: dict[str, list[tuple[int, Line]]] = {name: [] for name in self.spec.robots}
        for index, link in self.lines:
            if link.robot in lines:
                lines[link.robot].append((index, link))
        return lines

    @cached_property
    def networks(self) -> tuple[tuple[int, NetworkLink], ...]:
        """The wlan and ethernet links."""
        found = enumerate(self.spec.links)
        return tuple((index, link) for index, link in found if isinstance(link, NetworkLink))

    @cached_property
    def networks_of(self) -> Mapping[str, list[tuple[int, NetworkLink]]]:
        """The networks of every host; an empty list for a host without."""
        networks: dict[str, list[tuple[int, NetworkLink]]] = {name: [] for name in self.spec.hosts}
        for index, link in self.networks:
            for host in link.hosts:
                if host in networks:
                    networks[host].append((index, link))
        return networks

    @cached_property
    def network_at(self) -> Mapping[int, NetworkLink]:
        return dict(self.networks)

    @cached_property
    def members(self) -> Mapping[int, frozenset[str]]:
        """The hosts of every network, by its index."""
        return {index: frozenset(link.hosts) for index, link in self.networks}

    def meet(self, one: str, other: str) -> bool:
        """Whether two hosts share a network. Nobody is taken for a router."""
        return one == other or any(other in self.members[index] for index, _ in self.networks_of[one])

    @cached_property
    def addresses(self) -> Mapping[str, Ip | None]:
        """The IP address of every host; nothing for one that is called by a name."""
        return addresses_of(self.spec)

    @cached_property
    def witnesses(self) -> Mapping[int, tuple[str, ...]]:
        """By index, the hosts whose addresses tell which subnet a network has."""
        return witnesses_of(self.spec, self.addresses)

    @cached_property
    def subnets(self) -> Mapping[int, Subnet | None]:
        """The subnet of every network, by its index: as declared, or as its hosts show."""
        return subnets_of(self.spec, self.addresses, self.witnesses)

    def computer_of(self, host: str) -> str | None:
        """What kind of computer a host is, if that is said."""
        return self.spec.hosts[host].computer or self.spec.defaults.host.computer

    @cached_property
    def driving(self) -> Mapping[str, str | None]:
        """The host that drives each robot."""
        return {name: modes.driving_host(self.spec, name) for name in self.spec.robots}

    @cached_property
    def islands(self) -> tuple[Island, ...]:
        return modes.islands_of(self.spec)

    @cached_property
    def passages(self) -> frozenset[str]:
        """The hosts that are just there to jump through."""
        return modes.passages(self.spec)

    @cached_property
    def listeners(self) -> tuple[Listener, ...]:
        return tuple(listeners(self.spec, self.islands))

    @cached_property
    def home(self) -> Mapping[str, Island]:
        """The island of every host that runs ROS."""
        return {host: island for island in self.islands for host in island.hosts}

    @cached_property
    def authority(self) -> Authority:
        """Who may command each robot, as its driver will have it."""
        return Authority(self.spec, self.home)

    @cached_property
    def endpoints(self) -> tuple[Endpoint, ...]:
        """What programs publish and hear; what drivers do follows from their types (topology/interfaces)."""
        return tuple(program_endpoints(self.spec))

    @cached_property
    def publishers(self) -> Publishers:
        return Publishers(self.spec, self.types, self.islands, self.endpoints)

    @cached_property
    def bridges(self) -> tuple[Bridge, ...]:
        return bridges_of(self.spec, self.types, self.islands, self.endpoints)

    @cached_property
    def line_budgets(self) -> Mapping[int, LineBudget]:
        """What each line carries, by its index in ``links``."""
        return dict(line_budgets(self.spec, self.types, self.endpoints))

    @cached_property
    def command_timeouts(self) -> Mapping[str, float]:
        """Seconds after which each robot stops without an order. Robots of a type mostly have the same."""
        known: dict[tuple[str, float | None], float] = {}
        timeouts: dict[str, float] = {}
        for name, robot in self.spec.robots.items():
            key = (robot.type, robot.settings.command_timeout)
            if key not in known:
                kind = self.types[robot.type]
                known[key] = command_timeout_of(kind, *layers(self.spec, kind, robot.settings))
            timeouts[name] = known[key]
        return timeouts

    def said_timeout(self, robot: str) -> Loc:
        """Where the spec says when a robot stops without an order; nothing if its type or swarmctl does."""
        given = self.spec.robots[robot]
        if given.settings.command_timeout is not None:
            return ("robots", robot, "settings", "command_timeout")
        of_type = self.types[given.type].settings.command_timeout
        if of_type is None and self.spec.defaults.robot.command_timeout is not None:
            return ("defaults", "robot", "command_timeout")
        return ()

    @cached_property
    def host_budgets(self) -> tuple[HostBudget, ...]:
        """What runs on each host whose kind of computer is known."""
        return tuple(host_budgets(self.spec, self.computers, self.islands, self.bridges))


Rule = Callable[[Case], Iterator[Diagnostic]]
