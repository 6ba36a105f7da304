"""TCPROS (wiki.ros.org/ROS/TCPROS): connection headers, and strings and numbers as ROS 1 serialises them."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct

from swarm_onboard.common.xmlrpc import PeerError, listening


def counted(data: bytes) -> bytes:
    """Returns a string with its length before it."""
    return struct.pack("<I", len(data)) + data


def packed(fields: dict[str, str]) -> bytes:
    """Returns a connection header."""
    return counted(b"".join(counted(f"{name}={value}".encode()) for name, value in fields.items()))


async def read_header(reader: asyncio.StreamReader, largest: int) -> dict[str, str]:
    """Returns the fields of the peer's connection header. Raises ``PeerError``."""
    size = number(await reader.readexactly(4))
    if size > largest:
        raise PeerError("what answers there does not speak TCPROS")
    cursor = Cursor(await reader.readexactly(size))
    fields = {}
    while not cursor.at_end:
        name, _, value = cursor.text().partition("=")
        fields[name] = value
    return fields


class Cursor:
    """Reads a serialised message from front to back; ``PeerError`` where it is cut short."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    @property
    def at_end(self) -> bool:
        """True if all bytes are read."""
        return self._at >= len(self._data)

    def take(self, size: int) -> bytes:
        """Returns the next ``size`` bytes. Raises ``PeerError`` if there are fewer."""
        piece = self._data[self._at : self._at + size]
        if len(piece) < size:
            raise PeerError("a message is cut short")
        self._at += size
        return piece

    def number(self) -> int:
        """Returns the next unsigned 32-bit number. Raises ``PeerError``."""
        return number(self.take(4))

    def text(self) -> str:
        """Returns the next string. Raises ``PeerError``."""
        return self.take(self.number()).decode("utf-8", "replace")


def number(four: bytes) -> int:
    """Returns four bytes as an unsigned number, lowest byte first."""
    return int.from_bytes(four, "little")


MOST_WAITING = 64 << 10  # bytes in the send buffer of a subscriber that gets a further message
_LARGEST_HEADER = 4096
_MOST_SUBSCRIBERS = 32
_SECONDS = 3.0
_PATIENCE = 5.0  # s in which a slow subscriber has to take something
_SMALLEST_BUFFER = 1  # of the kernel, which has a minimum of some messages


class Publication:
    """``name`` of type ``kind`` with the MD5 sum of its definition, published by ``node``.

    ``first`` is the message with which every new subscriber is greeted, ``served`` counts those;
    ``latching``: it is the last message that was published. ``most_waiting``: bytes; with 0, for commands,
    hardly any waits for the network.
    """

    def __init__(
        self, node: str, name: str, kind: str, md5sum: str, first: bytes | None = None,
        *, latching: bool = False, most_waiting: int = MOST_WAITING,
    ) -> None:  # fmt: skip
        self.served = 0
        self._first = counted(first) if first is not None else b""
        self._name, self._md5sum = name, md5sum
        self._latching, self._most_waiting = latching, most_waiting
        fields = {"callerid": node, "md5sum": md5sum, "topic": name, "type": kind}
        self._header = packed({**fields, "latching": "1"} if latching else fields)
        #: With the bytes that waited when it last took some, and when that was.
        self._subscribers: dict[asyncio.StreamWriter, tuple[int, float]] = {}

    async def start(self) -> int:
        """Starts to listen; returns the port."""
        self._server = await asyncio.start_server(self._attend, sock=listening(), limit=_LARGEST_HEADER)
        return int(self._server.sockets[0].getsockname()[1])

    def close(self) -> None:
        """Ends it, and the connections of all subscribers."""
        self._server.close()
        for writer in self._subscribers:
            writer.transport.abort()

    @property
    def has_subscribers(self) -> bool:
        """Whether anybody is connected."""
        return bool(self._subscribers)

    def publish(self, body: bytes) -> None:
        """Sends a serialised message to all subscribers, except those that do not keep up.

        They miss it. One that takes nothing for some seconds is disconnected, and so is one that would miss
        what is latched: when it connects again it gets the last message.
        """
        message = counted(body)
        if self._latching:
            self._first = message
        now = asyncio.get_running_loop().time()
        for writer, (before, since) in list(self._subscribers.items()):
            waiting = writer.transport.get_write_buffer_size()
            if waiting <= self._most_waiting:
                writer.write(message)
                self._subscribers[writer] = writer.transport.get_write_buffer_size(), now
            elif self._latching or (waiting >= before and now - since > _PATIENCE):
                writer.transport.abort()
            elif waiting < before:
                self._subscribers[writer] = waiting, now

    async def _attend(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            if len(self._subscribers) < _MOST_SUBSCRIBERS:
                header = await asyncio.wait_for(read_header(reader, _LARGEST_HEADER), _SECONDS)
                await self._serve(header, reader, writer)
        except (OSError, EOFError, PeerError, asyncio.TimeoutError):
            pass  # only this connection is lost
        finally:
            self._subscribers.pop(writer, None)
            writer.close()

    async def _serve(
        self, header: dict[str, str], reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        if header.get("topic") != self._name or header.get("md5sum") not in (self._md5sum, "*"):
            writer.write(packed({"error": f"this is {self._name}, md5sum {self._md5sum}"}))
            return
        if not self._most_waiting:
            with contextlib.suppress(OSError):
                writer.get_extra_info("socket").setsockopt(
                    socket.SOL_SOCKET, socket.SO_SNDBUF, _SMALLEST_BUFFER
                )
        writer.write(self._header + self._first)
        self.served += 1
        self._subscribers[writer] = 0, asyncio.get_running_loop().time()
        while await reader.read(_LARGEST_HEADER):  # until the subscriber disconnects
            pass
