"""Publishes one topic over TCPROS (wiki.ros.org/ROS/TCPROS). Disconnects slow subscribers."""

from __future__ import annotations

import asyncio

from swarm_onboard.common.tcpros import counted, packed, read_header
from swarm_onboard.common.xmlrpc import PeerError, listening

_LARGEST_HEADER = 4096
_MOST_WAITING = 64 << 10  # bytes in the send buffer of a slow subscriber
_MOST_SUBSCRIBERS = 32
_SECONDS = 3.0


class Publication:
    """``name`` of type ``kind`` with the MD5 sum of its definition, published by ``node``.

    ``first`` is the message with which every new subscriber is greeted; ``served`` counts those.
    """

    def __init__(self, node: str, name: str, kind: str, md5sum: str, first: bytes | None = None) -> None:
        self.served = 0
        self._first = counted(first) if first is not None else b""
        self._name, self._md5sum = name, md5sum
        self._header = packed({"callerid": node, "md5sum": md5sum, "topic": name, "type": kind})
        self._subscribers: set[asyncio.StreamWriter] = set()

    async def start(self) -> int:
        """Starts to listen; returns the port."""
        server = await asyncio.start_server(self._attend, sock=listening(), limit=_LARGEST_HEADER)
        return int(server.sockets[0].getsockname()[1])

    def publish(self, body: bytes) -> None:
        """Sends a serialised message to all subscribers, except those that do not keep up."""
        message = counted(body)
        for writer in self._subscribers:
            if writer.transport.get_write_buffer_size() > _MOST_WAITING:
                writer.transport.abort()
            else:
                writer.write(message)

    async def _attend(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            if len(self._subscribers) < _MOST_SUBSCRIBERS:
                header = await asyncio.wait_for(read_header(reader, _LARGEST_HEADER), _SECONDS)
                await self._serve(header, reader, writer)
        except (OSError, EOFError, PeerError, asyncio.TimeoutError):
            pass  # only this connection is lost
        finally:
            self._subscribers.discard(writer)
            writer.close()

    async def _serve(
        self, header: dict[str, str], reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        if header.get("topic") != self._name or header.get("md5sum") not in (self._md5sum, "*"):
            writer.write(packed({"error": f"this is {self._name}, md5sum {self._md5sum}"}))
            return
        writer.write(self._header + self._first)
        self.served += 1
        self._subscribers.add(writer)
        while await reader.read(_LARGEST_HEADER):  # until the subscriber disconnects
            pass
