"""Which node sent a command, by the GID of its publisher."""

from __future__ import annotations

import sys
import types
from types import SimpleNamespace
from typing import Any

import pytest

from tests.timing import wait_for

GID, OTHER = b"\x01" * 16, b"\x02" * 16


@pytest.fixture
def senders(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The module, on a machine with or without rclpy."""
    rclpy = types.ModuleType("rclpy")
    monkeypatch.setitem(sys.modules, "rclpy", rclpy)
    monkeypatch.setattr(rclpy, "subscription", SimpleNamespace(), raising=False)
    monkeypatch.delitem(sys.modules, "swarm_onboard.ros2.senders", raising=False)
    from swarm_onboard.ros2 import senders

    return senders


class Graph:
    """A node that sees some publishers."""

    def __init__(self) -> None:
        self.publishers: list[Any] = []

    def add(self, namespace: str, name: str, gid: bytes, padding: int = 0) -> None:
        gid += bytes(padding)
        self.publishers.append(
            SimpleNamespace(node_namespace=namespace, node_name=name, endpoint_gid=list(gid))
        )

    def resolve_topic_name(self, topic: str) -> str:
        return f"/k3/{topic}"

    def get_publishers_info_by_topic(self, topic: str) -> list[Any]:
        assert topic == "/k3/cmd_vel"
        return self.publishers


@pytest.mark.parametrize("padding", [0, 8], ids=["jazzy", "humble"])
def test_a_known_publisher_has_the_full_name_of_its_node(senders: Any, padding: int) -> None:
    graph, called = Graph(), []
    graph.add("/desk", "joystick", GID, padding)
    graph.add("/", "map", OTHER, padding)
    found = senders.Senders(graph, "cmd_vel")
    found.when_named(GID, called.append)
    found.when_named(OTHER, called.append)
    assert called == ["/desk/joystick", "/map"]


def test_the_first_command_waits_until_the_graph_names_its_sender(senders: Any) -> None:
    graph, called = Graph(), []
    graph.add("", senders._NAMELESS, GID)
    found = senders.Senders(graph, "cmd_vel")
    found.when_named(GID, called.append)
    assert called == []
    graph.add("/", "boss", GID)
    wait_for(lambda: called == ["/boss"])


def test_a_sender_without_a_name_is_passed_on(senders: Any) -> None:
    called: list[str] = []
    found = senders.Senders(Graph(), "cmd_vel")
    for _ in range(3):
        found.when_named(GID, called.append)
    wait_for(lambda: called == [senders.UNKNOWN])
