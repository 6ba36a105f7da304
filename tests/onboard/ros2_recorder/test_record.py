"""Which hosts publish a topic of ROS 2, and how a recorder follows the publishers of its topics."""

from __future__ import annotations

import sys
import types
from types import SimpleNamespace
from typing import Any

import pytest
from swarm_onboard.agent.verbs import probe
from swarm_onboard.agent.verbs.record import Request, topics_here
from swarm_onboard.ros2_probe import endpoints, observe
from swarm_onboard.ros2_recorder import record

from tests.onboard.ros2_probe.test_endpoints import HUB, OTHER, PI, end

STRING = "std_msgs/msg/String"
ONE, TWO = "/k3/driver", "/koala/driver"
NODES = {ONE: "pi", TWO: "laptop"}
ENDS = (
    end("/k3/driver", "/k3/odom"),
    end("/launched", "/k3/scan"),  # on the same host, and the spec does not name it
    end("/koala/driver", "/koala/odom", host=HUB),
    end("/k3/driver", "/tf"),
    end("/koala/driver", "/tf", host=HUB),
    end("/visitor", "/map", host=OTHER),
    *(
        end(one, topic, host=host)
        for one, host in ((ONE, PI), (TWO, HUB))
        for topic in ("/rosout", "/k3/_hidden", "/parameter_events")
    ),
)


def request(host: str, *patterns: str) -> Request:
    return Request(
        "new", "robot", [], list(patterns or ("*",)), 0.0,
        module="", master="", host=host, hub="laptop", homes={}, nodes=NODES, awaited=[*NODES], declared={},
    )  # fmt: skip


@pytest.fixture(params=["fastdds", "another"])
def _seen(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a node on a host sees: with hosts in its GIDs, or without."""

    def look(wanted: probe.Request, answer: probe.Answer) -> probe.Answer:
        own = {"pi": PI, "laptop": HUB}[wanted.advertised]
        seen = (
            ENDS
            if request.param == "fastdds"
            else [SimpleNamespace(**{**vars(one), "gid": bytes(16)}) for one in ENDS]
        )
        nodes = list(dict.fromkeys(one.node for one in ENDS))
        graph: Any = endpoints.Graph(nodes, seen, (), b"\x01\x0f" + own + bytes(12))
        return answer._replace(**endpoints.parts(graph, wanted))

    monkeypatch.setattr(observe, "observe", look)


def recorded(host: str, *patterns: str) -> list[str]:
    return topics_here(request(host, *patterns), record.published(request(host, *patterns)))


@pytest.mark.usefixtures("_seen")
def test_each_topic_is_that_of_one_host(request: pytest.FixtureRequest) -> None:
    fast = "fastdds" in request.node.name
    assert recorded("pi") == (["/k3/odom", "/k3/scan"] if fast else ["/k3/odom"])
    assert recorded("laptop") == [*(() if fast else ["/k3/scan"]), "/koala/odom", "/map", "/tf"]


@pytest.mark.usefixtures("_seen")
def test_topics_of_every_node_and_hidden_ones_need_their_name() -> None:
    assert recorded("laptop", "/rosout", "/r*", "/parameter_events") == ["/parameter_events", "/rosout"]
    assert recorded("laptop", "/k3/_hidden") == ["/k3/_hidden"]


class Node:
    """A node that sees some publishers."""

    def __init__(self) -> None:
        self.publishers: dict[str, list[Any]] = {}
        self.subscribed: dict[str, tuple[str, str]] = {}

    def publish(self, topic: str, kind: str, *qualities: tuple[str, str]) -> None:
        self.publishers[topic] = [
            SimpleNamespace(topic_type=kind, qos_profile=SimpleNamespace(reliability=one, durability=other))
            for one, other in qualities
        ]

    def get_publishers_info_by_topic(self, topic: str) -> list[Any]:
        return self.publishers.get(topic, [])

    def create_subscription(self, message: Any, topic: str, take: Any, profile: Any, *, raw: bool) -> str:
        assert raw
        assert topic not in self.subscribed
        self.subscribed[topic] = profile.reliability, profile.durability
        return topic

    def destroy_subscription(self, topic: str) -> None:
        del self.subscribed[topic]


@pytest.fixture
def subscriptions(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The module, on a machine with a stand-in for rclpy and one message package."""
    rclpy, qos, std_msgs = (types.ModuleType(one) for one in ("rclpy", "rclpy.qos", "std_msgs.msg"))
    monkeypatch.setattr(rclpy, "subscription", SimpleNamespace(), raising=False)
    policies = {
        "QoSProfile": lambda depth, reliability: SimpleNamespace(
            reliability=reliability, durability="volatile"
        ),
        "ReliabilityPolicy": SimpleNamespace(RELIABLE="reliable", BEST_EFFORT="best effort"),
        "DurabilityPolicy": SimpleNamespace(TRANSIENT_LOCAL="transient local"),
    }
    for name, value in policies.items():
        monkeypatch.setattr(qos, name, value, raising=False)
    monkeypatch.setattr(std_msgs, "String", object, raising=False)
    for module in (rclpy, qos, std_msgs):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    for name in ("swarm_onboard.ros2.quality", "swarm_onboard.ros2_recorder.subscriptions"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    from swarm_onboard.ros2_recorder import subscriptions

    return subscriptions


def test_late_topics_and_other_publishers_are_followed(subscriptions: Any) -> None:
    node = Node()
    following = subscriptions.Subscriptions(node, ["/late", "/map"], print)
    node.publish("/map", STRING, ("reliable", "transient local"))
    following.follow()
    following.follow()
    assert node.subscribed == {"/map": ("reliable", "transient local")}
    node.publish("/late", STRING, ("best effort", "volatile"))
    node.publish("/map", STRING, ("reliable", "transient local"), ("best effort", "volatile"))
    following.follow()
    assert node.subscribed == dict.fromkeys(("/late", "/map"), ("best effort", "volatile"))
    node.publish("/map", STRING)
    following.follow()
    assert "/map" in node.subscribed, "a publisher may be back at any time"


def test_a_type_that_the_host_lacks_costs_its_topic_alone(subscriptions: Any) -> None:
    node = Node()
    following = subscriptions.Subscriptions(node, ["/odd", "/name"], print)
    node.publish("/odd", "other_msgs/msg/Odd", ("reliable", "volatile"))
    node.publish("/name", STRING, ("reliable", "volatile"))
    following.follow()
    assert node.subscribed.keys() == {"/name"}
    assert following.lacking == {"other_msgs/msg/Odd"}
