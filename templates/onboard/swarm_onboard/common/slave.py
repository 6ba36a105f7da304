"""The slave API of this node (wiki.ros.org/ROS/Slave_API): masters call it on changes, people query it.

Whoever calls may hang, flood or send garbage: connections are few, short and small.
"""

from __future__ import annotations

import asyncio
import os
import sys
import xmlrpc.client
from collections import Counter
from typing import Any, Callable, Mapping
from xmlrpc.client import Fault

from swarm_onboard.common.xmlrpc import PeerError, length_in, listening, loads

_MOST_CONNECTIONS = 64
_MOST_FROM_ONE = 8
_LARGEST_REQUEST = 256 << 10  # a publisherUpdate with some thousand URIs
_SECONDS = 3.0

Method = Callable[..., Any]


class SlaveApi:
    """Answers ``methods``; each gets the caller's arguments and returns the value."""

    def __init__(self) -> None:
        self.methods: Mapping[str, Method] = {}
        self._open: Counter[str] = Counter()

    async def start(self) -> int:
        """Starts to listen; returns the port."""
        self._server = await asyncio.start_server(self._attend, sock=listening(), limit=16 << 10)
        return int(self._server.sockets[0].getsockname()[1])

    def close(self) -> None:
        """Listens no more."""
        self._server.close()

    async def _attend(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        caller = str((writer.get_extra_info("peername") or ("",))[0])
        crowded = sum(self._open.values()) >= _MOST_CONNECTIONS or self._open[caller] >= _MOST_FROM_ONE
        self._open[caller] += 1
        try:
            if not crowded:
                await asyncio.wait_for(self._serve(reader, writer), _SECONDS)
        except (OSError, EOFError, asyncio.TimeoutError, asyncio.LimitOverrunError, PeerError, Fault):
            pass  # only this connection is lost
        finally:
            self._open[caller] -= 1
            self._open += Counter()  # drops callers without connections
            writer.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await reader.readuntil(b"\r\n\r\n")
        size = length_in(head.split(b"\r\n")[1:])
        if not head.startswith(b"POST ") or size is None or size > _LARGEST_REQUEST:
            return
        arguments, method = loads(await reader.readexactly(size))
        result = self._result(str(method), arguments)
        body = xmlrpc.client.dumps((result,), methodresponse=True, allow_none=True).encode("utf-8")
        start = f"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\nContent-Length: {len(body)}\r\n\r\n"
        writer.write(start.encode("ascii") + body)
        await writer.drain()

    def _result(self, method: str, arguments: tuple[Any, ...]) -> list[Any]:
        if method not in self.methods:
            return [-1, "this node has no such method", 0]
        try:
            return [1, "", self.methods[method](*arguments)]
        except (TypeError, ValueError, RecursionError):  # the last: lists in lists in lists
            return [-1, "invalid arguments for this method", 0]


def methods(
    master: str, publications: Mapping[str, str], offer: Callable[[str], Any], wake: Callable[[str], None]
) -> dict[str, Method]:
    """The methods of a node that publishes ``publications``; ``offer`` returns a topic's address."""

    def updated(_caller: str, topic: str, _publishers: Any) -> int:
        wake(str(topic))
        return 0

    def keep_running(caller: str, reason: str = "") -> int:
        # Masters of other islands call this too: one island must not end the node of another.
        print(f"WARN: {str(caller)[:80]!r} requested shutdown ({str(reason)[:80]!r}): ignored",
              file=sys.stderr, flush=True)  # fmt: skip
        return 0

    return {
        "getPid": lambda _caller: os.getpid(),
        "getMasterUri": lambda _caller: master,
        "getBusInfo": lambda _caller: [],
        "getBusStats": lambda _caller: [[], [], []],
        "getPublications": lambda _caller: [[topic, kind] for topic, kind in publications.items()],
        "getSubscriptions": lambda _caller: [],
        "paramUpdate": lambda _caller, _key, _value: 0,
        "publisherUpdate": updated,
        "requestTopic": lambda _caller, topic, _protocols: offer(topic),
        "shutdown": keep_running,
    }
