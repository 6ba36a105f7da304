"""A TCP proxy that counts what a conversation costs, and can make the way longer, fall silent or end."""

from __future__ import annotations

import queue
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

#: When it is due at the other end, the number of its round trip, and its bytes; no bytes are the end.
Piece = tuple[float, int, bytes | None]


@dataclass
class Traffic:
    """What went through: bytes, and round trips of bytes that were sent after others had come.

    ``latest``: for each way, the number of the latest round trip of which bytes have come to its end. What
    the server sends belongs to the latest that has come to it, what the client sends to the one after it.
    """

    port: int
    up: int = 0
    down: int = 0
    latest: dict[str, int] = field(default_factory=lambda: {"up": 0, "down": 0})

    @property
    def round_trips(self) -> int:
        """Those that have ended; the opening of the connection is none, as the proxy answers it at once."""
        return self.latest["down"]


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

        def read(source: socket.socket, way: str, line: queue.SimpleQueue[Piece]) -> None:
            piece, passed = b".", 0
            while piece:
                piece = b""
                with suppress(OSError):
                    piece = source.recv(1 << 16)
                trip = traffic.latest["down"] + 1 if way == "up" else traffic.latest["up"]
                setattr(traffic, way, getattr(traffic, way) + len(piece))
                rest = len(piece) if way == "up" or silent_after is None else max(0, silent_after - passed)
                passed += len(piece)
                if rest < len(piece):
                    line.put((time.monotonic(), trip, piece[:rest] or None))
                    if ends:
                        line.put((time.monotonic(), trip, b""))
                        return
                    continue
                line.put((time.monotonic() + delay, trip, piece))

        def write(sink: socket.socket, way: str, line: queue.SimpleQueue[Piece]) -> None:
            with suppress(OSError):
                while True:
                    due, trip, piece = line.get()
                    time.sleep(max(0.0, due - time.monotonic()))
                    if piece is None:
                        continue
                    if not piece:
                        sink.shutdown(socket.SHUT_WR)
                        return
                    traffic.latest[way] = max(traffic.latest[way], trip)
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
                        line: queue.SimpleQueue[Piece] = queue.SimpleQueue()
                        threading.Thread(target=read, args=(source, way, line), daemon=True).start()
                        threading.Thread(target=write, args=(sink, way, line), daemon=True).start()

        threading.Thread(target=serve, daemon=True).start()
        try:
            yield traffic
        finally:
            listener.shutdown(socket.SHUT_RDWR)
            for end in open_ones:
                with suppress(OSError):
                    end.shutdown(socket.SHUT_RDWR)
                end.close()
