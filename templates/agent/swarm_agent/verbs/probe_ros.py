"""Asks a ROS 1 graph how it is, without joining it: nothing is registered, so nothing is left behind.

Masters and nodes speak XML-RPC (wiki.ros.org/ROS/Master_API and ROS/Slave_API), topics TCPROS (ROS/TCPROS).
Peers may hang, lie or flood: every wait has an end, every answer a size, and each failure is a ``PeerError``.
"""

from __future__ import annotations

import asyncio
import ipaddress
import os
import socket
import struct
import threading
import time
import xmlrpc.client
from typing import Any, Awaitable, Callable, Sequence, TypeVar
from urllib.parse import urlsplit

CALLER = "/swarmctl_probe"
CALL_SECONDS = 2.0
_LARGEST_REPLY = 16 << 20  # the system state of some thousand robots
_LARGEST_HEADER = 64 << 10
_LARGEST_FLOW = 32 << 20  # bytes of one topic in one measurement
_LARGEST_KEPT = 64 << 10  # of one message
_PIECE = 64 << 10
_NONSENSE = "the answer is not what a ROS node says"

T = TypeVar("T")


class PeerError(Exception):
    """What a peer did wrong, in words."""


async def call(uri: str, method: str, *arguments: Any, seconds: float = CALL_SECONDS) -> Any:
    """The value that a master or a node returns for ``method``, or a ``PeerError``."""
    return await bounded(_call(uri, method, arguments), seconds, f"no answer within {seconds:g} s")


async def bounded(work: Awaitable[T], seconds: float, otherwise: str) -> T:
    """The result of ``work``; a ``PeerError`` when it takes longer or the peer fails."""
    try:
        return await asyncio.wait_for(work, seconds)
    except asyncio.TimeoutError:
        raise PeerError(otherwise) from None
    except (asyncio.IncompleteReadError, ConnectionResetError):
        raise PeerError("the connection ended early") from None
    except asyncio.LimitOverrunError:
        raise PeerError(_NONSENSE) from None
    except OSError as error:
        raise PeerError(os.strerror(error.errno).lower() if error.errno else str(error)) from None


async def _call(uri: str, method: str, arguments: Sequence[Any]) -> Any:
    host, port = place_of(uri)
    body = xmlrpc.client.dumps((CALLER, *arguments), method).encode("utf-8")
    head = ("POST /RPC2 HTTP/1.0", f"Host: {host}", "Content-Type: text/xml", f"Content-Length: {len(body)}")
    reader, writer = await _connect(host, port)
    try:
        writer.write("\r\n".join((*head, "", "")).encode("ascii") + body)
        return _value_in(await _reply(reader))
    finally:
        writer.close()


def place_of(uri: str) -> tuple[str, int]:
    """Host and port of a node's URI, ``http://host:port/``."""
    try:
        parts = urlsplit(uri)
        host, port = parts.hostname, parts.port
    except (ValueError, AttributeError):
        host, port = None, None
    if not host or not port or not host.isascii() or not host.isprintable() or " " in host:
        raise PeerError(f"`{uri}` is no address")
    return host, port


async def _connect(host: str, port: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    return await asyncio.open_connection(await _resolved(host), port, limit=_PIECE)


async def _resolved(host: str) -> str:
    """The address of ``host``. A daemon thread asks, so a dead name server keeps no process from ending."""
    try:
        return str(ipaddress.ip_address(host))
    except ValueError:
        pass
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[str] = loop.create_future()

    def settle(act: Callable[[Any], None], value: Any) -> None:
        if not answer.done():
            act(value)

    def look() -> None:
        try:
            found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][4][0]
            result: tuple[Callable[[Any], None], Any] = (answer.set_result, found)
        except (OSError, UnicodeError):
            result = (answer.set_exception, PeerError(f"the name `{host}` has no address"))
        if not loop.is_closed():
            loop.call_soon_threadsafe(settle, *result)

    threading.Thread(target=look, daemon=True).start()
    return await answer


async def _reply(reader: asyncio.StreamReader) -> bytes:
    """The body of an HTTP reply."""
    head = await reader.readuntil(b"\r\n\r\n")
    status, *lines = head.split(b"\r\n")
    if not status.startswith(b"HTTP/"):
        raise PeerError("what answers there does not speak HTTP")
    if status.split(b" ")[1:2] != [b"200"]:
        raise PeerError(f"what answers there is no ROS node: {clipped(status, 60)}")
    for line in lines:
        name, _, value = line.partition(b":")
        value = value.strip()
        if name.strip().lower() == b"content-length" and value.isdigit():
            size = int(value[:18])
            if size > _LARGEST_REPLY:
                raise PeerError(f"the answer is larger than {_LARGEST_REPLY >> 20} MB")
            return await reader.readexactly(size)
    raise PeerError(_NONSENSE)


def _value_in(body: bytes) -> Any:
    """The third part of the ``[code, message, value]`` in an XML-RPC reply."""
    if b"<!" in body:  # a document type, hence entities, which could grow without bound
        raise PeerError(_NONSENSE)
    try:
        (triple,), _ = xmlrpc.client.loads(body)
        code, message, value = triple
    except xmlrpc.client.Fault as fault:
        raise PeerError(f"it refused: {clipped(fault.faultString)}") from None
    except Exception:  # noqa: BLE001  (the parser raises whatever garbage leads it to)
        raise PeerError(_NONSENSE) from None
    if code != 1:
        raise PeerError(clipped(message))
    return value


