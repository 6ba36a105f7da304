"""A subscriber of a node without rospy that is slow holds up nobody, and gets what is of use to it."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from swarm_onboard.common.tcpros import Publication, packed, read_header

HEADER = packed({"callerid": "/test", "topic": "/topic", "md5sum": "*", "type": "*"})
IMAGE = bytes(16 << 20)


def publication(**more: Any) -> Publication:
    return Publication("/node", "/topic", "std_msgs/String", "*", **more)


@asynccontextmanager
async def subscriber(one: Publication, port: int) -> AsyncIterator[asyncio.StreamReader]:
    """A connection with small buffers, once the publisher has answered."""
    raw = socket.socket()
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
    raw.setblocking(False)
    await asyncio.get_running_loop().sock_connect(raw, ("127.0.0.1", port))
    reader, writer = await asyncio.open_connection(sock=raw, limit=1)
    writer.write(HEADER)
    await read_header(reader, 4096)
    try:
        yield reader
    finally:
        writer.close()
        one.close()


async def message(reader: asyncio.StreamReader) -> bytes:
    return await reader.readexactly(int.from_bytes(await reader.readexactly(4), "little"))


def test_a_late_subscriber_gets_the_last_latched_message() -> None:
    async def last() -> bytes:
        one = publication(latching=True)
        port = await one.start()
        one.publish(b"old")
        one.publish(b"new")
        async with subscriber(one, port) as reader:
            return await message(reader)

    assert asyncio.run(last()) == b"new"


def test_a_busy_subscriber_gets_its_image_and_misses_the_next() -> None:
    async def arrived() -> list[bytes]:
        one = publication()
        async with subscriber(one, await one.start()) as reader:
            one.publish(IMAGE)
            one.publish(b"missed")
            first = await message(reader)
            one.publish(b"next")
            return [first, await message(reader)]

    assert asyncio.run(arrived()) == [IMAGE, b"next"]


def test_a_subscriber_that_takes_nothing_is_disconnected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("swarm_onboard.common.tcpros._PATIENCE", 0.0)

    async def hangs() -> None:
        one = publication()
        async with subscriber(one, await one.start()):
            while one.has_subscribers:
                one.publish(IMAGE)
                await asyncio.sleep(0.01)

    asyncio.run(hangs())


def test_hardly_any_command_waits_for_a_subscriber_that_hangs() -> None:
    """A robot that is reached again must not drive what it was commanded before."""

    async def old_ones() -> int:
        one = publication(most_waiting=0)
        async with subscriber(one, await one.start()) as reader:
            for _ in range(5000):
                one.publish(bytes(48))
                await asyncio.sleep(0)
            count = 0
            one.publish(b"last")
            while not (await message(reader)).startswith(b"last"):
                count += 1
                one.publish(b"last")
            return count

    assert asyncio.run(old_ones()) < 500
