"""What the rules read: the index of one document, source positions, and analyses shared by several rules."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from swarmctl.analysis.host_load import HostBudget, host_budgets
from swarmctl.analysis.listeners import listeners
from swarmctl.analysis.rosserial_load import RosserialBudget, rosserial_budgets
from swarmctl.analysis.serial_load import SerialBudget, serial_budgets
from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.linter.launch_uses import LaunchUse, launch_uses
from swarmctl.render.middleware import Capability, Middleware, middleware_of
from swarmctl.render.multimaster import joins_islands, provider_of
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.ros_packages.message_catalog import MessageCatalog, common_messages, with_messages_of
from swarmctl.swarm.addresses import Ip
from swarmctl.swarm.authority import Authority
from swarmctl.swarm.bridges import bridges_of
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.ports import Listener
from swarmctl.swarm.resolved import Bridge, Island
from swarmctl.swarm.robot_urdfs import RobotUrdfs, urdfs_of
from swarmctl.swarm.ros_processes import ros_processes
from swarmctl.swarm.topic_origins import Publishers
from swarmctl.swarm.wireguard_routes import Networks
from swarmctl.yamltext.source import Loc, Source


class RuleContext(SwarmIndex):
    """The document that the rules check, with its index."""

    @property
    def source(self) -> Source:
        """The text positions of the spec."""
        return self.document.source

    def span(self, *loc: str | int, key: bool = False) -> Span:
        """The position of a value of the spec, or with ``key`` of its key."""
        return self.document.span(*loc, key=key)

    @cached_property
    def distros(self) -> Mapping[str, Middleware]:
        """The ROS distributions of its islands, each with what carries its topics."""
        names = dict.fromkeys(one.distro for one in self.islands) or (self.spec.ros.distro,)
        return {name: middleware_of(name) for name in names}

    @property
    def middleware(self) -> Middleware:
        """What carries the topics, of the first distribution."""
        return next(iter(self.distros.values()))

    @property
    def launches_executables(self) -> bool:
        """Whether a launch file starts each program of a package; else only those that name one."""
        return "launch-xml" in self.middleware.capabilities

    @cached_property
    def parts(self) -> tuple[RuleContext, ...]:
        """What belongs to each ROS distribution."""
        return (self,) if len(self.distros) == 1 else tuple(_OneDistro(self, one) for one in self.distros)

    def can(self, capability: Capability) -> bool:
        """True if the middleware of any distribution has a capability."""
        return any(capability in one.capabilities for one in self.distros.values())

    @property
    def has_masters(self) -> bool:
        """Whether the nodes of an island have a master."""
        return self.can("master")

    @cached_property
    def common_topics(self) -> Mapping[str, str]:
        """The topics that every graph has, each with its type."""
        return {topic: kind for one in self.distros.values() for topic, kind in one.topics.items()}

    @cached_property
    def joins_islands(self) -> bool:
        """Whether something carries topics from island to island."""
        sealed = self.spec.ros.sros2 and not all(one.has_master for one in self.islands)
        joined = joins_islands(self.spec.multimaster, tuple(self.distros))
        return joined and not sealed and not self.unreached

    @property
    def unreached(self) -> tuple[Island, ...]:
        """The islands whose nodes are found by none of another island."""
        providers = ((one, provider_of(self.spec.multimaster, one.distro)) for one in self.islands)
        return tuple(one for one, provider in providers if not provider.reaches(one))

    @cached_property
    def _sealed(self) -> Networks | None:
        """The networks over which the hosts of a sealed swarm exchange packets; None for another swarm."""
        return Networks(self) if self.spec.has_wireguard else None

    def reaches(self, one: str, other: str) -> bool:
        """True if two hosts share a network, or a third host of a sealed swarm relays between them."""
        sealed = None if self.meet(one, other) else self._sealed
        return self.meet(one, other) or (sealed is not None and sealed.relay(one, other) is not None)

    @cached_property
    def messages(self) -> MessageCatalog:
        """The message types that are known: the common ones, and those of the packages that are found."""
        return with_messages_of(self.document.packages, common_messages())

    @cached_property
    def launches(self) -> tuple[LaunchUse, ...]:
        """What the launch files of programs and drivers start, where their packages are found."""
        return launch_uses(self)

    def launch_span(self, use: LaunchUse, *key: str, is_key: bool = False) -> Span:
        """The position of a key of what names a launch file, in the spec or in the file of a robot type."""
        if use.of_type:
            return self.document.span_of_type(use.of_type, *use.loc, *key, key=is_key)
        return self.span(*use.loc, *key, key=is_key)

    def connect(self, one: str, other: str) -> bool:
        """True if ROS connects a publisher and a subscriber of these message types: it compares checksums."""
        if one == other:
            return True
        sums = self.messages.sums if self.can("ros1-nodes") else {}
        return bool(sums.get(one)) and sums[one] == sums.get(other)

    def command_timeout_loc(self, robot: str) -> Loc:
        """Returns where the spec sets a robot's command timeout; empty if its type or swarmctl sets it."""
        given = self.spec.robots[robot]
        if given.settings.command_timeout is not None:
            return ("robots", robot, "settings", "command_timeout")
        of_type = self.types[given.type].settings.command_timeout
        if of_type is None and self.spec.defaults.robot.command_timeout is not None:
            return ("defaults", "robot", "command_timeout")
        return ()

    @cached_property
    def urdfs(self) -> RobotUrdfs:
        """The URDFs beside the spec."""
        return urdfs_of(self.document)

    @cached_property
    def authority(self) -> Authority:
        """Who may command each robot, as its driver will check it."""
        return Authority(self)

    @cached_property
    def publishers(self) -> Publishers:
        """From which islands each topic comes."""
        return Publishers(self)

    @cached_property
    def bridges(self) -> tuple[Bridge, ...]:
        """The topics that are bridged between islands."""
        return bridges_of(self) if self.joins_islands else ()

    @cached_property
    def listeners(self) -> tuple[Listener, ...]:
        """Every port on which a host listens for the swarm."""
        return tuple(listeners(self))

    @cached_property
    def ros_processes(self) -> Mapping[str, int]:
        """How many processes with nodes run on each host; 0 for one that is not in it."""
        return ros_processes(self)

    @cached_property
    def line_budgets(self) -> Mapping[int, SerialBudget]:
        """The load of each line, by its index in ``links``."""
        return dict(serial_budgets(self))

    @cached_property
    def board_budgets(self) -> tuple[RosserialBudget, ...]:
        """The load of each board with rosserial."""
        return tuple(rosserial_budgets(self))

    @cached_property
    def host_budgets(self) -> tuple[HostBudget, ...]:
        """The memory use of each host whose kind of computer is declared."""
        return tuple(host_budgets(self, self.bridges))


