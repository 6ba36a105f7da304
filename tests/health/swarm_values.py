"""The example's expected graph, and the answers of its hosts when all is well, to be spoilt by the tests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

from swarm_onboard.agent.observations import DeviceSeen, MasterSeen, NodeSeen, Report, SenderSeen, TopicSeen
from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, ExpectedRobot, Release, expected_graph
from swarmctl.render.build_bundle import bundles
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.loading import load_swarm

EXAMPLE = ROOT / "examples/paper-leader/swarm.yaml"
HOSTS = ("koala-laptop", "k3-pi", "epuck-pi")
LAPTOP, K3_PI, EPUCK_PI = HOSTS
MASTER = "swarm-newswarm.master.service"
TARGET = "swarm-newswarm.target"
WLAN = "swarm-newswarm.wlan.service"
UNIT = {robot: f"swarm-newswarm.{robot}.service" for robot in ("koala", "k3", "epuck")}
RFCOMM = "swarm-newswarm.epuck.rfcomm.service"
NO_ADAPTER = {  # of RFCOMM, on a host without Bluetooth
    "active": "inactive", "sub": "dead", "skipped": True,
    "unmet": ("ConditionPathExists=/sys/class/bluetooth/hci0",),
}  # fmt: skip
DIGESTS = {"koala-laptop": "a" * 16, "k3-pi": "b" * 16, "epuck-pi": "c" * 16}


@cache
def swarm() -> Swarm:
    found, diagnostics = load_swarm(EXAMPLE)
    assert found is not None, diagnostics
    return found


@cache
def graph(hosts: tuple[str, ...] = HOSTS) -> ExpectedGraph:
    """The example's expected graph; its releases have short names so that the golden texts stay true."""
    rendered = bundles(swarm())
    releases = {
        name: Release(DIGESTS[name], tuple(unit.name for unit in rendered[name].units)) for name in hosts
    }
    return expected_graph(swarm(), releases)


def with_optional(name: str) -> ExpectedGraph:
    """The graph with one host, or one robot, that the swarm is complete without."""
    hosts = tuple(
        replace(
            host,
            optional=host.name == name,
            robots=tuple(replace(robot, optional=name in (robot.name, host.name)) for robot in host.robots),
        )
        for host in graph().hosts
    )
    return replace(graph(), hosts=hosts)


RUNNING = UnitState("loaded", "active", "running", "success", "", 42, 0, 0, False)


def well(host: ExpectedHost) -> Answer:
    """What ``host`` says when nothing is wrong."""
    return Answer(
        release=host.release.digest,
        units={
            name: RUNNING._replace(sub="active", pid=0) if name == TARGET else RUNNING
            for name in host.release.units
        },
        master=MasterSeen(True, "", "run-1", 0.0008 if host.is_hub else 0.0041),
        nodes={robot.node: node(robot, host) for robot in host.robots},
        commanders={one.command: () for one in graph().robots} if host.is_hub else {},
        devices={
            robot.device: DeviceSeen(True, True, True, robot.device, "dialout", 0o660, ())
            for robot in host.robots
        },
        clock_ahead=0.1,
        boot_id="1",
    )


def node(robot: ExpectedRobot, host: ExpectedHost) -> NodeSeen:
    return NodeSeen(
        registered=True,
        alive=True,
        uri=f"http://{host.address}:40001/",
        pid=42,
        error="",
        publishes={topic.name: topic.type for topic in robot.topics},
        subscribes={robot.command: "geometry_msgs/Twist"},
        topics={one.name: TopicSeen(20, one.rate, 2.0, one.type, "") for one in robot.topics},
        report=Report(0, "standing still: no accepted command yet"),
    )


def all_well(shown: ExpectedGraph | None = None) -> dict[str, Any]:
    return {host.name: well(host) for host in (shown or graph()).hosts}


Spoil = Callable[[Answer], Answer]


def with_unit(name: str, **changes: Any) -> Spoil:
    return lambda answer: answer._replace(
        units={**answer.units, name: answer.units[name]._replace(**changes)}
    )


def with_node(robot: str, **changes: Any) -> Spoil:
    name = f"/{robot}/driver"
    return lambda answer: answer._replace(
        nodes={**answer.nodes, name: answer.nodes[name]._replace(**changes)}
    )


def with_device(robot: str, **changes: Any) -> Spoil:
    path = next(one.device for one in graph().robots if one.name == robot)
    return lambda answer: answer._replace(devices={path: answer.devices[path]._replace(**changes)})


def with_topic(robot: str, topic: str, **changes: Any) -> Spoil:
    def spoil(answer: Answer) -> Answer:
        found = answer.nodes[f"/{robot}/driver"]
        topics = {**found.topics, topic: found.topics[topic]._replace(**changes)}
        return with_node(robot, topics=topics)(answer)

    return spoil


def with_senders(robot: str, **hosts: str) -> Spoil:
    """Nodes that publish commands of ``robot``, each with its host, as the hub reports them."""
    command = f"/{robot}/cmd_vel"

    def spoil(answer: Answer) -> Answer:
        seen = {
            f"/{node}": SenderSeen(host, {command: "geometry_msgs/Twist"}) for node, host in hosts.items()
        }
        return answer._replace(
            commanders={**answer.commanders, command: tuple(seen)},
            senders={**answer.senders, **seen},
        )

    return spoil


def with_master(**changes: Any) -> Spoil:
    return lambda answer: answer._replace(master=answer.master._replace(**changes))  # type: ignore[type-var]


def changed(**changes: Any) -> Spoil:
    return lambda answer: answer._replace(**changes)


def both(*spoils: Spoil) -> Spoil:
    def spoil(answer: Answer) -> Answer:
        for one in spoils:
            answer = one(answer)
        return answer

    return spoil


def no_serial_port(robot: str) -> Spoil:
    """A cable is out: no device, the driver says so and publishes nothing but that."""
    missing = f"no serial port /dev/swarm/{robot}"
    return both(
        with_device(robot, exists=False),
        with_node(robot, report=Report(2, missing)),
        *(
            with_topic(robot, f"/{robot}/{sensor}", count=0, rate=None)
            for sensor in ("odom", "proximity", "ground", "battery")
        ),
    )


def nothing_deployed(answer: Answer) -> Answer:
    """A host as it comes from the shop."""
    gone = UnitState("not-found", "inactive", "dead", "success", "", 0, 0, 0, False)
    return answer._replace(
        release=None,
        units=dict.fromkeys(answer.units, gone),
        nodes={
            name: one._replace(registered=False, alive=None, error="unknown node")
            for name, one in answer.nodes.items()
        },
        devices={path: one._replace(exists=False) for path, one in answer.devices.items()},
    )
