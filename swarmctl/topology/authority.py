"""Who may command which robot, as the robot's driver can tell: by the node that sends, or where it runs.

Where a leader leads: who is named in `control`, else what runs on the leader. Elsewhere: who is named, and
below all of them the robot's own programs (paper, section 4).
"""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.spec.model import Mode, Spec
from swarmctl.topology import modes, names
from swarmctl.topology.interfaces import program_host
from swarmctl.topology.networks import advertised
from swarmctl.topology.swarm import Commander, Island

OWN = -1  # the priority of a robot's own programs: below all that can be written in `control`


class Authority:
    """The commanders of every robot, by name of robot."""

    def __init__(self, spec: Spec, home: Mapping[str, Island]) -> None:
        self._spec = spec
        self._home = home
        self._named: dict[str, list[Commander]] = {}
        for control in spec.control:
            commander = self._commander(control.by, control.priority)
            for robot in control.of:
                self._named.setdefault(robot, []).append(commander)

    def over(self, robot: str) -> tuple[Commander, ...]:
        """Who may command ``robot``, the highest priority first."""
        named = self._named.get(robot, [])
        host = modes.driving_host(self._spec, robot) or ""
        led = self._leader_of(host)
        if led is not None:
            found = named or [Commander(led, 0, addresses=self._addresses(led))]
        else:
            own = Commander(host, OWN, namespace=names.namespace(robot), addresses=self._addresses(host))
            found = [*named, own]
        return tuple(sorted(found, key=lambda one: -one.priority))

    def _commander(self, by: str, priority: int) -> Commander:
        if by in self._spec.programs:
            program = self._spec.programs[by]
            if program.launch is None:
                return Commander(by, priority, nodes=(names.program_node(by, program.robot),))
            # What a launch file calls its nodes is known to itself alone.
            return Commander(by, priority, addresses=self._addresses(program_host(self._spec, program)))
        if by in self._spec.robots:
            return Commander(by, priority, namespace=names.namespace(by))
        return Commander(by, priority, addresses=self._addresses(by))

    def _leader_of(self, host: str) -> str | None:
        """The host that leads the island of ``host``, where its mode gives all say to one."""
        island = self._home.get(host)
        if island is None:
            return None
        spec = self._spec
        mode = Mode(spec.islands[island.name].mode) if spec.mode is Mode.COMBINED else spec.mode
        return island.hub if mode in (Mode.SINGLE_MINDED, Mode.LEADER) else None

    def _addresses(self, host: str | None) -> tuple[str, ...]:
        return (advertised(self._spec, host),) if host in self._spec.hosts else ()


def commanded_by(spec: Spec, program: str) -> tuple[str, ...]:
    """The robots that ``program`` commands, in the order of `control`."""
    found = (robot for control in spec.control if control.by == program for robot in control.of)
    return tuple(dict.fromkeys(found))
