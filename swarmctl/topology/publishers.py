"""Which islands a topic comes from: asked topic by topic, as robots are many and questions few."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swarmctl.spec.model import Spec
from swarmctl.spec.robot_type import RobotType
from swarmctl.topology import modes, names
from swarmctl.topology.interfaces import DIAGNOSTICS, DIAGNOSTICS_TYPE, Endpoint, sensors_of
from swarmctl.topology.swarm import Island


class Publishers:
    """What drivers and programs publish, by topic and island."""

    def __init__(
        self,
        spec: Spec,
        types: Mapping[str, RobotType],
        islands: Sequence[Island],
        endpoints: Sequence[Endpoint],
    ) -> None:
        self._spec = spec
        self._types = types
        self._home = {host: island.name for island in islands for host in island.hosts}
        self.robots = {names.namespace(robot): robot for robot in spec.robots}
        self.programs: dict[str, dict[str, str]] = {}
        for one in endpoints:
            if one.publishes and one.host in self._home:
                self.programs.setdefault(one.topic, {}).setdefault(self._home[one.host], one.type)

    def of(self, topic: str) -> Mapping[str, str]:
        """The message type by island, of every island that publishes ``topic``."""
        found = dict(self.programs.get(topic, {}))
        if (sensed := self.sensed(topic)) is not None:
            robot, kind = sensed
            if (island := self.island(robot)) is not None:
                found.setdefault(island, kind)
        elif topic == DIAGNOSTICS:
            islands = dict.fromkeys(map(self.island, self._spec.robots))
            found = {one: DIAGNOSTICS_TYPE for one in islands if one is not None} | found
        return found

    def sensed(self, topic: str) -> tuple[str, str] | None:
        """The robot whose driver has ``topic`` for what it senses, and its message type."""
        space, name = names.parted(topic)
        robot = self.robots.get(space)
        if robot is None:
            return None
        said = self._spec.robots[robot]
        kind = sensors_of(self._types[said.type], said.driver).get(name)
        return (robot, kind) if robot and kind else None

    def island(self, robot: str) -> str | None:
        """The island on which the robot's driver runs."""
        return self._home.get(modes.driving_host(self._spec, robot) or "")
