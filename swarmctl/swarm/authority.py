"""Who may command which robot, as the robot's driver can check it: by the sending node, or by its host.

In modes single-minded and leader: the commanders in `control`, else all that runs on the leader. In the other
modes: the commanders in `control`, and below all of them the robot's own programs (paper, section 4).
"""

from __future__ import annotations

from swarmctl.spec.model import Control, Mode, Spec
from swarmctl.swarm.addresses import advertised
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolved import Commander, Island, appears_on

OWN = -1  # the priority of a robot's own programs: below every priority that `control` accepts


class Authority:
    """The commanders of every robot, by name of robot."""

    def __init__(self, index: SwarmIndex) -> None:
        self._index = index
        self._named: dict[str, list[Control]] = {}
        for control in index.spec.control:
            for robot in control.of:
                self._named.setdefault(robot, []).append(control)
        self._commanders: dict[tuple[str, int, str], Commander] = {}  # by name, priority and island

    def over(self, robot: str) -> tuple[Commander, ...]:
        """Returns who may command ``robot``, the highest priority first."""
        to = self._index.island_of_robot(robot)
        named = [self._commander(one.by, one.priority, to) for one in self._named.get(robot, ())]
        host = self._index.driving[robot] or ""
        leader = self.leader_of(robot)
        if leader is not None:
            found = named or [Commander(leader, 0, addresses=self._addresses(leader))]
        else:
            own = Commander(
                host,
                OWN,
                namespace=self._index.namespaces[robot],
                hosts=self._hosts(robot),
                addresses=self._addresses(host),
            )
            found = [*named, own]
        return tuple(sorted(found, key=lambda one: -one.priority))

    def _commander(self, by: str, priority: int, to: Island | None) -> Commander:
        key = (by, priority, "" if to is None else to.name)
        if key not in self._commanders:
            self._commanders[key] = self._seen_from(to, by, priority)
        return self._commanders[key]

    def _seen_from(self, to: Island | None, by: str, priority: int) -> Commander:
        """A commander as the graph of island ``to`` shows it.

        What a relay between ROS 1 and ROS 2 publishes comes from its hub, whichever node has sent it: there
        no node is a commander by its host alone.
        """
        spec, host = self._index.spec, self._index.commander_host(by)
        home = self._index.home.get(host or "")
        relayed = home is not None and to is not None and home.has_master is not to.has_master
        whole_host = () if relayed else self._addresses(host)
        if by in spec.programs:
            program = spec.programs[by]
            if program.names_its_node:
                node, hosts = self._index.program_nodes[by], self._addresses(host, to)
                return Commander(by, priority, nodes=(node,), hosts=hosts)
            # Only the launch file, the command or the container itself defines the names of its nodes.
            return Commander(by, priority, addresses=whole_host)
        if by in spec.robots:
            space, hosts = self._index.namespaces[by], self._hosts(by, to)
            return Commander(by, priority, namespace=space, hosts=hosts)
        return Commander(by, priority, addresses=whole_host)

    def leader_of(self, robot: str) -> str | None:
        """Returns the leader of the island of a robot's driver, if the island's mode has one."""
        island = self._index.home.get(self._index.driving[robot] or "")
        if island is None:
            return None
        spec = self._index.spec
        mode = Mode(spec.islands[island.name].mode) if spec.mode is Mode.COMBINED else spec.mode
        return island.hub if mode in (Mode.SINGLE_MINDED, Mode.LEADER) else None

    def _hosts(self, robot: str, to: Island | None = None) -> tuple[str, ...]:
        """The addresses of the hosts on which nodes in the robot's namespace run."""
        space = self._index.namespaces[robot]
        programs = self._index.program_namespaces
        inside = [
            self._index.program_hosts[name]
            for name, one in programs.items()
            if f"{one}/".startswith(f"{space}/")
        ]
        found = (self._addresses(host, to) for host in (self._index.driving[robot], *inside))
        return tuple(dict.fromkeys(address for of_host in found for address in of_host))

    def _addresses(self, host: str | None, to: Island | None = None) -> tuple[str, ...]:
        """The address at which nodes of ``host`` run, for the graph of island ``to``."""
        spec, there = self._index.spec, appears_on(host or "", self._index.home, to)
        return (advertised(spec, there),) if there in spec.hosts else ()


def commanded_by(spec: Spec, program: str) -> tuple[str, ...]:
    """Returns the robots that ``program`` commands, in the order of `control`."""
    found = (robot for control in spec.control if control.by == program for robot in control.of)
    return tuple(dict.fromkeys(found))
