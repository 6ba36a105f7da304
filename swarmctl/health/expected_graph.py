"""The expected graph: what each host and robot of a healthy swarm shows. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from swarmctl.links.bluetooth_link import RfcommLine
from swarmctl.render.bundle import package
from swarmctl.render.middleware import DiscoveryServers, ExpectedDriver, middleware_at, middleware_of
from swarmctl.render.multimaster import provider_of
from swarmctl.resources import HostModule
from swarmctl.robot_types.ros_driver import VELOCITIES
from swarmctl.spec.program_model import Container, Lifecycle
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Commander, Host, Island, Program, Robot, Swarm, carrier
from swarmctl.swarm.topics import CLOCK, DIAGNOSTICS, DriverTopic


@dataclass(frozen=True)
class ExpectedProgram:
    """A program and its unit. ``node`` is empty if nothing names it; topics are (name, type) pairs.

    ``measured``: those that it publishes at a declared rate; ``provides``: services and actions, alike.
    """

    name: str
    host: str
    optional: bool
    unit: str
    node: str
    packages: tuple[str, ...]  # without which it is skipped, where that is allowed
    install_hint: str  # how the host gets these packages
    publishes: tuple[tuple[str, str], ...]
    subscribes: tuple[tuple[str, str], ...]
    lifecycle: Lifecycle = "service"
    measured: tuple[DriverTopic, ...] = ()
    container: Container | None = None
    provides: tuple[tuple[str, str], ...] = ()

    @property
    def gives_time(self) -> bool:
        """True if nodes have their time from it, where time is simulated."""
        return any(name == CLOCK for name, _ in self.publishes)


def programs_of(swarm: Swarm, host: Host) -> tuple[ExpectedProgram, ...]:
    """Returns the programs of ``host`` that systemd units start; interactive ones are not checked."""
    programs = swarm.programs_on(host.name)
    return tuple(_program(swarm, host, one) for one in programs if one.runs_by_itself)


def _program(swarm: Swarm, host: Host, program: Program) -> ExpectedProgram:
    declared = program.declared
    needed = (
        (*([declared.package] if declared.package else []), *declared.requires) if declared.optional else ()
    )
    packages = tuple(dict.fromkeys(needed))
    middleware = middleware_at(swarm, host.name)
    node = middleware.program(swarm, program)
    return ExpectedProgram(
        name=program.name,
        host=host.name,
        optional=declared.optional or host.optional,
        unit=node.unit,
        node=node.name,
        packages=packages,
        install_hint="; ".join(middleware.install_hints([package(one) for one in packages])),
        publishes=node.publishes,
        subscribes=node.subscribes,
        lifecycle=declared.lifecycle,
        measured=node.measured,
        container=declared.container,
        provides=node.provides,
    )


@dataclass(frozen=True)
class ExpectedBridge:
    """A topic that island ``to`` receives from ``origin``. ``robots``: those whose drivers publish it.

    ``relayed``: the hub publishes it there, under the names of the nodes in ``origin``.
    """

    topic: str
    type: str
    origin: str
    origin_hub: str
    to: str
    hub: str
    robots: tuple[str, ...] = ()
    relayed: bool = False

    @property
    def subject(self) -> str:
        """The name of the bridge in findings."""
        return f"{self.topic} from {self.origin} to {self.to}"


def bridges_of(swarm: Swarm) -> tuple[ExpectedBridge, ...]:
    """Returns every bridged topic, once per pair of islands, in the order of the spec."""
    islands = {island.name: island for island in swarm.islands}
    robots = {robot.namespace: robot for robot in swarm.robots.values()}
    found: dict[tuple[str, str, str], ExpectedBridge] = {}
    for one in swarm.bridges:
        origin = islands[one.origin]
        publishing = tuple(robot.name for robot in _publishing(one.topic, swarm, origin, robots))
        for to in map(islands.__getitem__, one.to):
            relayed = provider_of(swarm.multimaster, carrier(origin, to).distro).relays
            kind = middleware_of(to.distro).type_name(one.type)
            bridge = ExpectedBridge(
                one.topic, kind, one.origin, origin.hub, to.name, to.hub, publishing, relayed
            )
            found.setdefault((one.topic, one.origin, to.name), bridge)
    return tuple(found.values())


def _publishing(topic: str, swarm: Swarm, origin: Island, robots: Mapping[str, Robot]) -> Iterator[Robot]:
    """The robots of ``origin`` whose drivers publish ``topic``. ``robots`` by namespace."""
    if topic == DIAGNOSTICS:
        yield from (robot for host in origin.hosts for robot in swarm.robots_on(host))
        return
    robot = next((robots[space] for space in names.above(topic) if space in robots), None)
    if robot is None or robot.host not in origin.hosts:
        return
    if _publishes(robot, topic[len(robot.namespace) + 1 :]):
        yield robot


def _publishes(robot: Robot, topic: str) -> bool:
    return any(one.name == topic for one in robot.topics)


@dataclass(frozen=True)
class ExpectedMultimaster:
    """What joins a hub's master to others: its unit, its nodes, and which node reports its state."""

    unit: str
    nodes: tuple[str, ...]
    reporter: str | None


