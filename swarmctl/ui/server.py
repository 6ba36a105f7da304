"""The local server: one HTML page, and a WebSocket that sends each page what is new.

Serves only who has the token of the URL, and only at a loopback name, so that no other page can read it.
"""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import threading
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from queue import SimpleQueue
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

_BEHIND = 200  # messages that a page may be behind; it misses older ones
_CLOSES = 2.0  # s until the server has ended


class Pages:
    """The open pages, and the last status, which a new page gets at once.

    ``requests``: what pages ask for, with names, as far as it is ``allowed``.
    """

    def __init__(self, allowed: Collection[str] = ()) -> None:
        self.opened = threading.Event()  # set while a page is open
        self.requests: SimpleQueue[tuple[str, list[str]]] = SimpleQueue()
        self._allowed = allowed
        self._status: str | None = None
        self._queues: set[asyncio.Queue[str]] = set()
        self._loop: asyncio.AbstractEventLoop | None = None

    def send(self, kind: str, message: Mapping[str, Any]) -> None:
        """Sends a message to every page, from any thread."""
        text = json.dumps({"kind": kind, **message})
        if self._loop is not None:
            with suppress(RuntimeError):  # the server has ended
                self._loop.call_soon_threadsafe(self._put, kind, text)

    def _put(self, kind: str, text: str) -> None:
        if kind == "status":
            self._status = text
        for queue in self._queues:
            if queue.full():
                queue.get_nowait()
            queue.put_nowait(text)

    async def serve(self, page: WebSocket) -> None:
        """Sends messages to one page until it is closed."""
        self._loop = asyncio.get_running_loop()
        queue: asyncio.Queue[str] = asyncio.Queue(maxsize=_BEHIND)
        if self._status is not None:
            queue.put_nowait(self._status)
        self._queues.add(queue)
        self.opened.set()
        sending = asyncio.create_task(_send_all(page, queue))
        try:
            while True:
                self._take(await page.receive_text())
        except WebSocketDisconnect:
            pass
        finally:
            sending.cancel()
            self._queues.discard(queue)
            if not self._queues:
                self.opened.clear()
                self._status = None

    def _take(self, text: str) -> None:
        """Takes a request of a page; anything else is ignored."""
        with suppress(ValueError, TypeError, KeyError):
            request = json.loads(text)
            if request["action"] in self._allowed:
                self.requests.put((request["action"], [str(name) for name in request["names"]]))


async def _send_all(page: WebSocket, queue: asyncio.Queue[str]) -> None:
    with suppress(WebSocketDisconnect, RuntimeError):  # the page has closed meanwhile
        while True:
            await page.send_text(await queue.get())


@contextmanager
def serving(page: str, pages: Pages, port: int) -> Iterator[str]:
    """Serves ``page`` at ``port`` of 127.0.0.1, or at a free one if it is 0, in a thread of its own.

    Yields the URL. Raises OSError if the port is in use.
    """
    token = secrets.token_urlsafe(16)
    with socket.socket() as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(("127.0.0.1", port))
        listening.listen()
        settings = uvicorn.Config(
            _application(page, pages, token), log_level="critical", lifespan="off", ws="websockets-sansio",
            timeout_graceful_shutdown=1,
        )  # fmt: skip
        server = uvicorn.Server(settings)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        try:
            yield f"http://127.0.0.1:{listening.getsockname()[1]}/?token={token}"
        finally:
            server.should_exit = True
            thread.join(_CLOSES)


def _application(page: str, pages: Pages, token: str) -> Starlette:
    """``page`` at ``/`` and ``pages`` at ``/live``."""

    def allowed(connection: HTTPConnection) -> bool:
        return secrets.compare_digest(connection.query_params.get("token", "").encode(), token.encode())

    async def root(request: Request) -> Response:
        if not allowed(request):
            return PlainTextResponse("open the URL that `swarmctl ui` prints, with its token\n", 403)
        return HTMLResponse(page, headers={"Cache-Control": "no-store", "Referrer-Policy": "no-referrer"})

    async def live(connection: WebSocket) -> None:
        if not allowed(connection):
            await connection.close(1008)
            return
        await connection.accept()
        await pages.serve(connection)

    return Starlette(
        routes=[Route("/", root), WebSocketRoute("/live", live)],
        middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=["127.0.0.1", "localhost"])],
    )
