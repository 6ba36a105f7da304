"""From which islands a topic comes. Computed per topic: there are many robots and few questions."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.topics import DIAGNOSTICS, DIAGNOSTICS_TYPE


class Publishers:
    """What drivers and programs publish, by topic and island."""

    def __init__(self, index: SwarmIndex) -> None:
        self._index = index
        self.programs: dict[str, dict[str, str]] = {}  # message types by topic and island
        for one in index.endpoints:
            if one.publishes and one.host in index.home:
                self.programs.setdefault(one.topic, {}).setdefault(index.home[one.host].name, one.type)

    def of(self, topic: str) -> Mapping[str, str]:
        """Returns the message type by island, of every island that publishes ``topic``."""
        found = dict(self.programs.get(topic, {}))
        if (sensed := self.sensed(topic)) is not None:
            robot, kind = sensed
            if (island := self.island(robot)) is not None:
                found.setdefault(island, kind)
        elif topic == DIAGNOSTICS:
            islands = dict.fromkeys(map(self.island, self._index.spec.robots))
            found = {one: DIAGNOSTICS_TYPE for one in islands if one is not None} | found
        return found

    def sensed(self, topic: str) -> tuple[str, str] | None:
        """Returns the robot whose driver publishes ``topic`` from a sensor, and its message type."""
        namespace, name = self._index.split_topic(topic)
        robot = self._index.robot_by_namespace.get(namespace)
        if robot is None:
            return None
        kind = self._index.sensors_of(robot).get(name)
        return (robot, kind) if kind else None

    def island(self, robot: str) -> str | None:
        """Returns the name of the island in which the robot's driver runs."""
        island = self._index.island_of_robot(robot)
        return island.name if island else None