def multimaster_of(swarm: Swarm, hub: str, units: tuple[str, ...]) -> ExpectedMultimaster | None:
    """Returns what ``hub`` runs to join its master to others; None if none of its ``units`` does."""
    unit = names.unit(swarm.name, names.MULTIMASTER)
    if unit not in units:
        return None
    island = swarm.island_of(hub)
    nodes = provider_of(swarm.multimaster, island.distro).nodes(swarm, island)
    return ExpectedMultimaster(unit, nodes.names, nodes.reporter)


@dataclass(frozen=True)
class Release:
    """What the spec renders for one host: the release's name, its units in start order, what they require."""

    digest: str
    units: tuple[str, ...]
    requires: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class ExpectedRobot(ExpectedDriver):
    """A robot, its driver and its line. ``line_unit`` is the unit that creates the device, if one does, and
    ``pairing_unit`` the one that pairs the robot with its host before.
    """

    name: str
    namespace: str  # in ROS, without a slash in front
    host: str
    optional: bool
    line_unit: str | None
    pairing_unit: str | None
    device: str  # empty for a robot without a line
    adapter: str  # what makes the device appear, for people
    commanders: tuple[Commander, ...]
    reach: str = ""  # what to check if nothing comes from a robot without a line

    @property
    def guard(self) -> str:
        """Who rejects unauthorised publishers: the driver, the gate, or nobody (empty)."""
        return "driver" if self.guarded else "gate" if self.gate is not None else ""

    @property
    def takes(self) -> tuple[str, str]:
        """The topic on which the driver itself takes commands, with its type; empty if it takes none."""
        gate = self.gate
        return (gate.output, gate.output_type) if gate is not None else (self.command, self.command_type)

    @property
    def guard_node(self) -> str:
        """The node that takes commands and reports whom it obeys."""
        return self.gate.node if self.gate is not None else self.node


@dataclass(frozen=True)
class ExpectedHost:
    """A host, the release it should run, and the master its nodes should reach (no URI where none runs).

    ``servers``: those over which the nodes of its island find each other, if they need some. ``probe``
    observes the graph. ``velocities``: the types of a topic on which a driver might take commands.
    """

    name: str
    address: str
    account: str
    advertised: str
    optional: bool
    release: Release
    probe: HostModule
    island: str
    hub: str
    master_uri: str
    master_unit: str | None
    master_cleanup: str  # takes nodes out of it that have ended, a shell command; empty without a master
    robots: tuple[ExpectedRobot, ...]
    multimaster: ExpectedMultimaster | None = None
    programs: tuple[ExpectedProgram, ...] = ()
    servers: DiscoveryServers | None = None
    velocities: tuple[str, ...] = VELOCITIES

    @property
    def is_hub(self) -> bool:
        """True if the host runs the master of its island."""
        return self.name == self.hub


