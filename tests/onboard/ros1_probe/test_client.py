"""The probe measures what nodes publish without joining the graph; no peer can hang, flood or break it."""

from __future__ import annotations

import asyncio
import socket
import struct
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.common.xmlrpc import PeerError
from swarm_onboard.ros1_probe import client

from tests.onboard.ros1_probe.ros_fakes import (
    FakeRos,
    diagnostics,
    header,
    peer,
    publishing,
    received_header,
    served,
    slave,
)
from tests.timing import PATIENCE, wait_for

ODOM = "nav_msgs/Odometry"


def call(uri: str, method: str = "getPid", seconds: float = 0.8) -> Any:
    return asyncio.run(client.call(uri, method, seconds=seconds))


def listened(
    behave: Callable[[socket.socket], None], seconds: float = 0.5, keep: bool = False
) -> client.Flow:
    with ExitStack() as stack:
        port = stack.enter_context(peer(behave))
        uri = stack.enter_context(served(slave({"/k3/odom": port}, {"/k3/odom": ODOM})))
        flow = client.Flow(seconds)
        asyncio.run(client.listen(uri, "/k3/odom", flow, keep_first=keep))
        return flow


def test_a_rate_is_measured() -> None:
    sent = 0

    def behave(connection: socket.socket) -> None:
        nonlocal sent
        received_header(connection)
        connection.sendall(header(type=ODOM))
        while True:
            sent += 1
            connection.sendall(struct.pack("<I", 64) + b"x" * 64)
            time.sleep(0.05)

    def measured() -> client.Flow | None:
        nonlocal sent
        sent = 0
        flow = listened(behave, seconds=1.0)
        return flow if flow.rate(time.monotonic()) else None

    flow = wait_for(measured)
    assert flow is not None
    assert flow.type == ODOM
    assert flow.count <= sent


def test_a_topic_that_stops_is_slower_than_one_that_does_not() -> None:
    flow = client.Flow(2.0)
    for moment in (0.0, 0.1, 0.2):
        flow.tick(moment)
    assert flow.rate(0.25) == pytest.approx(10.0)
    assert flow.rate(2.0) == pytest.approx(2 / 1.9)


def test_one_message_gives_no_rate() -> None:
    flow = client.Flow(2.0)
    flow.tick(0.0)
    assert flow.rate(2.0) is None


def test_the_first_message_can_be_kept() -> None:
    body = diagnostics(2, "no serial port /dev/swarm/k3")
    flow = listened(publishing("diagnostic_msgs/DiagnosticArray", 20.0, body), keep=True)
    (status,) = client.diagnostics_in(flow.first_body)
    assert status.level == 2
    assert status.message == "no serial port /dev/swarm/k3"
    assert status.values == {"port": "/dev/swarm/k3"}


@given(st.binary(max_size=200))
def test_any_bytes_are_diagnostics_or_an_error(body: bytes) -> None:
    with suppress(PeerError):
        client.diagnostics_in(body)


@given(st.integers(0, 3), st.text(max_size=150), st.text(max_size=150))
def test_diagnostics_are_read_as_they_were_written(level: int, message: str, name: str) -> None:
    (status,) = client.diagnostics_in(diagnostics(level, message, name))
    assert (status.level, status.message, status.name) == (level, message, name)


def http(
    body: bytes, status: bytes = b"200 OK", length: int | None = None
) -> Callable[[socket.socket], None]:
    size = len(body) if length is None else length

    def behave(connection: socket.socket) -> None:
        connection.recv(65536)
        connection.sendall(b"HTTP/1.0 " + status + b"\r\nContent-Length: %d\r\n\r\n" % size + body)

    return behave


def silent(connection: socket.socket) -> None:
    connection.recv(65536)
    while connection.recv(65536):
        pass


def dripping(connection: socket.socket) -> None:
    """One byte at a time: no single read ever times out."""
    connection.recv(65536)
    connection.sendall(b"HTTP/1.0 200 OK\r\nContent-Length: 100000\r\n\r\n")
    while True:
        connection.sendall(b" ")
        time.sleep(0.01)


def endless_header(connection: socket.socket) -> None:
    connection.recv(65536)
    while True:
        connection.sendall(b"HTTP/1.0 200 OK\r\nX: " + b"y" * 65536)


BOMB = (  # a valid answer, whose value grows from an entity
    b'<!DOCTYPE x [<!ENTITY a "aaaa">]><methodResponse><params><param><value><array><data>'
    b"<value><int>1</int></value><value>x</value><value>&a;&a;</value>"
    b"</data></array></value></param></params></methodResponse>"
)

