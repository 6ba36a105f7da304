"""A TCP proxy that counts the bytes of a conversation, and can make the way longer, fall silent or end."""

from __future__ import annotations

import queue
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass


@dataclass
class Traffic:
    """What went through."""

    port: int
    up: int = 0
    down: int = 0


@contextmanager
def proxy(
    port: int, delay: float = 0.0, *, silent_after: int | None = None, ends: bool = False
) -> Iterator[Traffic]:
    """Pass connections on to ``port`` on loopback, each byte ``delay`` seconds later in either direction.

    ``silent_after``: that many bytes come from there, nothing more; the connection stays open, or ``ends``.
    """
    with socket.create_server(("127.0.0.1", 0)) as listener:
        traffic = Traffic(listener.getsockname()[1])
        open_ones: list[socket.socket] = []

        def read(
            source: socket.socket, way: str, line: queue.SimpleQueue[tuple[float, bytes | None]]
        ) -> None:
            piece, passed = b".", 0
            while piece:
                piece = b""
                with suppress(OSError):
                    piece = source.recv(1 << 16)
                setattr(traffic, way, getattr(traffic, way) + len(piece))
                rest = len(piece) if way == "up" or silent_after is None else max(0, silent_after - passed)
                passed += len(piece)
                if rest < len(piece):
                    line.put((time.monotonic(), piece[:rest] or None))
                    if ends:
                        line.put((time.monotonic(), b""))
                        return
                    continue
                line.put((time.monotonic() + delay, piece))

        def write(sink: socket.socket, line: queue.SimpleQueue[tuple[float, bytes | None]]) -> None:
            with suppress(OSError):
                while True:
                    due, piece = line.get()
                    time.sleep(max(0.0, due - time.monotonic()))
                    if piece is None:
                        continue
                    if not piece:
                        sink.shutdown(socket.SHUT_WR)
                        return
                    sink.sendall(piece)

        def serve() -> None:
            with suppress(OSError):
                while True:
                    near, _ = listener.accept()
                    far = socket.create_connection(("127.0.0.1", port))
                    for end in (near, far):
                        end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    open_ones.extend((near, far))
                    for source, sink, way in ((near, far, "up"), (far, near, "down")):
                        line: queue.SimpleQueue[tuple[float, bytes | None]] = queue.SimpleQueue()
                        threading.Thread(target=read, args=(source, way, line), daemon=True).start()
                        threading.Thread(target=write, args=(sink, line), daemon=True).start()

        threading.Thread(target=serve, daemon=True).start()
        try:
            yield traffic
        finally:
            listener.shutdown(socket.SHUT_RDWR)
            for end in open_ones:
                with suppress(OSError):
                    end.shutdown(socket.SHUT_RDWR)
                end.close()
