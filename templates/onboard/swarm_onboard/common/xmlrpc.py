"""Bounded XML-RPC calls to ROS 1 masters and nodes (wiki.ros.org/ROS/Master_API and ROS/Slave_API).

Peers may hang, flood or send nonsense: waits and replies are bounded, each failure is a ``PeerError``.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import os
import socket
import threading
import xmlrpc.client
from typing import Any, Awaitable, Sequence, TypeVar
from urllib.parse import urlsplit

T = TypeVar("T")

PIECE = 64 << 10  # bytes


class PeerError(Exception):
    """A fault of a peer, as text for people."""


class NonsenseError(PeerError):
    """The peer answers, but not as ROS does; repeating the call is useless."""


async def post(uri: str, body: bytes, names: Names, largest: int) -> bytes:
    """Returns the body of the reply to an XML-RPC document, at most ``largest`` bytes. Needs ``bounded``."""
    host, port = place_of(uri)
    head = ("POST /RPC2 HTTP/1.0", f"Host: {host}", "Content-Type: text/xml", f"Content-Length: {len(body)}")
    reader, writer = await asyncio.open_connection(await names.address_of(host), port, limit=PIECE)
    try:
        writer.write("\r\n".join((*head, "", "")).encode("ascii") + body)
        return await _reply(reader, largest)
    finally:
        writer.close()


async def bounded(seconds: float, work: Awaitable[T], late: str = "") -> T:
    """The result of ``work``. Raises ``PeerError`` if it takes longer, with the text ``late``, or fails."""
    try:
        return await within(seconds, work)
    except asyncio.TimeoutError:
        raise PeerError(late or f"no answer within {seconds:g} s") from None
    except (asyncio.IncompleteReadError, ConnectionResetError):
        raise PeerError("the connection ended early") from None
    except asyncio.LimitOverrunError:
        raise NonsenseError("the peer does not speak HTTP") from None
    except OSError as error:
        raise PeerError(os.strerror(error.errno).lower() if error.errno else str(error)) from None


async def within(seconds: float, work: Awaitable[T]) -> T:
    """The result of ``work``, or asyncio.TimeoutError. Unlike wait_for of Python before 3.12 it never goes on
    when it is cancelled, not even at the moment in which ``work`` ends (bugs.python.org/issue37658)."""
    task = asyncio.ensure_future(work)
    try:
        if not (await asyncio.wait([task], timeout=seconds))[0]:
            raise asyncio.TimeoutError
        return task.result()
    finally:
        task.cancel()


def listening() -> socket.socket:
    """Returns a socket at a free TCP port of all addresses, IPv6 included where this host has it."""
    if socket.has_dualstack_ipv6():
        return socket.create_server(("", 0), family=socket.AF_INET6, dualstack_ipv6=True)
    return socket.create_server(("", 0))


def place_of(uri: str) -> tuple[str, int]:
    """Returns host and port of a URI, ``http://host:port/``. Raises ``NonsenseError``."""
    try:
        parts = urlsplit(uri)
        host, port = parts.hostname, parts.port
    except (ValueError, AttributeError):
        host, port = None, None
    if not host or not port or not host.isascii() or not host.isprintable() or " " in host:
        raise NonsenseError(f"`{str(uri)[:80]}` is not an address")
    return host, port


class Names:
    """Looks up host names, each once at a time: with a dead name server a lookup outlives its caller."""

    def __init__(self) -> None:
        self._pending: dict[str, asyncio.Future[str]] = {}

    async def address_of(self, host: str) -> str:
        """The address of ``host`` now. Raises ``PeerError`` if there is none."""
        try:
            return str(ipaddress.ip_address(host))
        except ValueError:
            pass
        found = await asyncio.shield(self._pending.get(host) or self._look_up(host))
        if not found:
            raise PeerError(f"the name `{host}` has no address")
        return found

    def _look_up(self, host: str) -> asyncio.Future[str]:
        """The address to be, empty if there is none. A daemon thread keeps no process from ending."""
        loop = asyncio.get_running_loop()
        answer: asyncio.Future[str] = loop.create_future()

        def settle(found: str) -> None:
            del self._pending[host]
            answer.set_result(found)

        def look_up() -> None:
            try:
                found = str(socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][4][0])
            except (OSError, UnicodeError):
                found = ""
            with contextlib.suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(settle, found)

        threading.Thread(target=look_up, daemon=True).start()
        self._pending[host] = answer
        return answer


async def _reply(reader: asyncio.StreamReader, largest: int) -> bytes:
    """The body of an HTTP reply."""
    status, *lines = (await reader.readuntil(b"\r\n\r\n")).split(b"\r\n")
    if not status.startswith(b"HTTP/"):
        raise NonsenseError("the peer does not speak HTTP")
    if status.split(b" ")[1:2] != [b"200"]:
        raise NonsenseError(f"the peer is not a ROS node: {status[:60].decode('ascii', 'replace')}")
    size = length_in(lines)
    if size is None:
        raise NonsenseError("the answer has no length")
    if size > largest:
        raise NonsenseError(f"the answer is larger than {largest >> 20} MB")
    return await reader.readexactly(size)


def length_in(lines: Sequence[bytes]) -> int | None:
    """Returns the Content-Length in the lines of an HTTP header, or None."""
    for line in lines:
        name, _, value = line.partition(b":")
        value = value.strip()
        if name.strip().lower() == b"content-length" and value.isdigit():
            return int(value[:18])
    return None


def loads(document: bytes) -> tuple[tuple[Any, ...], str | None]:
    """Returns arguments and method of an XML-RPC document. Raises ``Fault`` or ``NonsenseError``."""
    # A document type can define entities, which grow without bound. UTF-16, which could hide it, has zeros.
    if b"<!" in document or b"\0" in document:
        raise NonsenseError("the answer is XML with a document type")
    try:
        return xmlrpc.client.loads(document)
    except xmlrpc.client.Fault:
        raise
    except Exception:  # noqa: BLE001  (the parser raises whatever garbage leads it to)
        raise NonsenseError("the answer is not XML-RPC") from None
