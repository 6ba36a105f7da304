"""The permissions of random swarms give each enclave what the spec declares for it, and nothing of others."""

from __future__ import annotations

import json
import os
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.render.ros2.enclaves import on_host, permissions
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec.catalog import Catalog, load_catalog
from swarmctl.spec.load import load_text
from swarmctl.swarm.names import resolved
from swarmctl.swarm.resolve import resolve
from swarmctl.swarm.resolved import Island, Robot, Swarm

GRAPHS = int(os.environ.get("SWARM_GRAPHS", "50"))
#: What every node of ROS 2 may publish (REP 149, REP 107, docs of rcl and tf2).
SHARED = {"/tf", "/tf_static", "/rosout", "/parameter_events", "/diagnostics"}
SPACES = {"r1": None, "r10": None, "r-2": None, "r3": "lab/r3"}  # one name begins with another
HOSTS = ("h1", "h2", "h3")
NATIVE, POSE = ("epuck", "khepera3"), "geometry_msgs/PoseStamped"
PACKAGES = ("turtlebot3-burger", "px4")  # gated, and ungated
#: A driver whose commands and odometry are outside its namespace.
OUTSIDE = {
    "package": "fleet", "executable": "fleet", "command": "/fleet/cmd", "ungated": True, "reason": "one",
    "publishes": [{"topic": "/fleet/odom", "type": "nav_msgs/Odometry"}],
}  # fmt: skip
PUBLISHED = (
    "goal",
    "~state",
    "cmd_vel",
    "/map",
    "/tf",
    "/r1/pose",
    "/r10/odom",
    "/lab/r3/leds",
    "/fleet/odom",
)
WHAT: tuple[dict[str, Any], ...] = (
    {"package": "demo", "executable": "x"},
    {"package": "demo", "executable": "x", "remap": {"goal": "/map", "~state": "/r_2/state"}},
    {"package": "demo", "launch": "x.launch.py"},
    {"command": ["ros2", "bag", "record", "-a"]},
    {"use": "teleop-joy"},
    {"use": "teleop-key"},
)


@st.composite
def swarms(draw: st.DrawFn) -> Swarm:
    """Robots of all kinds of drivers in islands of some hosts, with programs and commanders anywhere."""
    names = draw(st.lists(st.sampled_from([*SPACES]), min_size=1, unique=True))
    mode = draw(st.sampled_from(("single-minded", "leader", "central", "standalone", "combined")))
    host = st.just("h1") if mode == "single-minded" else st.sampled_from(HOSTS)
    robots = {name: _robot(draw, name, host) for name in names}
    where = st.one_of(
        st.fixed_dictionaries({"host": host}),
        st.fixed_dictionaries({"robot": st.sampled_from(names)}),
        st.fixed_dictionaries({"host": host, "namespace": st.sampled_from(("r1/arm", "r100", "lab"))}),
    )
    topics = st.lists(st.sampled_from(PUBLISHED), max_size=3, unique=True)
    programs = {
        f"p{number}": {**draw(where), **draw(st.sampled_from(WHAT)), "publishes": _typed(draw(topics))}
        for number in range(draw(st.integers(0, 4)))
    }
    places = {name: one.get("host") or robots[one["robot"]]["host"] for name, one in programs.items()}
    places |= {one: one for one in HOSTS} | {name: one["host"] for name, one in robots.items()}
    island = {"combined": {"h1": "a", "h2": "a", "h3": "b"}, "standalone": {one: one for one in HOSTS}}
    pairs = [  # islands of ROS 2 are not joined: a commander is on its robot's
        (by, of)
        for by in places
        for of in names
        if len({island.get(mode, {}).get(places[one]) for one in (by, of)}) == 1
    ]
    control = draw(st.lists(st.sampled_from(pairs), max_size=4))
    data = {
        "version": 1, "name": "any", "mode": mode, "ros": {"distro": "jazzy", "sros2": True},
        "hosts": {name: {"address": f"10.0.0.{place}"} for place, name in enumerate(HOSTS, 1)},
        "robots": robots, "programs": programs,
        "control": [{"by": by, "of": [of]} for by, of in control],
        "links": [
            {"host": one["host"], "robot": name, **_end(one["type"], name)} for name, one in robots.items()
        ],
        **_arrangement(mode),
    }  # fmt: skip
    document, found = load_text(json.dumps(data), "random.yaml", _catalog())
    assert document is not None, found
    return resolve(document)