@dataclass(frozen=True)
class ExpectedGraph:
    """A healthy swarm, with its hosts in the order of the spec.

    ``addresses`` maps each island to what may stand for a host in the URIs of its nodes. ``simulated_time``:
    nodes take their time from /clock. ``program_topics``: what programs of any host declare to publish.
    ``expelled``: hosts whose keys of WireGuard are retired.
    """

    swarm: str
    hosts: tuple[ExpectedHost, ...]
    bridges: tuple[ExpectedBridge, ...] = ()
    addresses: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    simulated_time: bool = False
    program_topics: tuple[str, ...] = ()
    expelled: frozenset[str] = frozenset()

    @property
    def robots(self) -> tuple[ExpectedRobot, ...]:
        """The robots of all hosts."""
        return tuple(robot for host in self.hosts for robot in host.robots)

    @cached_property
    def homes(self) -> Mapping[str, str]:
        """The island by the host in a node's URI."""
        return {text: island for island, texts in self.addresses.items() for text in texts}


def expected_graph(swarm: Swarm, releases: Mapping[str, Release]) -> ExpectedGraph:
    """Returns what the hosts in ``releases`` should show. A bridge is part of it if both its hubs are."""
    hosts = (_host(swarm, swarm.hosts[name], release) for name, release in releases.items())
    bridges = (one for one in bridges_of(swarm) if {one.origin_hub, one.hub} <= releases.keys())
    places = {island.name: swarm.uri_hosts_of(island) for island in swarm.islands}
    programs = (one for host in swarm.hosts.values() for one in programs_of(swarm, host))
    topics = tuple(dict.fromkeys(name for one in programs for name, _ in one.publishes))
    return ExpectedGraph(
        swarm.name,
        tuple(hosts),
        tuple(bridges),
        places,
        swarm.use_sim_time,
        topics,
        swarm.keys.expelled,
    )


def _host(swarm: Swarm, host: Host, release: Release) -> ExpectedHost:
    island, middleware = swarm.island_of(host.name), middleware_at(swarm, host.name)
    master = middleware.master(swarm, island)
    return ExpectedHost(
        name=host.name,
        address=host.address,
        account=host.user,
        advertised=host.advertised,
        optional=host.optional,
        release=release,
        probe=middleware.probe,
        island=island.name,
        hub=island.hub,
        master_uri=master.uri if master else "",
        master_unit=master.unit if master and host.name == island.hub else None,
        master_cleanup=master.cleanup if master else "",
        robots=tuple(
            _robot(swarm, middleware.driver(swarm, robot), robot, host)
            for robot in swarm.robots_on(host.name)
        ),
        multimaster=multimaster_of(swarm, island.hub, release.units) if host.name == island.hub else None,
        programs=programs_of(swarm, host),
        servers=middleware.discovery_servers(swarm, island),
        velocities=tuple(map(middleware.type_name, VELOCITIES)),
    )


def _robot(swarm: Swarm, driver: ExpectedDriver, robot: Robot, host: Host) -> ExpectedRobot:
    rfcomm = robot.line if isinstance(robot.line, RfcommLine) else None
    return ExpectedRobot(
        **vars(driver),
        name=robot.name,
        namespace=robot.namespace[1:],
        host=host.name,
        optional=robot.optional or host.optional,
        line_unit=names.unit(swarm.name, robot.name, "rfcomm") if rfcomm else None,
        pairing_unit=names.unit(swarm.name, robot.name, "pair") if rfcomm and rfcomm.pin else None,
        device=robot.line.path if robot.line is not None else "",
        adapter=robot.line.title if robot.line is not None else "the serial port",
        commanders=robot.commanders,
        reach=robot.link.check(robot.host) if robot.link is not None else "",
    )
