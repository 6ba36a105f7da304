"""Receives a topic from one publisher of ROS 1 over TCPROS (wiki.ros.org/ROS/TCPROS)."""

from __future__ import annotations

import asyncio
import socket
import xmlrpc.client
from typing import Any, Callable, Collection, Sequence, Tuple

from swarm_onboard.common.tcpros import packed, read_header
from swarm_onboard.common.xmlrpc import Names, PeerError, bounded, loads, place_of, post
from swarm_onboard.multimaster.graph import Entry

LARGEST_MESSAGE = 16 << 20  # bytes
_LENGTH = 4  # bytes, before each message
_LARGEST_REPLY, _LARGEST_HEADER = 64 << 10, 256 << 10  # bytes; a header has the text of the definition
_AT_ONCE = 1 << 20  # bytes
_SECONDS = 3.0
_RETRY = 1.0  # s
_KEEP_ALIVE = {socket.TCP_KEEPIDLE: 5, socket.TCP_KEEPINTVL: 3, socket.TCP_KEEPCNT: 3}  # s, s, times

#: Takes messages that were read at once, oldest first.
Take = Callable[[Sequence[bytes]], None]


#: Called with whether the publisher latches, when a connection stands. Returns what ends that, too.
Opened = Callable[[bool], Tuple[Take, Callable[[], None]]]


class DifferentTypeError(PeerError):
    """The publisher has another definition of the type."""


class Frames:
    """Divides a stream of bytes into messages."""

    def __init__(self) -> None:
        self._kept = bytearray()

    def of(self, data: bytes) -> list[bytes]:
        """Returns the messages that ``data`` completes. Raises ``PeerError`` for one that is too large."""
        self._kept += data
        found, at = [], 0
        while len(self._kept) - at >= _LENGTH:
            size = int.from_bytes(self._kept[at : at + _LENGTH], "little")
            if size > LARGEST_MESSAGE:
                raise PeerError(f"a message of {size >> 20} MB is too large")
            end = at + _LENGTH + size
            if end > len(self._kept):
                break
            found.append(bytes(memoryview(self._kept)[at + _LENGTH : end]))
            at = end
        del self._kept[:at]
        return found


class Subscription:
    """A topic of one publisher, of type ``kind`` with the MD5 sum of its definition, for the node ``me``."""

    def __init__(self, me: str, entry: Entry, hosts: Collection[str], kind: str, md5sum: str) -> None:
        self.connected, self.differs, self.problem = False, False, ""
        self._me, self._entry, self._hosts = me, entry, hosts
        self._kind, self._md5sum = kind, md5sum
        self._names = Names()

    async def run(self, opened: Opened) -> None:
        """Connects again and again, until cancelled."""
        while True:
            try:
                await self._receive(opened)
            except (PeerError, EOFError, OSError, RuntimeError) as error:  # the last: of rclpy
                self.problem = str(error) or "the connection ended early"
                self.differs = isinstance(error, DifferentTypeError)
            await asyncio.sleep(_RETRY)

    async def _receive(self, opened: Opened) -> None:
        reader, writer = await bounded(_SECONDS, self._connect())
        try:
            latching = await bounded(_SECONDS, self._greeted(reader, writer))
            take, end = opened(latching)
            self.connected, self.problem, self.differs = True, "", False
            try:
                await _pass_on(reader, take)
            finally:
                self.connected = False
                end()
        finally:
            writer.close()

    async def _connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        host, port = await self._offered()
        if host.lower() not in self._hosts:
            raise PeerError(f"it publishes at `{host}`, which is no host of its island")
        address = await self._names.address_of(host)
        reader, writer = await asyncio.open_connection(address, port, limit=_AT_ONCE)
        raw = writer.get_extra_info("socket")
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for option, value in _KEEP_ALIVE.items():
            raw.setsockopt(socket.IPPROTO_TCP, option, value)
        return reader, writer

    async def _offered(self) -> tuple[str, int]:
        """Host and port at which the node publishes (wiki.ros.org/ROS/Slave_API, requestTopic)."""
        arguments: Any = (self._me, self._entry.topic, [["TCPROS"]])
        body = xmlrpc.client.dumps(arguments, "requestTopic").encode("utf-8")
        reply = await post(self._entry.uri, body, self._names, _LARGEST_REPLY)
        try:
            (((code, _, (protocol, host, port)),), _) = loads(reply)
            if code == 1 and protocol == "TCPROS":
                return place_of(f"http://{host}:{int(port)}")
        except (TypeError, ValueError, xmlrpc.client.Fault):
            pass
        raise PeerError("it does not offer this topic over TCPROS")

    async def _greeted(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bool:
        """Exchanges headers; returns whether the publisher latches."""
        entry = self._entry
        writer.write(packed({"callerid": self._me, "topic": entry.topic, "type": "*", "md5sum": "*",
                             "tcp_nodelay": "1"}))  # fmt: skip
        header = await read_header(reader, _LARGEST_HEADER)
        if "error" in header:
            raise PeerError(f"it refused: {header['error'][:80]!r}")
        if (header.get("type"), header.get("md5sum")) != (self._kind, self._md5sum):
            theirs = f"{header.get('type', '')[:80]!r}, MD5 sum {header.get('md5sum', '')[:40]!r}"
            raise DifferentTypeError(f"its type is {theirs}; here it is {self._kind}, {self._md5sum}")
        if header.get("callerid") != entry.node:
            raise PeerError(f"{header.get('callerid', '')[:80]!r} answers in its place")
        return header.get("latching") == "1"


async def _pass_on(reader: asyncio.StreamReader, take: Take) -> None:
    """Returns when the connection ends."""
    frames = Frames()
    while True:
        data = await reader.read(2 * _AT_ONCE)  # all that is there: then other connections have their turn
        if not data:
            raise PeerError("the connection ended")
        take(frames.of(data))