LIARS = {
    "silent": (silent, "no answer within 0.8 s"),
    "dripping": (dripping, "no answer within 0.8 s"),
    "closes at once": (lambda connection: None, "the connection ended early"),
    "endless header": (endless_header, "does not speak HTTP"),
    "no HTTP": (lambda connection: connection.sendall(b"SSH-2.0-x\r\n\r\n"), "does not speak HTTP"),
    "a web server": (http(b"", b"404 Not Found"), "is not a ROS node"),
    "garbage": (http(b"\xff\x00garbage"), "document type"),
    "an entity bomb": (http(BOMB), "document type"),
    "no length": (
        lambda connection: connection.sendall(b"HTTP/1.0 200 OK\r\n\r\n"),
        "has no length",
    ),
    "promises 1 GB": (http(b"x", length=1 << 30), "larger than 16 MB"),
    "promises too many digits": (http(b"x", length=10**4000), "larger than 16 MB"),
    "sends less than promised": (http(b"<a/>", length=1000), "the connection ended early"),
}


@pytest.mark.parametrize(("behave", "complaint"), LIARS.values(), ids=LIARS.keys())
def test_a_bad_master_is_an_error_in_words_and_in_time(behave: Any, complaint: str) -> None:
    with peer(behave) as port, pytest.raises(PeerError, match=complaint):
        call(f"http://127.0.0.1:{port}")


def test_nobody_there_is_an_error_in_words() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(PeerError, match="connection refused"):
        call(f"http://127.0.0.1:{port}")


@pytest.mark.parametrize("reply", [7, "text", [1], [1, "", 2, 3], {"a": 1}, []])
def test_an_answer_that_is_no_triple_is_an_error(reply: Any) -> None:
    with served({"getPid": lambda caller: reply}) as uri, pytest.raises(PeerError):
        call(uri, seconds=2.0)


def test_a_refusal_carries_the_peers_words() -> None:
    with (
        served(FakeRos().functions()) as uri,
        pytest.raises(PeerError, match=r"unknown node \[/k3/driver\]"),
    ):
        asyncio.run(client.call(uri, "lookupNode", "/k3/driver"))


@pytest.mark.parametrize(
    "uri", ["", "http://", "http://h", "rosrpc://h:x", "http://[::1", "http://h\r\nX: y:1/"]
)
def test_a_uri_without_a_place_is_an_error(uri: str) -> None:
    with pytest.raises(PeerError, match="is not an address"):
        call(uri)


class Nothing(asyncio.StreamReader):
    """Empty messages without end, each of them there already."""

    async def readexactly(self, n: int) -> bytes:
        return bytes(n)


def flood(connection: socket.socket) -> None:
    received_header(connection)
    connection.sendall(header(type=ODOM))
    while True:
        connection.sendall(struct.pack("<I", 1 << 20) + b"x" * (1 << 20))


def one_endless_message(connection: socket.socket) -> None:
    received_header(connection)
    connection.sendall(header(type=ODOM) + b"\xff\xff\xff\xff" + b"x" * 100)
    connection.recv(1)


def test_a_flood_of_empty_messages_ends_with_the_window() -> None:
    """And not with its 32 MB, which are 8 million of them; asyncio's own limit ends only what waits."""

    async def flooded() -> client.Flow:
        flow = client.Flow(0.3)
        await client._count(Nothing(), flow, time.monotonic() + flow.seconds, keep_first=False)
        return flow

    assert asyncio.run(flooded()).count < 8_000_000


STRANGERS = {
    "an endless message": (one_endless_message, "more than 32 MB"),
    "refuses": (
        lambda c: c.sendall(header(error="md5sum does not match")),
        "it refused: md5sum does not match",
    ),
    "no TCPROS": (lambda c: c.sendall(b"HTTP/1.0 400\r\n\r\n"), "does not speak TCPROS"),
    "closes": (lambda c: None, "the connection ended early"),
    "header cut short": (lambda c: c.sendall(struct.pack("<I", 8) + b"\xff\xff\0\0type"), "cut short"),
}


@pytest.mark.parametrize(("behave", "complaint"), STRANGERS.values(), ids=STRANGERS.keys())
def test_a_bad_publisher_is_an_error_in_words(behave: Any, complaint: str) -> None:
    with pytest.raises(PeerError, match=complaint):
        listened(behave, seconds=5.0)


def test_large_messages_end_the_measurement_early() -> None:
    flow = listened(flood, seconds=PATIENCE)
    assert 32 <= flow.count <= 34
    assert flow.seconds != PATIENCE, "it has the time that it took"
    assert flow.rate(time.monotonic())


def test_a_publisher_that_sends_nothing_counts_as_zero() -> None:
    def quiet(connection: socket.socket) -> None:
        received_header(connection)
        connection.sendall(header(type=ODOM))
        connection.recv(1)

    flow = listened(quiet, seconds=0.3)
    assert flow.count == 0
    assert flow.rate(time.monotonic()) is None


@pytest.mark.parametrize(
    "offer", [["UDPROS", "h", 1], ["TCPROS"], 7, ["TCPROS", 5, 5], ["TCPROS", "h", "x"], []]
)
def test_a_node_that_offers_no_tcpros_is_an_error(offer: Any) -> None:
    with served({"requestTopic": lambda *_: [1, "", offer]}) as uri, pytest.raises(PeerError):
        asyncio.run(client.listen(uri, "/k3/odom", client.Flow(0.1)))
