"""It connects to nodes of other hosts as a subscriber: to the slave API, then to the port of topics."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest
from swarm_onboard.agent.observations import PeerSeen
from swarm_onboard.agent.verbs.probe import Request
from swarm_onboard.common.xmlrpc import PeerError
from swarm_onboard.ros1_probe import client, connections

from tests.onboard.ros1_probe.ros_fakes import FakeRos, peer, received_header, served, slave
from tests.timing import PATIENCE, wait_for

COMMAND, TWIST = "/k3/cmd_vel", "geometry_msgs/Twist"


def looked(fake: FakeRos, **other: Any) -> dict[str, PeerSeen]:
    found: dict[str, PeerSeen] = {}

    async def look(request: Request) -> None:
        async for part in connections.look(request):
            found.update(part.get("peers", {}))

    with served(fake.functions()) as master:
        request = Request("new", "", master=master, advertised="10.0.0.1", inputs=[COMMAND])
        asyncio.run(look(request._replace(**other)))
    return found


@contextmanager
def dropping() -> Iterator[int]:
    """A port at which no packet has an answer, as behind a firewall: the queue of its listener is full."""
    with ExitStack() as stack:
        listener = stack.enter_context(socket.socket())
        listener.bind(("127.0.0.1", 0))
        listener.listen(0)
        stack.enter_context(socket.create_connection(listener.getsockname()))
        yield listener.getsockname()[1]


@contextmanager
def publisher(port: int) -> Iterator[FakeRos]:
    """A master with a node /pilot that publishes commands at ``port``."""
    with served(slave({COMMAND: port}, {COMMAND: TWIST})) as uri:
        yield FakeRos({"/pilot": uri}, {COMMAND: ["/pilot"]})


def test_the_port_for_topics_is_tried_without_a_subscription() -> None:
    headers: list[bytes] = []
    with peer(lambda one: headers.append(received_header(one))) as port, publisher(port) as fake:
        found = looked(fake)
        wait_for(lambda: headers)  # the thread of the peer may be slower
    assert found["/pilot"].error == ""
    assert found["/pilot"].topics == [COMMAND]
    assert len(headers) == 1
    assert b"service=/pilot/get_loggers" in headers[0]
    assert b"probe=1" in headers[0]
    assert b"topic=" not in headers[0]


def test_a_port_for_topics_that_lets_nothing_in_has_address_and_cause(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(client, "_CONNECT_SECONDS", 0.3)
    with dropping() as port, publisher(port) as fake:
        found = looked(fake)["/pilot"]
        assert (found.port, found.error) == (port, f"127.0.0.1:{port}: timed out")
        assert looked(fake, peers=["/pilot"], inputs=[])["/pilot"].error == ""  # a master needs no topic


def test_slave_apis_are_tried_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [f"/robot_{number}" for number in range(20)]
    begun, all_begun = [], asyncio.Event()

    async def try_port(*place: object) -> None:
        begun.append(place)
        if len(begun) == len(names):
            all_begun.set()
        await asyncio.wait_for(all_begun.wait(), PATIENCE)
        raise PeerError("timed out")

    monkeypatch.setattr(client, "try_port", try_port)
    found = looked(FakeRos(dict.fromkeys(names, "http://127.0.0.1:9/")), peers=names)
    assert {one.error for one in found.values()} == {"127.0.0.1:9: timed out"}


def test_a_node_that_accepts_and_never_answers_is_connected_to(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client, "call", _quickly(client.call))
    with peer(lambda one: one.recv(1 << 16) and time.sleep(0.5)) as port:
        found = looked(FakeRos({"/pilot": f"http://127.0.0.1:{port}/"}, {COMMAND: ["/pilot"]}))
    assert found["/pilot"].error == ""


def _quickly(call: Any) -> Any:
    async def quick(*arguments: Any, seconds: float = 0.3) -> Any:
        return await call(*arguments, seconds=seconds)

    return quick


def test_a_node_that_is_gone_or_not_registered_is_left_out() -> None:
    assert looked(FakeRos({}, {COMMAND: ["/pilot"]}), peers=["/k3/driver"]) == {}