def _robot(draw: st.DrawFn, name: str, host: st.SearchStrategy[str]) -> dict[str, Any]:
    kind = draw(st.sampled_from((*NATIVE, *PACKAGES, "pioneer3")))
    found = {"type": kind, "host": draw(host)} | ({"namespace": SPACES[name]} if SPACES[name] else {})
    return found | ({"driver": OUTSIDE} if kind == "pioneer3" else {})


def _end(kind: str, robot: str) -> dict[str, Any]:
    if kind == "px4":
        return {"kind": "udp", "address": f"{robot}.local"}
    return {"kind": "serial", "usb": {"serial": robot}}


def _typed(topics: list[str]) -> list[dict[str, str]]:
    return [{"topic": one, "type": POSE} for one in topics]


def _arrangement(mode: str) -> dict[str, Any]:
    if mode == "combined":
        first = {"mode": "leader", "hosts": ["h1", "h2"], "leader": "h1"}
        return {"islands": {"a": first, "b": {"mode": "central", "hosts": ["h3"], "hub": "h3"}}}
    keys = {"single-minded": "leader", "leader": "leader", "central": "hub"}
    return {keys[mode]: "h1"} if mode in keys else {}


@cache
def _catalog() -> Catalog:
    return load_catalog()


@dataclass(frozen=True)
class Process:
    """What runs in an enclave: the topics that the spec declares for it, and those on which it commands.

    ``robot`` is the one in whose namespace it runs.
    """

    publishes: frozenset[str]
    commands: frozenset[str]
    robot: str | None


def processes(swarm: Swarm, island: Island) -> Mapping[str, Process]:
    """What runs on an island, by the name of its enclave."""
    found, none = dict[str, Process](), frozenset[str]()
    for host in island.hosts:
        found[f"hosts/{host}"] = Process(none, commanded(swarm, host, ""), None)
    for robot in (one for one in swarm.robots.values() if one.host in island.hosts):
        own = frozenset(robot.full_name(one.name) for one in robot.topics)
        commands = commanded(swarm, robot.host, robot.driver_node)
        found[f"robots/{robot.name}"] = Process(own, commands, robot.name)
        if robot.gated:
            output = frozenset({f"{robot.namespace}/gate/cmd_vel"})
            found[f"gates/{robot.name}"] = Process(output, none, robot.name)
    for one in (one for one in swarm.programs.values() if one.host in island.hosts):
        topics = (resolved(each.topic, one.node, one.declared.remap) for each in one.declared.publishes)
        commands, above = commanded(swarm, one.host, one.node), robot_above(swarm, one.node)
        found[f"programs/{one.name}"] = Process(frozenset(topics), commands, above)
    return found


def commanded(swarm: Swarm, host: str, node: str) -> frozenset[str]:
    """The topics on which robots take commands, and settings, of a node on ``host``."""
    address = swarm.hosts[host].advertised
    return frozenset(
        topic
        for robot in swarm.robots.values()
        if any(one.includes(node, address) for one in robot.commanders)
        for topic in taken(robot)
    )


def taken(robot: Robot) -> set[str]:
    actuators = robot.type.actuators if isinstance(robot.type, RobotType) else {}
    command = {robot.command.topic} if robot.command is not None else set()
    return command | {f"{robot.namespace}/{one}" for one in actuators}


def robot_above(swarm: Swarm, name: str) -> str | None:
    """The robot in whose namespace a name lies."""
    inside = (one for one in swarm.robots.values() if name.startswith(f"{one.namespace}/"))
    return next((one.name for one in inside), None)


def owned(swarm: Swarm, island: Island) -> set[str]:
    """The topics that a process of an island publishes, or on which a robot of it takes commands."""
    commands = (taken(one) for one in swarm.robots.values() if one.host in island.hosts)
    return set[str]().union(*(one.publishes for one in processes(swarm, island).values()), *commands)


def may_publish(swarm: Swarm, process: Process, topic: str, of_all: set[str]) -> bool:
    """Whether the spec lets a process publish a topic; ``of_all`` are those that somebody has."""
    if topic in process.publishes | process.commands | SHARED:
        return True
    return topic not in of_all and robot_above(swarm, topic) in (None, process.robot)


def topics_of(swarm: Swarm) -> set[str]:
    """Every topic of all islands, and names that no spec has: in namespaces, beside them, alike."""
    declared = {
        topic
        for island in swarm.islands
        for one in processes(swarm, island).values()
        for topic in one.publishes | one.commands
    }
    spaces = {one.namespace for one in swarm.robots.values()}
    unknown = {
        f"{space}{end}" for space in spaces for end in ("", "/any", "/cmd_vel", "/gate/cmd_vel", "0/odom")
    }
    commands = {topic for one in swarm.robots.values() for topic in taken(one)}
    return declared | unknown | commands | SHARED | {"/chat", "/map", "/lab", "/lab/any", "/r100/any"}


