"""What a graph of ROS 2 means, from endpoints as rclpy lists them."""

from __future__ import annotations

from typing import Any

from swarm_onboard.agent.verbs.probe import Request
from swarm_onboard.ros2_probe.endpoints import Endpoint, Graph, full_name, parts, settled

TWIST, ODOMETRY = "geometry_msgs/msg/Twist", "nav_msgs/msg/Odometry"
HUB, PI, OTHER = b"\x0a\x0a", b"\x0b\x0b", b"\x0c\x0c"


def end(node: str, topic: str, kind: str = ODOMETRY, host: bytes = PI, **changes: Any) -> Endpoint:
    """An endpoint of Fast DDS; ``number``: of its process."""
    number = changes.pop("number", sum(node.encode()))
    gid = b"\x01\x0f" + host + number.to_bytes(8, "big") + bytes(4)
    return Endpoint(node, topic, kind, changes.pop("hash", "RIHS01_1"), gid, **changes)


def request(**changes: Any) -> Request:
    found = Request(
        "new",
        "",
        nodes={"/k3/driver": {"/k3/odom": 2.0}},
        commands=["/k3/cmd_vel"],
        publishers={"/k3/odom": ["/k3/driver"]},
        homes={"/k3/driver": "10.0.0.2"},
        advertised="10.0.0.1",
    )
    return found._replace(**changes)


DRIVER = (end("/k3/driver", "/k3/odom"),)
LISTENS = (end("/k3/driver", "/k3/cmd_vel", TWIST),)


def answer(
    *more: Endpoint, listens: tuple[Endpoint, ...] = (), incompatible: Any = lambda *_: "", **changes: Any
) -> dict[str, Any]:
    """What the hub sees of a driver and ``more`` publishers."""
    publishers, subscriptions = (*DRIVER, *more), (*LISTENS, *listens)
    nodes = ["/k3/driver", *dict.fromkeys(one.node for one in (*more, *listens))]
    own = b"\x01\x0f" + HUB + bytes(12)
    return parts(Graph(nodes, publishers, subscriptions, own, incompatible), request(**changes))


def test_a_node_has_its_topics_and_types() -> None:
    node = answer()["nodes"]["/k3/driver"]
    assert (node.registered, node.publishes) == (True, {"/k3/odom": ODOMETRY})
    assert node.subscribes == {"/k3/cmd_vel": TWIST}


def test_one_that_is_not_there_is_not_registered() -> None:
    found = parts(Graph([], (), ()), request())
    assert found["nodes"]["/k3/driver"].registered is False
    assert found["seen"] == 0


def test_senders_of_commands_have_their_hosts() -> None:
    """The hub knows its own part of the GIDs, and another host by the node that runs there."""
    found = answer(
        end("/here", "/k3/cmd_vel", TWIST, HUB),
        end("/there", "/k3/cmd_vel", TWIST, PI),
        end("/far", "/k3/cmd_vel", TWIST, OTHER),
        Endpoint("/cyclone", "/k3/cmd_vel", TWIST, "", bytes(16)),
    )
    assert found["commanders"] == {"/k3/cmd_vel": ["/cyclone", "/far", "/here", "/there"]}
    assert found["receivers"] == {"/k3/cmd_vel": ["/k3/driver"]}
    hosts = {name: sender.host for name, sender in found["senders"].items()}
    assert hosts == {"/here": "10.0.0.1", "/there": "10.0.0.2", "/far": "", "/cyclone": ""}


def test_other_topics_that_may_carry_commands_are_looked_up() -> None:
    found = answer(end("/joy", "/joy_vel", TWIST), command_types=[TWIST])
    assert found["commanders"]["/joy_vel"] == ["/joy"]


def test_a_second_publisher_is_found_unless_its_name_is_not_known_yet() -> None:
    unknown = full_name("_NODE_NAMESPACE_UNKNOWN_", "_NODE_NAME_UNKNOWN_")
    assert answer(end("/second", "/k3/odom"))["others"] == {"/k3/odom": ["/second"]}
    assert answer(end(unknown, "/k3/odom"))["others"] == {}
    without = full_name("/", "_CREATED_BY_BARE_DDS_APP_")
    assert answer(end(without, "/k3/odom"))["others"] == {"/k3/odom": ["a program without ROS"]}


def test_nodes_of_one_name_are_found_on_their_hosts() -> None:
    twice = (*DRIVER, end("/k3/driver", "/k3/odom", host=HUB, number=7))
    nodes = ["/k3/driver", "/k3/driver", "/_ros2cli_1", "/_ros2cli_1"]
    found = parts(Graph(nodes, twice, (), b"\x01\x0f" + HUB + bytes(12)), request())
    assert found["doubles"] == {"/k3/driver": ["10.0.0.1", "10.0.0.2"]}
    assert found["seen"] == 2


def test_pairs_that_exchange_nothing_are_found() -> None:
    same, other = end("/a", "/k3/odom", quality="sub"), end("/b", "/k3/odom", TWIST)
    version = end("/c", "/k3/odom", hash="RIHS01_2")
    unknown = end("/d", "/k3/odom", hash="INVALID")
    found = answer(listens=(other, version, unknown))["unmatched"]
    assert [(one.subscriber, one.type, one.policies) for one in found] == [
        ("/b", TWIST, ""),
        ("/c", ODOMETRY, ""),
    ]
    [pair] = answer(listens=(same,), incompatible=lambda _, sub: "too little" if sub else "")["unmatched"]
    assert (pair.publisher, pair.subscriber, pair.policies) == ("/k3/driver", "/a", "too little")


def test_only_the_hub_looks_at_the_whole_island() -> None:
    assert {"doubles", "unmatched"} & answer(homes={}).keys() == set()


def test_nodes_of_a_launch_file_are_on_this_host_with_its_topics() -> None:
    found = answer(
        end("/eyes", "/scan", host=HUB),
        end("/far", "/scan", host=OTHER),
        end("/other", "/map", host=HUB),
        launched={"unit": {"/scan": 2.0, "/k3/odom": 0.0}},
    )
    assert list(found["launched"]["unit"].nodes) == ["/eyes"]


def test_a_launched_node_that_takes_commands_may_have_no_topics() -> None:
    gated = "/k3/gate/cmd_vel"
    found = answer(
        end("/eyes", "/scan", host=HUB),
        end("/bystander", gated, TWIST, host=HUB),
        listens=(end("/wheels", gated, TWIST, host=HUB), end("/far", gated, TWIST, host=OTHER)),
        launched={"unit": {"/scan": 2.0}},
        expected={"unit": {"publishes": ["/scan"], "subscribes": [gated], "provides": []}},
    )
    nodes = found["launched"]["unit"].nodes
    assert list(nodes) == ["/eyes", "/wheels"]
    assert nodes["/wheels"].subscribes == {gated: TWIST}


def test_it_is_settled_when_every_node_and_measured_topic_is_seen() -> None:
    assert settled(Graph(["/k3/driver"], DRIVER, ()), request())
    assert not settled(Graph(["/k3/driver"], (), ()), request())
    assert not settled(Graph([], DRIVER, ()), request())
    assert not settled(Graph(["/k3/driver"], DRIVER, ()), request(peers=["/koala/driver"]))
    assert settled(Graph([], (), ()), request(skippable={"/k3/driver": "unit"}))
    nameless = end(full_name("", "_NODE_NAME_UNKNOWN_"), "/k3/cmd_vel")
    assert not settled(Graph(["/k3/driver"], (*DRIVER, nameless), ()), request())
