"""What the agent asks a master about other islands: who publishes what crosses, who is from elsewhere."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest
from swarm_onboard.agent.observations import ForeignNode, GraphSeen
from swarm_onboard.agent.verbs.probe import Request
from swarm_onboard.common.xmlrpc import PeerError
from swarm_onboard.ros1_probe import islands

from tests.onboard.ros1_probe.ros_fakes import FakeRos, served

ODOM = "nav_msgs/Odometry"
OWN = ["192.168.77.10", "koala-laptop"]


@pytest.fixture
def master() -> Iterator[tuple[FakeRos, str]]:
    """A master with a node of its own by address, one by name, and one that came from another island."""
    fake = FakeRos(
        {
            "/koala/driver": "http://192.168.77.10:4001/",
            "/tool": "http://Koala-Laptop:4002/",
            "/k3/driver": "http://192.168.77.11:4003/",
        },
        {"/koala/odom": ["/koala/driver"], "/k3/odom": ["/k3/driver"], "/stale": ["/gone"]},
        {"/koala/cmd_vel": ["/koala/driver", "/k3/driver"], "/k3/odom": ["/tool"]},
        {"/k3/odom": ODOM, "/koala/odom": ODOM},
    )
    with served(fake.functions()) as uri:
        yield fake, uri


def look(uri: str, topics: list[str]) -> GraphSeen:
    async def graph() -> GraphSeen:
        request = Request("new", "", master=uri, graph=True, bridged=topics, own=OWN)
        (part,) = [part async for part in islands.look(request)]
        return part["graph"]

    return asyncio.run(graph())


def test_publishers_of_bridged_topics_have_their_addresses(master: tuple[FakeRos, str]) -> None:
    found = look(master[1], ["/k3/odom", "/stale", "/nothing"])
    assert found.publishers == {
        "/k3/odom": {"/k3/driver": "http://192.168.77.11:4003/"},
        "/stale": {"/gone": ""},
        "/nothing": {},
    }
    assert found.types == {"/k3/odom": ODOM}


def test_a_foreign_node_is_found_by_its_address(master: tuple[FakeRos, str]) -> None:
    """A host's own name counts as its address, however it is written; a node that just left is nobody."""
    assert look(master[1], []).foreign == [
        ForeignNode("/k3/driver", "http://192.168.77.11:4003/", ["/k3/odom"], ["/koala/cmd_vel"])
    ]


def test_nothing_is_registered(master: tuple[FakeRos, str]) -> None:
    look(master[1], ["/k3/odom"])
    assert set(master[0].calls) == {"getSystemState", "getTopicTypes", "lookupNode"}


def test_a_master_that_talks_nonsense_is_a_peer_error(master: tuple[FakeRos, str]) -> None:
    functions = master[0].functions() | {"getSystemState": lambda caller: [1, "", [[["/k3/odom"]]]]}
    with served(functions) as uri, pytest.raises(PeerError, match="makes no sense"):
        look(uri, [])