@dataclass(frozen=True)
class Rule:
    """A rule of a grant: the patterns of topics for each of "publish" and "subscribe"."""

    allows: bool
    domains: frozenset[int]
    patterns: Mapping[str, tuple[str, ...]]

    def has(self, topic: str, kinds: tuple[str, ...]) -> bool:
        return any(fnmatchcase(topic, one) for kind in kinds for one in self.patterns[kind])


class Permissions:
    """What permissions let do (OMG DDS Security 1.1, 9.4.1.3): the first rule that has a topic decides."""

    def __init__(self, text: bytes) -> None:
        (grant,) = ET.fromstring(text).iterfind("permissions/grant")
        self.subject, self.default = grant.findtext("subject_name"), grant.findtext("default")
        self.rules = [*map(rule_of, (one for one in grant if one.tag.endswith("_rule")))]

    def let(self, topic: str, domain: int, *kinds: str) -> bool:
        rules = (one for one in self.rules if domain in one.domains and one.has(topic, kinds))
        return next((one.allows for one in rules), self.default == "ALLOW")

    def let_publish(self, topic: str, domain: int) -> bool:
        return self.let(topic, domain, "publish") and self._is_known(topic, domain)

    def let_subscribe(self, topic: str, domain: int) -> bool:
        return self.let(topic, domain, "subscribe") and self._is_known(topic, domain)

    def _is_known(self, topic: str, domain: int) -> bool:
        """Before a writer or reader, Cyclone DDS makes the topic: the first rule of either kind lets it."""
        return self.let(topic, domain, "publish", "subscribe")


def rule_of(element: ET.Element) -> Rule:
    found = {
        kind: tuple(one.text or "" for one in element.iterfind(f"{kind}/topics/topic"))
        for kind in ("publish", "subscribe")
    }
    domains = frozenset(int(one.text or "") for one in element.iterfind("domains/id"))
    return Rule(element.tag == "allow_rule", domains, found)


def rendered(swarm: Swarm, island: Island) -> Iterator[tuple[str, Permissions]]:
    for host in island.hosts:
        for grant in on_host(swarm, swarm.hosts[host]):
            yield grant.name, Permissions(permissions(swarm, grant))


@given(swarm=swarms())
@settings(max_examples=GRAPHS)
def test_an_enclave_publishes_what_the_spec_lets_it(swarm: Swarm) -> None:
    topics = topics_of(swarm)
    for island in swarm.islands:
        domain, expected = island.discovery.domain, processes(swarm, island)
        found, of_all = dict(rendered(swarm, island)), owned(swarm, island)
        assert found.keys() == expected.keys()
        for name, one in found.items():
            assert one.subject == f"CN=/{name}"
            for topic in topics:
                right = may_publish(swarm, expected[name], topic, of_all)
                assert one.let_publish(f"rt{topic}", domain) == right, (name, topic)


@given(swarm=swarms())
@settings(max_examples=GRAPHS)
def test_an_enclave_replies_for_nodes_of_its_own_namespace(swarm: Swarm) -> None:
    for island in swarm.islands:
        domain, expected = island.discovery.domain, processes(swarm, island)
        for name, one in rendered(swarm, island):
            for robot in swarm.robots.values():
                service = f"{robot.namespace}/any/get_parameters"
                own = expected[name].robot == robot.name
                assert one.let_publish(f"rr{service}Reply", domain) == own, (name, robot.name)
                assert one.let_publish(f"rq{service}Request", domain), "anyone may ask"
            assert one.let_publish("rr/map_server/get_mapReply", domain)
            assert one.let_publish("ros_discovery_info", domain)


@given(swarm=swarms())
@settings(max_examples=GRAPHS)
def test_an_enclave_reads_all_of_its_domain_and_nothing_of_others(swarm: Swarm) -> None:
    names = [f"rt{one}" for one in topics_of(swarm)] + ["rr/r1/any/get_parametersReply", "ros_discovery_info"]
    for island in swarm.islands:
        domain = island.discovery.domain
        for _, one in rendered(swarm, island):
            assert all(one.let_subscribe(name, domain) for name in names)
            for other in {0, domain - 1, domain + 1, 232} - {domain}:
                assert not any(
                    one.let_publish(name, other) or one.let_subscribe(name, other) for name in names
                )
