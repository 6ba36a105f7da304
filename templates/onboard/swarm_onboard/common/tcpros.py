"""TCPROS (wiki.ros.org/ROS/TCPROS): connection headers, and strings and numbers as ROS 1 serialises them."""

from __future__ import annotations

import asyncio
import struct

from swarm_onboard.common.xmlrpc import PeerError


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
