"""Calls to ROS 1 masters (wiki.ros.org/ROS/Master_API), many in one request.

Masters may hang, lie or flood: every wait has an end, every answer a size, each failure is a ``PeerError``.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import os
import socket
import threading
import xmlrpc.client
from typing import Any, Awaitable, Sequence, Tuple, TypeVar
from urllib.parse import urlsplit

T = TypeVar("T")

#: Method, name of the caller, further arguments.
Call = Tuple[Any, ...]
#: Code and value that a master returned; 1 is success.
Answer = Tuple[int, Any]

LARGEST_REPLY = 2 << 20  # the state of a master that knows some ten thousand registrations
_PIECE = 64 << 10
_FAILED = 0


class PeerError(Exception):
    """What a peer did wrong, in words."""


class NonsenseError(PeerError):
    """It answers, but not as a ROS master does: no use to ask again at once."""


async def exchange(uri: str, calls: Sequence[Call], seconds: float, names: Names) -> bytes:
    """The reply to all ``calls`` as it came, within ``seconds``. Equal replies need to be read once only."""
    try:
        return await within(seconds, _exchange(uri, calls, names))
    except asyncio.TimeoutError:
        raise PeerError(f"no answer within {seconds:g} s") from None
    except (asyncio.IncompleteReadError, ConnectionResetError):
        raise PeerError("the connection ended early") from None
    except asyncio.LimitOverrunError:
        raise NonsenseError("what answers there does not speak HTTP") from None
    except OSError as error:
        raise PeerError(os.strerror(error.errno).lower() if error.errno else str(error)) from None


async def within(seconds: float, work: Awaitable[T]) -> T:
    """What ``work`` comes to, or asyncio.TimeoutError. Unlike wait_for of Python before 3.12 it never goes on
    when it is cancelled, not even at the moment in which ``work`` ends (bugs.python.org/issue37658)."""
    task = asyncio.ensure_future(work)
    try:
        if not (await asyncio.wait([task], timeout=seconds))[0]:
            raise asyncio.TimeoutError
        return task.result()
    finally:
        task.cancel()


async def _exchange(uri: str, calls: Sequence[Call], names: Names) -> bytes:
    host, port = place_of(uri)
    many = [{"methodName": method, "params": list(arguments)} for method, *arguments in calls]
    body = xmlrpc.client.dumps((many,), "system.multicall").encode("utf-8")
    head = ("POST /RPC2 HTTP/1.0", f"Host: {host}", "Content-Type: text/xml", f"Content-Length: {len(body)}")
    reader, writer = await asyncio.open_connection(await names.address_of(host), port, limit=_PIECE)
    try:
        writer.write("\r\n".join((*head, "", "")).encode("ascii") + body)
        return await _reply(reader)
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
        raise NonsenseError(f"`{str(uri)[:80]}` is no address")
    return host, port


class Names:
    """Looks up host names, each once at a time: under a dead name server a question outlives who asked it."""

    def __init__(self) -> None:
        self._asked: dict[str, asyncio.Future[str]] = {}

    async def address_of(self, host: str) -> str:
        """The address of ``host`` now."""
        try:
            return str(ipaddress.ip_address(host))
        except ValueError:
            pass
        found = await asyncio.shield(self._asked.get(host) or self._ask(host))
        if not found:
            raise PeerError(f"the name `{host}` has no address")
        return found

    def _ask(self, host: str) -> asyncio.Future[str]:
        """The address to be, empty if there is none. A daemon thread keeps no process from ending."""
        loop = asyncio.get_running_loop()
        answer: asyncio.Future[str] = loop.create_future()

        def settle(found: str) -> None:
            del self._asked[host]
            answer.set_result(found)

        def look() -> None:
            try:
                found = str(socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][4][0])
            except (OSError, UnicodeError):
                found = ""
            with contextlib.suppress(RuntimeError):  # the loop has ended, and nobody waits any more
                loop.call_soon_threadsafe(settle, found)

        threading.Thread(target=look, daemon=True).start()
        self._asked[host] = answer
        return answer


async def _reply(reader: asyncio.StreamReader) -> bytes:
    """The body of an HTTP reply."""
    status, *lines = (await reader.readuntil(b"\r\n\r\n")).split(b"\r\n")
    if not status.startswith(b"HTTP/"):
        raise NonsenseError("what answers there does not speak HTTP")
    if status.split(b" ")[1:2] != [b"200"]:
        raise NonsenseError("what answers there is no ROS master")
    size = length_in(lines)
    if size is None or size > LARGEST_REPLY:
        raise NonsenseError(f"the answer has no size, or more than {LARGEST_REPLY >> 20} MB")
    return await reader.readexactly(size)


def length_in(lines: Sequence[bytes]) -> int | None:
    """The Content-Length that an HTTP header tells."""
    for line in lines:
        name, _, value = line.partition(b":")
        value = value.strip()
        if name.strip().lower() == b"content-length" and value.isdigit():
            return int(value[:18])
    return None


async def answers(reply: bytes, count: int) -> list[Answer]:
    """What the master said to each of ``count`` calls. A large reply is read beside the other work."""
    if len(reply) <= _PIECE:
        return _answers(reply, count)
    return await asyncio.get_running_loop().run_in_executor(None, _answers, reply, count)


def _answers(reply: bytes, count: int) -> list[Answer]:
    try:
        (several,), _ = loads(reply)
    except xmlrpc.client.Fault as fault:
        raise NonsenseError(f"it refused: {str(fault.faultString)[:80]}") from None
    if not isinstance(several, list) or len(several) != count:
        raise NonsenseError("the answer is not what a ROS master says")
    return [_answer(one) for one in several]


def _answer(one: Any) -> Answer:
    """Of ``[[code, message, value]]``; a fault, and whatever else stands there, is a failure."""
    try:
        ((code, message, value),) = one
    except (TypeError, ValueError):
        return _FAILED, "no answer"
    return (1, value) if code == 1 else (_FAILED if not isinstance(code, int) else code, message)


def loads(document: bytes) -> tuple[tuple[Any, ...], str | None]:
    """Arguments and method of an XML-RPC document; Fault where it is one."""
    # A document type can define entities, which grow without bound. UTF-16, which could hide it, has zeros.
    if b"<!" in document or b"\0" in document:
        raise NonsenseError("XML with a document type")
    try:
        return xmlrpc.client.loads(document)
    except xmlrpc.client.Fault:
        raise
    except Exception:  # noqa: BLE001  (the parser raises whatever garbage leads it to)
        raise NonsenseError("no XML-RPC") from None
