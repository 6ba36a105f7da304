"""The whole ROS graph: what each island of a swarm has, and what it should have as the spec has it."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from dataclasses import dataclass

from swarmctl.robot_types.robot_type import RobotType
from swarmctl.swarm import names
from swarmctl.swarm.command_topics import COMMAND
from swarmctl.swarm.resolved import Island, Program, Robot, Swarm, carrier
from swarmctl.swarm.topics import actuators_of
from tests.e2e.lab_swarm import SOURCE, LabSwarm

ROSOUT = "/rosout"
LOOK = """\
import json, sys
from xmlrpc.client import ServerProxy
print(json.dumps(ServerProxy(sys.argv[1]).getSystemState("/experiment")[2][:2]))
"""
#: A node of ROS 2 sees other nodes after some time; `setup.bash` makes it a super client.
LOOK_2 = """\
import json, time, rclpy
rclpy.init()
node = rclpy.create_node("_experiment")
time.sleep(3)
def ends(infos):
    found = ((one.node_namespace.rstrip("/") + "/" + one.node_name) for one in infos)
    return sorted({name for name in found if name != "/_experiment"})
topics = [name for name, _ in node.get_topic_names_and_types()]
print(json.dumps([[[name, ends(look(name))] for name in topics]
                  for look in (node.get_publishers_info_by_topic, node.get_subscriptions_info_by_topic)]))
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


def of_ros_itself(island: Island, *nodes: str) -> Iterator[End]:
    """What every node has, and in ROS 1 the node that comes with each master."""
    if not island.has_master:
        for node in nodes:
            yield from publishes(node, ROSOUT, "/parameter_events")
        return
    for node in nodes:
        yield from publishes(node, ROSOUT)
    yield from subscribes("/rosout", ROSOUT)
    yield from publishes("/rosout", "/rosout_agg")


def real(swarm: LabSwarm, spec: Swarm) -> dict[str, set[End]]:
    """By island, what its master lists, or a node on its hub sees; read from inside the lab."""
    found = {}
    for island in spec.islands:  # a filtered master lets no other island look
        one, two = f"python3 -c '{LOOK}' {spec.master_uri(island)}", f"{SOURCE}; python3 -c '{LOOK_2}'"
        look = one if island.has_master else two
        found[island.name] = _ends(json.loads(swarm.shell(island.hub, look)))
    return found


def _ends(state: list[list[tuple[str, list[str]]]]) -> set[End]:
    return {
        End(topic, way, node)
        for way, topics in zip(("publishes", "subscribes"), state, strict=True)
        for topic, nodes in topics
        for node in nodes
    }


def expected(spec: Swarm, absent: Collection[str] = ()) -> dict[str, set[End]]:
    """By island, what its master should list; ``absent`` programs are left out."""
    islands = {island.name: island for island in spec.islands}
    own = {name: set(_of_island(spec, island, absent)) for name, island in islands.items()}
    found = {name: set(ends) for name, ends in own.items()}
    for bridge in spec.bridges:
        for name in bridge.to:
            origin, to = islands[bridge.origin], islands[name]
            crossing = {
                one for one in own[bridge.origin] if (one.topic, one.way) == (bridge.topic, "publishes")
            }
            found[name] |= crossing
            if not to.has_master:  # its node is not the same one, but has the same name
                for one in crossing:
                    found[name].update(publishes(one.node, "/parameter_events"))
            joins = names.multimaster_node(carrier(origin, to).name)
            if not origin.has_master:
                found[bridge.origin].update(publishes(joins, "/parameter_events"))
            found[bridge.origin].update(subscribes(joins, bridge.topic))
    return found


def _of_island(spec: Swarm, island: Island, absent: Collection[str]) -> Iterator[End]:
    yield from of_ros_itself(island)
    for host in island.hosts:
        for robot in spec.robots_on(host):
            topics = [topic.name for topic in robot.topics]
            full = [_full(robot, one) for one in topics]
            placed = ["/tf_static"] if any("/" in one for one in topics if not one.startswith("/")) else []
            others = ["/tf", *placed, *(["robot_description"] if not island.has_master else [])]
            yield from publishes(robot.driver_node, *full, *(_full(robot, one) for one in others))
            received = [COMMAND, *(actuators_of(robot.type) if isinstance(robot.type, RobotType) else ())]
            yield from subscribes(robot.driver_node, *(f"{robot.namespace}/{one}" for one in received))
            yield from of_ros_itself(island, robot.driver_node)
        for program in spec.programs_on(host):
            if program.name not in absent and not program.is_interactive:
                yield from _of_program(spec, program)
                yield from of_ros_itself(island, program.node)
    if island.name in spec.carriers:
        own = ("/diagnostics", *(["/parameter_events"] if not island.has_master else []))
        yield from publishes(names.multimaster_node(island.name), *own)


def _full(robot: Robot, topic: str) -> str:
    return topic if topic.startswith("/") else f"{robot.namespace}/{topic}"


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
