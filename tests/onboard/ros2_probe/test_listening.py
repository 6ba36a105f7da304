"""Messages are counted by their publisher."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from swarm_onboard.agent.observations import NodeSeen
from swarm_onboard.agent.verbs.probe import Request
from swarm_onboard.ros2_probe.endpoints import Graph, parts
from swarm_onboard.ros2_probe.listening import Listening

from tests.onboard.ros2_probe.test_endpoints import end, request

STATUS = "diagnostic_msgs/msg/DiagnosticArray"


class Node:
    """Has the callbacks of its subscriptions."""

    def __init__(self) -> None:
        self.taking: dict[str, Any] = {}


def subscribe(node: Node, _kind: Any, topic: str, take: Any, _qos: Any, *, raw: bool) -> Callable[[], None]:
    node.taking[topic] = take
    return node.taking.clear


@pytest.fixture(autouse=True)
def ros(monkeypatch: pytest.MonkeyPatch) -> None:
    qos = ModuleType("rclpy.qos")
    vars(qos).update(QoSProfile=lambda **_: None, ReliabilityPolicy=SimpleNamespace(BEST_EFFORT=0))
    modules = {"rclpy": ModuleType("rclpy"), "rclpy.qos": qos}
    for package, kind in (("nav_msgs", "Odometry"), ("diagnostic_msgs", "DiagnosticArray")):
        modules[package] = ModuleType(package)
        modules[f"{package}.msg"] = ModuleType(f"{package}.msg")
        setattr(modules[f"{package}.msg"], kind, object)
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)


def driver_seen(listening: Listening, graph: Graph, wanted: Request) -> NodeSeen:
    name = "/k3/driver"
    return listening.measured(name, parts(graph, wanted)["nodes"][name])


def test_only_messages_of_the_node_count() -> None:
    wanted = request(nodes={"/k3/driver": {"/diagnostics": 2.0}})
    driver, gate = (end(one, "/diagnostics", STATUS) for one in ("/k3/driver", "/k3/gate"))
    graph, node = Graph(["/k3/driver", "/k3/gate"], (driver, gate), ()), Node()
    listening = Listening(wanted, node, 15.0, subscribe)
    listening.begin(graph, time.monotonic())
    fine = SimpleNamespace(level=b"\x01", name="k3: driver", message="slow", hardware_id="", values=[])
    for sender, statuses in ((driver, [fine]), (gate, []), (gate, []), (driver, [fine])):
        node.taking["/diagnostics"](SimpleNamespace(status=statuses), sender.gid, 0, 0)
    seen = driver_seen(listening, graph, wanted)
    assert (seen.topics["/diagnostics"].count, seen.topics["/diagnostics"].type) == (2, STATUS)
    assert seen.report is not None
    assert (seen.report.level, seen.report.message) == (1, "slow")


def test_it_ends_when_the_window_is_over_and_leaves_the_topic() -> None:
    node, wanted = Node(), request()
    graph = Graph(["/k3/driver"], (end("/k3/driver", "/k3/odom"),), ())
    listening = Listening(wanted, node, 15.0, subscribe)
    now = time.monotonic()
    listening.begin(graph, now)
    assert listening.running
    listening.end(now + 1)
    assert listening.running
    listening.end(now + 60)
    assert not listening.running
    assert node.taking == {}
    topic = driver_seen(listening, graph, wanted).topics["/k3/odom"]
    assert (topic.count, topic.rate, topic.seconds) == (0, None, 2.0)


def test_large_messages_end_it_early() -> None:
    node, wanted = Node(), request()
    driver = end("/k3/driver", "/k3/odom")
    listening = Listening(wanted, node, 15.0, subscribe)
    listening.begin(Graph(["/k3/driver"], (driver,), ()), time.monotonic())
    for _ in range(3):
        node.taking["/k3/odom"](bytes(20 << 20), driver.gid, 0, 0)
    listening.end(time.monotonic())
    assert not listening.running


@pytest.mark.parametrize(
    ("times", "ends"),
    [
        ([0.3, 1.3, 2.3], 2.3),  # with the last message that its window can have
        ([0.3, 1.2, 2.0, 2.7], 2.8),  # one that is a little quicker, with its window
        ([0.3, 0.4, 0.5], 2.8),
        ([0.3, 1.9], 2.8),
    ],
)
def test_a_slow_topic_is_measured_until_its_rate_is_known(
    times: list[float], ends: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    node, wanted = Node(), request(nodes={"/k3/driver": {"/k3/odom": 2.5}})
    driver = end("/k3/driver", "/k3/odom")
    listening = Listening(wanted, node, 15.0, subscribe)
    listening.begin(Graph(["/k3/driver"], (driver,), ()), 0.0)
    for now in times:
        monkeypatch.setattr(time, "monotonic", lambda now=now: now)
        listening.end(now)
        assert listening.running
        node.taking["/k3/odom"](b"", driver.gid, 0, 0)
    listening.end(ends - 0.01)
    assert listening.running
    listening.end(ends)
    assert not listening.running


def test_a_type_that_the_host_lacks_is_named_and_not_measured() -> None:
    node, wanted = Node(), request()
    graph = Graph(["/k3/driver"], (end("/k3/driver", "/k3/odom", "lab_msgs/msg/Odometry"),), ())
    listening = Listening(wanted, node, 15.0, subscribe)
    listening.begin(graph, time.monotonic())
    assert driver_seen(listening, graph, wanted).topics == {}
    assert list(listening.lacking) == ["lab_msgs/msg/Odometry"]