class _OneDistro(RuleContext):
    """What of a document belongs to one ROS distribution: its hosts with their programs and drivers."""

    def __init__(self, whole: RuleContext, distro: str) -> None:
        super().__init__(whole.document)
        self._distro = distro
        hosts, programs = whole.program_hosts, self.spec.programs
        here = {name: one for name, one in programs.items() if self._is_here(hosts[name])}
        if len(here) < len(programs):
            self.spec = self.spec.model_copy(update={"programs": here})

    def _is_here(self, host: str | None) -> bool:
        return self.distro_of_host(host) == self._distro

    @cached_property
    def islands(self) -> tuple[Island, ...]:
        return tuple(one for one in super().islands if one.distro == self._distro)

    @cached_property
    def ros_drivers(self) -> Mapping[str, RosDriver]:
        return {name: one for name, one in super().ros_drivers.items() if self._is_here(self.driving[name])}

    @cached_property
    def addresses(self) -> Mapping[str, Ip | None]:
        return {name: one for name, one in super().addresses.items() if self._is_here(name)}


Find = Callable[[RuleContext], Iterator[Diagnostic]]


@dataclass(frozen=True)
class Rule:
    """A function that yields findings, with the ids under which the rulebook explains them."""

    ids: tuple[str, ...]
    find: Find
    names: bool  # runs first: the other rules look things up by the names it checks
    needs: Capability | None  # is about what belongs to middlewares that have it
    by_distro: bool  # is about what belongs to one ROS distribution

    def __call__(self, context: RuleContext) -> Iterator[Diagnostic]:
        """Yields the findings of the rule."""
        for part in context.parts if self.needs or self.by_distro else (context,):
            if self.needs is None or self.needs in part.middleware.capabilities:
                yield from self.find(part)


def rule(
    *ids: str, names: bool = False, needs: Capability | None = None, by_distro: bool = False
) -> Callable[[Find], Rule]:
    """Makes a function the rule that reports ``ids``; ``names``, ``needs`` and ``by_distro`` as in `Rule`."""
    return lambda find: Rule(ids, find, names, needs, by_distro)
