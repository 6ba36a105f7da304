"""The seam to the middleware that carries a swarm's topics: what ROS 1 does, and what another one must do.

To add one, write an object with the members of ``Middleware`` and register it under the distribution that
``ros.distro`` names (see ``swarmctl.plugins``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol, cast

from swarmctl.plugins import MIDDLEWARES
from swarmctl.render.bag_recorder import BagRecorder
from swarmctl.render.bundle import File, Part
from swarmctl.render.topic_tool import TopicTool
from swarmctl.resources import HostModule
from swarmctl.spec.model import Spec
from swarmctl.swarm.flow import Service
from swarmctl.swarm.ports import Listener, PortRange
from swarmctl.swarm.resolved import Host, Island, Program, Robot, Swarm
from swarmctl.swarm.topics import DriverTopic


@dataclass(frozen=True)
class Master:
    """The process at which all nodes of an island register: its URI and its systemd unit.

    ``cleanup``: a shell command that takes nodes out of it which have ended without leaving.
    """

    uri: str
    unit: str
    cleanup: str


@dataclass(frozen=True)
class DiscoveryServers:
    """The hosts with a server over which the nodes of an island find each other; its unit and its port."""

    hosts: tuple[str, ...]
    unit: str
    port: int
    protocol: Literal["tcp", "udp"]


@dataclass(frozen=True)
class ExpectedGate:
    """The gate in front of a driver: its unit, its node, and the topic on which it publishes. Full names."""

    unit: str
    node: str
    output: str
    output_type: str
    reports: DriverTopic


@dataclass(frozen=True)
class ExpectedDriver:
    """A robot's driver: its unit, its node, what it publishes, and the topic of its commands. Full names.

    ``node`` is empty where a launch file names the nodes.

    ``guarded``: it is swarmctl's, the main process of its unit, and rejects unauthorised publishers.
    ``gate`` rejects them in front of another driver; ``ungated``: why nothing does. ``parameters``: those
    that the node sets in the graph. ``provides``: services and actions, full name and type.
    """

    unit: str
    node: str
    topics: tuple[DriverTopic, ...]
    command: str
    command_type: str
    guarded: bool
    gate: ExpectedGate | None = None
    ungated: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    provides: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class ExpectedNode:
    """A program's unit and node (empty if nothing names it); topics are pairs of full name and type.

    ``measured``: those that it publishes at a declared rate; ``provides``: services and actions, alike.
    """

    unit: str
    name: str
    publishes: tuple[tuple[str, str], ...]
    subscribes: tuple[tuple[str, str], ...]
    measured: tuple[DriverTopic, ...] = ()
    provides: tuple[tuple[str, str], ...] = ()


#: What a rule can be about: a master, programs that are launched, launch files in XML, packages that catkin
#: builds, the names, parameters and checksums of nodes of ROS 1, a graph that has the host of each node,
#: and domains with discovery.
Capability = Literal[
    "master", "launched", "launch-xml", "catkin", "ros1-nodes", "node-hosts", "domains", "ipv6-servers"
]


class Middleware(Protocol):
    """One middleware. Parts are pure: the same swarm gives the same bytes."""

    @property
    def probe(self) -> HostModule:
        """The module that observes the graph for ``swarmctl status``, as a part of the agent of each host.

        Its function ``observe(request, answer)`` returns the ``Answer`` of
        ``swarm_onboard.agent.verbs.probe`` with what it sees. It and what it imports of its package run on
        Python 3.8 with the standard library and ``swarm_onboard.agent``.
        """

    @property
    def capabilities(self) -> frozenset[Capability]:
        """What it has of that which rules are about."""

    @property
    def settings(self) -> frozenset[str]:
        """The keys of `ros` that it uses, `distro` aside; a rule warns of the others."""

    @property
    def variables(self) -> frozenset[str]:
        """The environment variables that it sets for every program of a host, or unsets."""

    @property
    def launcher(self) -> str:
        """The command that reads launch files; empty if nothing does."""

    @property
    def topic_tool(self) -> TopicTool:
        """The command for topics, which ``swarmctl topic`` runs on hosts."""

    @property
    def bag_recorder(self) -> BagRecorder:
        """The command that ``swarmctl record`` runs on hosts."""

    @property
    def multimaster(self) -> str:
        """The provider in `swarmctl.plugins.MULTIMASTERS` that a spec has which names none; or empty."""

    @property
    def shared_files(self) -> frozenset[str]:
        """The files of a release on which all hosts must agree; they change on all hosts at once."""

    @property
    def topics(self) -> Mapping[str, str]:
        """The topics that every graph has, each with its type as a spec writes it: ``/rosout`` and others."""

    @property
    def master_mb(self) -> int:
        """Memory that the master takes on a hub, MB; 0 if nodes find each other without one."""

    def robots(self, swarm: Swarm, host: Host, island: Island) -> Iterable[Part]:
        """Returns environment and drivers of ``host``, and the master on the hub of ``island``."""

    def programs(self, swarm: Swarm, host: Host) -> Iterable[Part]:
        """Returns the programs of ``host`` that systemd units start."""

    def launch_files(self, swarm: Swarm, host: Host, island: Island) -> Iterable[File]:
        """Returns the launch files for people at a terminal of ``host``; no unit needs them."""

    def master(self, swarm: Swarm, island: Island) -> Master | None:
        """Returns the master of ``island``; None if nodes find each other without one."""

    def discovery_servers(self, swarm: Swarm, island: Island) -> DiscoveryServers | None:
        """Returns the servers of ``island``; None if nodes find each other without."""

    def driver(self, swarm: Swarm, robot: Robot) -> ExpectedDriver:
        """Returns what the driver of ``robot`` shows in the graph when all is well."""

    def program(self, swarm: Swarm, program: Program) -> ExpectedNode:
        """Returns what ``program`` shows in the graph when all is well."""

    def type_name(self, kind: str) -> str:
        """Returns how nodes name the message type ``kind`` of a spec, such as ``nav_msgs/Odometry``."""

    def listeners(self, spec: Spec, island: Island, processes: Mapping[str, int]) -> Iterable[Listener]:
        """Returns the ports that the middleware itself takes on the hosts of ``island``.

        ``processes``: how many processes with nodes each host runs.
        """

    def ports(self, island: Island) -> Mapping[Service, Sequence[PortRange]]:
        """Returns where hosts of ``island`` listen for others; where for the master, only its hub does."""

    def most_processes(self, island: Island) -> int | None:
        """Returns how many processes with nodes a host of ``island`` can run; None without such a limit."""

    def debian_packages(self, requirement: str) -> tuple[str, ...]:
        """Returns the Debian packages any of which brings ``requirement``, the best first; or none."""

    def package_source(self, platform: str) -> str:
        """Returns the server with its Debian packages for a platform that has none itself; or empty text."""

    def packages_of_key(self, key: str, *, headers: bool) -> tuple[str, ...]:
        """Returns Debian packages of a ROS package that a package.xml names, the best first.

        ``headers``: it is needed to compile.
        """

    def install_hints(self, missing: Sequence[str]) -> Iterator[str]:
        """Yields what to do on a host that lacks ``missing``, entries of ``Bundle.requires``."""


def middleware_at(swarm: Swarm, host: str) -> Middleware:
    """Returns the middleware of a host."""
    return middleware_of(swarm.distro_of(host))


def middleware_of(distro: str) -> Middleware:
    """Returns the middleware of a ROS distribution. Raises KeyError if none is registered."""
    return cast(Middleware, MIDDLEWARES.get(distro))
