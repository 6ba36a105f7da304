"""A node of a ROS 1 graph that does not publish all of its topics yet, or never does."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from typing import Any

import pytest
from swarm_onboard.agent.observations import NodeSeen
from swarm_onboard.ros1_probe import nodes

from tests.onboard.ros1_probe.ros_fakes import FakeRos, peer, publishing, served, slave

ODOM = {"/k3/odom": "nav_msgs/Odometry"}
LISTENING = {"/k3/odom": 0.1}


@pytest.fixture
def driver() -> Iterator[dict[str, Any]]:
    """The slave API of a driver that publishes odometry at 20 Hz."""
    with peer(publishing(ODOM["/k3/odom"], 20.0)) as port:
        yield slave({"/k3/odom": port}, ODOM)


def looked(driver: Mapping[str, Any], topics: Mapping[str, float]) -> NodeSeen:
    """The last of what a look at the driver yields."""

    async def look(master: str) -> NodeSeen:
        return [node async for node in nodes.look(master, "/k3/driver", topics, {})][-1]

    with ExitStack() as stack:
        fake = FakeRos({"/k3/driver": stack.enter_context(served(dict(driver)))})
        return asyncio.run(look(stack.enter_context(served(fake.functions()))))


def test_a_node_that_publishes_late_is_waited_for(driver: dict[str, Any]) -> None:
    """The driver of a board knows its topics seconds after it runs."""
    looks: list[int] = []

    def publications(caller: str) -> list[Any]:
        looks.append(len(looks))
        return [1, "", [list(pair) for pair in ODOM.items()] if len(looks) > 2 else []]

    node = looked({**driver, "getPublications": publications}, LISTENING)
    assert node.publishes == ODOM
    assert "/k3/odom" in node.topics
    assert len(looks) == 3, "and no longer than until all are there"


def test_a_topic_that_never_comes_is_missing(driver: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nodes, "LATE", 0.3)
    node = looked(driver, {**LISTENING, "/k3/lwheel": 0.1})
    assert (node.alive, node.publishes) == (True, ODOM)
    assert "/k3/odom" in node.topics, "the others are measured"
