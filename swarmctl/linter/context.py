"""What the rules read: the index of one document, source positions, and analyses shared by several rules."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from swarmctl.analysis.host_load import HostBudget, host_budgets
from swarmctl.analysis.listeners import listeners
from swarmctl.analysis.serial_load import SerialBudget, serial_budgets
from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.linter.launch_uses import LaunchUse, launch_uses
from swarmctl.render.middleware import Capability, Middleware, middleware_of
from swarmctl.render.multimaster import joins_islands
from swarmctl.ros_packages.message_catalog import MessageCatalog, common_messages, with_messages_of
from swarmctl.swarm.authority import Authority
from swarmctl.swarm.bridges import bridges_of
from swarmctl.swarm.discovery import FROM_OUTSIDE
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.ports import Listener
from swarmctl.swarm.resolved import Bridge
from swarmctl.swarm.robot_urdfs import RobotUrdfs, urdfs_of
from swarmctl.swarm.ros_processes import ros_processes
from swarmctl.swarm.topic_origins import Publishers
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
    def middleware(self) -> Middleware:
        """What carries the topics."""
        return middleware_of(self.spec.ros.distro)

    @property
    def has_masters(self) -> bool:
        """Whether the nodes of an island have a master."""
        return "master" in self.middleware.capabilities

    @property
    def launches_executables(self) -> bool:
        """Whether a launch file starts each program of a package; else only those that name one."""
        return "launch-xml" in self.middleware.capabilities

    @cached_property
    def joins_islands(self) -> bool:
        """Whether something carries topics from island to island."""
        seen = not self.spec.ros.sros2 and all(one.discovery.method in FROM_OUTSIDE for one in self.islands)
        return (self.has_masters or seen) and joins_islands(self.spec.multimaster, self.spec.ros.distro)

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
        sums = self.messages.sums if "ros1-nodes" in self.middleware.capabilities else {}
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
    def host_budgets(self) -> tuple[HostBudget, ...]:
        """The memory use of each host whose kind of computer is declared."""
        return tuple(host_budgets(self, self.bridges))


Find = Callable[[RuleContext], Iterator[Diagnostic]]


@dataclass(frozen=True)
class Rule:
    """A function that yields findings, with the ids under which the rulebook explains them."""

    ids: tuple[str, ...]
    find: Find
    names: bool  # runs first: the other rules look things up by the names it checks
    needs: Capability | None  # holds for middlewares that have it

    def __call__(self, context: RuleContext) -> Iterator[Diagnostic]:
        """Yields the findings of the rule."""
        held = self.needs is None or self.needs in context.middleware.capabilities
        return self.find(context) if held else iter(())


def rule(*ids: str, names: bool = False, needs: Capability | None = None) -> Callable[[Find], Rule]:
    """Makes a function the rule that reports ``ids``; ``names`` and ``needs`` as in `Rule`."""
    return lambda find: Rule(ids, find, names, needs)