class Flow:
    """What came over a topic: how many messages, since when, and the first one if it was wanted."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.count = 0
        self.type = ""
        self.first_body = b""
        self._first = self._last = 0.0

    def tick(self, now: float) -> None:
        self._first = self._first if self.count else now
        self._last = now
        self.count += 1

    def rate(self, now: float) -> float | None:
        """Hz, from the intervals between messages, less once the next is overdue; None before the second."""
        intervals, seen = self.count - 1, self._last - self._first
        if intervals < 1:
            return None
        overdue = max(0.0, now - self._last - seen / intervals)
        return intervals / max(seen + overdue, 1e-3)


async def listen(uri: str, topic: str, flow: Flow, *, keep_first: bool = False) -> None:
    """Count what the node at ``uri`` publishes on ``topic`` for ``flow.seconds``."""
    protocol = await call(uri, "requestTopic", topic, [["TCPROS"]])
    try:
        name, host, port = protocol
        host, port = place_of(
            f"http://{host}:{int(port)}" if ":" not in host else f"http://[{host}]:{int(port)}"
        )
    except (TypeError, ValueError):
        raise PeerError("it does not offer this topic over TCPROS") from None
    if name != "TCPROS":
        raise PeerError("it does not offer this topic over TCPROS")
    reader, writer = await bounded(_connect(host, port), CALL_SECONDS, f"no connection to port {port}")
    try:
        writer.write(_header_of(topic))
        flow.type = await bounded(_greeted(reader), CALL_SECONDS, "no answer to the connection header")
        end = time.monotonic() + flow.seconds
        try:
            await asyncio.wait_for(_count(reader, flow, end, keep_first), flow.seconds)
        except asyncio.TimeoutError:
            pass
        except (asyncio.IncompleteReadError, OSError):
            raise PeerError("the publisher closed the connection") from None
    finally:
        writer.close()


def _header_of(topic: str) -> bytes:
    fields = (f"callerid={CALLER}", f"topic={topic}", "md5sum=*", "type=*", "tcp_nodelay=1")
    packed = b"".join(
        struct.pack("<I", len(field)) + field for field in (text.encode("utf-8") for text in fields)
    )
    return struct.pack("<I", len(packed)) + packed


async def _greeted(reader: asyncio.StreamReader) -> str:
    """The type that the publisher names in its header."""
    size = _number(await reader.readexactly(4))
    if size > _LARGEST_HEADER:
        raise PeerError("what answers there does not speak TCPROS")
    cursor = Cursor(await reader.readexactly(size))
    fields = {}
    while not cursor.at_end:
        name, _, value = cursor.text().partition("=")
        fields[name] = value
    if "error" in fields:
        raise PeerError(f"it refused: {clipped(fields['error'])}")
    return clipped(fields.get("type", ""))


async def _count(reader: asyncio.StreamReader, flow: Flow, end: float, keep_first: bool) -> None:
    taken = 0
    while time.monotonic() < end:  # a flood of tiny messages never waits, so the clock is read here too
        size = _number(await reader.readexactly(4))
        taken += 4 + size
        if taken > _LARGEST_FLOW:
            raise PeerError(f"it sends more than {_LARGEST_FLOW >> 20} MB in {flow.seconds:g} s")
        wanted = size if keep_first and not flow.count and size <= _LARGEST_KEPT else 0
        body = await reader.readexactly(wanted)
        await _skip(reader, size - wanted)
        flow.tick(time.monotonic())
        flow.first_body = flow.first_body or body


async def _skip(reader: asyncio.StreamReader, size: int) -> None:
    while size:
        piece = await reader.readexactly(min(size, _PIECE))
        size -= len(piece)


class Cursor:
    """Reads a ROS 1 serialised message from front to back; ``PeerError`` where it is cut short."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    @property
    def at_end(self) -> bool:
        return self._at >= len(self._data)

    def take(self, size: int) -> bytes:
        piece = self._data[self._at : self._at + size]
        if len(piece) < size:
            raise PeerError("a message is cut short")
        self._at += size
        return piece

    def number(self) -> int:
        return _number(self.take(4))

    def text(self) -> str:
        return self.take(self.number()).decode("utf-8", "replace")


def _number(four: bytes) -> int:
    return int.from_bytes(four, "little")


def diagnostics_in(body: bytes) -> list[dict[str, Any]]:
    """The statuses of a serialised diagnostic_msgs/DiagnosticArray, as far as anyone will read them."""
    cursor = Cursor(body)
    cursor.take(12)  # sequence number, stamp
    cursor.text()  # frame
    statuses = []
    for _ in range(cursor.number()):
        level = cursor.take(1)[0]
        name, message, hardware = (clipped(cursor.text()) for _ in range(3))
        pairs = [(clipped(cursor.text(), 40), clipped(cursor.text())) for _ in range(cursor.number())]
        statuses.append(
            {
                "level": level,
                "name": name,
                "message": message,
                "hardware": hardware,
                "values": dict(pairs[:40]),
            }
        )
    return statuses[:8]


def clipped(value: Any, longest: int = 200) -> str:
    """``value`` as text that fits into an answer."""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return text if len(text) <= longest else text[: longest - 3] + "..."
