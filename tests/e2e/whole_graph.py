"""The whole ROS graph: what each master of a swarm knows, and what it should know as the spec has it."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from dataclasses import dataclass

from swarmctl.swarm import names
from swarmctl.swarm.command_topics import COMMAND
from swarmctl.swarm.resolved import Island, Program, Swarm
from swarmctl.swarm.topics import actuators_of
from tests.e2e.lab_swarm import LabSwarm

ROSOUT = "/rosout"
LOOK = """\
import json, sys
from xmlrpc.client import ServerProxy
print(json.dumps({uri: ServerProxy(uri).getSystemState("/experiment")[2][:2] for uri in sys.argv[1:]}))
"""


@dataclass(frozen=True, order=True)
class End:
    """One end of a topic, as a master lists it."""

    topic: str
    way: str
    node: str

    def __str__(self) -> str:
        return f"{self.node} {self.way} {self.topic}"


def publishes(node: str, *topics: str) -> Iterator[End]:
    return (End(topic, "publishes", node) for topic in topics)


def subscribes(node: str, *topics: str) -> Iterator[End]:
    return (End(topic, "subscribes", node) for topic in topics)


def of_ros_itself(*nodes: str) -> Iterator[End]:
    """What every node written with rospy or roscpp has, and the node that comes with each master."""
    for node in nodes:
        yield from publishes(node, ROSOUT)
    yield from subscribes("/rosout", ROSOUT)
    yield from publishes("/rosout", "/rosout_agg")


def real(swarm: LabSwarm, spec: Swarm) -> dict[str, set[End]]:
    """By island, what its master lists, read from inside the lab."""
    uris = {spec.master_uri(island): island.name for island in spec.islands}
    states = json.loads(swarm.shell(spec.islands[0].hub, f"python3 -c '{LOOK}' {' '.join(uris)}"))
    return {
        uris[uri]: {
            End(topic, way, node)
            for way, topics in zip(("publishes", "subscribes"), state, strict=True)
            for topic, nodes in topics
            for node in nodes
        }
        for uri, state in states.items()
    }


def expected(spec: Swarm, absent: Collection[str] = ()) -> dict[str, set[End]]:
    """By island, what its master should list; ``absent`` programs are left out."""
    own = {island.name: set(_of_island(spec, island, absent)) for island in spec.islands}
    found = {name: set(ends) for name, ends in own.items()}
    for bridge in spec.bridges:
        for to in bridge.to:
            crossing = {
                one for one in own[bridge.origin] if (one.topic, one.way) == (bridge.topic, "publishes")
            }
            found[to] |= crossing
            found[bridge.origin].update(subscribes(names.multimaster_node(to), bridge.topic))
    return found


def _of_island(spec: Swarm, island: Island, absent: Collection[str]) -> Iterator[End]:
    yield from of_ros_itself()
    for host in island.hosts:
        for robot in spec.robots_on(host):
            topics = [topic.name for topic in robot.topics]
            full = [one if one.startswith("/") else f"{robot.namespace}/{one}" for one in topics]
            placed = ["/tf_static"] if any("/" in one for one in topics if not one.startswith("/")) else []
            yield from publishes(robot.driver_node, *full, "/tf", *placed)
            received = [COMMAND, *actuators_of(robot.type)]
            yield from subscribes(robot.driver_node, *(f"{robot.namespace}/{one}" for one in received))
            yield from of_ros_itself(robot.driver_node)
        for program in spec.programs_on(host):
            if program.name not in absent:
                yield from _of_program(spec, program)
                yield from of_ros_itself(program.node)
    if any(island.name in bridge.to for bridge in spec.bridges):
        yield from publishes(names.multimaster_node(island.name), "/diagnostics")


def _of_program(swarm: Swarm, program: Program) -> Iterator[End]:
    for way, topics in (
        ("publishes", program.declared.publishes),
        ("subscribes", program.declared.subscribes),
    ):
        for topic in topics:
            yield End(names.resolved(topic.topic, program.node, program.declared.remap), way, program.node)
    if program.declared.use == "teleop-joy":
        yield from publishes(program.node, *(swarm.command_topics[one].topic for one in program.commands))
        yield from subscribes(program.node, names.resolved("joy", program.node, program.declared.remap))


def difference(found: dict[str, set[End]], wanted: dict[str, set[End]]) -> list[str]:
    """What is missing and what is too much, for people."""
    return [
        f"{island}: {sign} {end}"
        for island in wanted
        for sign, ends in (
            ("missing", wanted[island] - found[island]),
            ("unexpected", found[island] - wanted[island]),
        )
        for end in sorted(ends)
    ]
