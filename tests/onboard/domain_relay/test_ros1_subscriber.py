"""What comes from a publisher of ROS 1: nothing that it sends harms anybody else."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Awaitable, Callable, Sequence
from typing import Any

import pytest
from swarm_onboard.common import slave
from swarm_onboard.common.slave import SlaveApi
from swarm_onboard.common.tcpros import Publication, counted
from swarm_onboard.common.xmlrpc import PeerError
from swarm_onboard.domain_relay.ros1_subscriber import LARGEST_MESSAGE, Frames, Subscription
from swarm_onboard.multimaster.graph import Entry

TOPIC, KIND, MD5SUM = "/odom", "std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1"
MESSAGES = [b"", b"one", bytes(300)]


@pytest.mark.parametrize("size", [1, 3, 7, 1000])
def test_messages_are_found_wherever_a_stream_is_cut(size: int) -> None:
    stream, frames = b"".join(map(counted, MESSAGES)), Frames()
    pieces = [stream[at : at + size] for at in range(0, len(stream), size)]
    assert [message for piece in pieces for message in frames.of(piece)] == MESSAGES


def test_a_message_may_have_16_mb_and_no_more() -> None:
    body = bytes(LARGEST_MESSAGE)
    assert Frames().of(counted(body)) == [body]
    with pytest.raises(PeerError, match="a message of 16 MB is too large"):
        Frames().of(struct.pack("<I", LARGEST_MESSAGE + 1))


class Publisher:
    """A node that publishes the topic."""

    def __init__(self, name: str = "/driver", kind: str = KIND, host: str = "127.0.0.1", **more: Any) -> None:
        self.topic = Publication(name, TOPIC, kind, MD5SUM, **more)
        self._host, self._api = host, SlaveApi()

    async def start(self) -> str:
        port = await self.topic.start()
        self._api.methods = slave.methods(
            "", {}, lambda _topic: ["TCPROS", self._host, port], lambda _topic: None
        )
        return f"http://127.0.0.1:{await self._api.start()}/"


def subscribed(publisher: Publisher, until: Callable[[Subscription], bool]) -> tuple[Subscription, list[Any]]:
    """The subscription once ``until`` is true, with what it called: "open", messages, "end"."""
    calls: list[Any] = []

    def opened(latching: bool) -> tuple[Callable[[Sequence[bytes]], None], Callable[[], None]]:
        calls.append(("open", latching))
        return calls.extend, lambda: calls.append("end")

    async def run() -> Subscription:
        entry = Entry(TOPIC, "/driver", await publisher.start())
        one = Subscription("/relay", entry, {"127.0.0.1"}, KIND, MD5SUM)
        work: Awaitable[None] = asyncio.ensure_future(one.run(opened))
        while not until(one):
            await asyncio.sleep(0.01)
        work.cancel()  # type: ignore[attr-defined]
        await asyncio.wait([work])  # type: ignore[type-var]
        return one

    return asyncio.run(run()), calls


def test_a_latched_message_arrives() -> None:
    _, calls = subscribed(Publisher(first=b"map", latching=True), lambda one: one.connected)
    assert calls[0] == ("open", True)
    assert calls[-1] == "end"


@pytest.mark.parametrize(
    ("publisher", "problem", "differs"),
    [
        (Publisher(name="/imposter"), "'/imposter' answers in its place", False),
        (Publisher(host="10.9.9.9"), "it publishes at `10.9.9.9`, which is no host of its island", False),
        (Publisher(kind="std_msgs/Int32"), "its type is 'std_msgs/Int32'", True),
    ],
    ids=["another name", "another host", "another type"],
)
def test_a_publisher_that_is_not_what_it_seems_is_refused(
    publisher: Publisher, problem: str, differs: bool
) -> None:
    one, calls = subscribed(publisher, lambda one: bool(one.problem))
    assert problem in one.problem
    assert (one.differs, calls) == (differs, [])


def test_too_large_a_message_ends_the_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("swarm_onboard.domain_relay.ros1_subscriber.LARGEST_MESSAGE", 8)
    one, calls = subscribed(Publisher(first=bytes(9)), lambda one: bool(one.problem))
    assert one.problem == "a message of 0 MB is too large"
    assert calls == [("open", False), "end"]
