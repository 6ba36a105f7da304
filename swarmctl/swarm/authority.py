"""Who may command which robot, as the robot's driver can check it: by the sending node, or by its host.

In modes single-minded and leader: the commanders in `control`, else all that runs on the leader. In the other
modes: the commanders in `control`, and below all of them the robot's own programs (paper, section 4).
"""

from __future__ import annotations

from swarmctl.spec.model import Mode, Spec
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolved import Commander
from swarmctl.swarm.subnets import advertised

OWN = -1  # the priority of a robot's own programs: below every priority that `control` accepts


class Authority:
    """The commanders of every robot, by name of robot."""

    def __init__(self, index: SwarmIndex) -> None:
        self._index = index
        self._named: dict[str, list[Commander]] = {}
        for control in index.spec.control:
            commander = self._commander(control.by, control.priority)
            for robot in control.of:
                self._named.setdefault(robot, []).append(commander)

    def over(self, robot: str) -> tuple[Commander, ...]:
        """Returns who may command ``robot``, the highest priority first."""
        named = self._named.get(robot, [])
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

    def _commander(self, by: str, priority: int) -> Commander:
        spec = self._index.spec
        if by in spec.programs:
            program, where = spec.programs[by], self._addresses(self._index.program_hosts[by])
            if program.names_its_node:
                return Commander(by, priority, nodes=(self._index.program_nodes[by],), hosts=where)
            # Only the launch file, the command or the container itself defines the names of its nodes.
            return Commander(by, priority, addresses=where)
        if by in spec.robots:
            return Commander(by, priority, namespace=self._index.namespaces[by], hosts=self._hosts(by))
        return Commander(by, priority, addresses=self._addresses(by))

    def leader_of(self, robot: str) -> str | None:
        """Returns the leader of the island of a robot's driver, if the island's mode has one."""
        island = self._index.home.get(self._index.driving[robot] or "")
        if island is None:
            return None
        spec = self._index.spec
        mode = Mode(spec.islands[island.name].mode) if spec.mode is Mode.COMBINED else spec.mode
        return island.hub if mode in (Mode.SINGLE_MINDED, Mode.LEADER) else None

    def _hosts(self, robot: str) -> tuple[str, ...]:
        """The addresses of the hosts on which nodes in the robot's namespace run."""
        space = self._index.namespaces[robot]
        programs = self._index.program_namespaces
        inside = [
            self._index.program_hosts[name]
            for name, one in programs.items()
            if f"{one}/".startswith(f"{space}/")
        ]
        found = (self._addresses(host) for host in (self._index.driving[robot], *inside))
        return tuple(dict.fromkeys(address for of_host in found for address in of_host))

    def _addresses(self, host: str | None) -> tuple[str, ...]:
        spec = self._index.spec
        return (advertised(spec, host),) if host in spec.hosts else ()


def commanded_by(spec: Spec, program: str) -> tuple[str, ...]:
    """Returns the robots that ``program`` commands, in the order of `control`."""
    found = (robot for control in spec.control if control.by == program for robot in control.of)
    return tuple(dict.fromkeys(found))
