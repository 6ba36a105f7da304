"""A ROS master and nodes on loopback, from the standard library: well-behaved, and as bad as one wishes."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer


class _Handler(SimpleXMLRPCRequestHandler):
    rpc_paths = ("/", "/RPC2")


class _Server(SimpleXMLRPCServer):
    allow_reuse_address = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Handler, logRequests=False, allow_none=True)
        self.uri = f"http://127.0.0.1:{self.server_address[1]}/"


@contextmanager
def served(functions: dict[str, Callable[..., Any]]) -> Iterator[str]:
    """An XML-RPC server with ``functions``; its URI."""
    server = _Server()
    for name, function in functions.items():
        server.register_function(function, name)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield server.uri
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@contextmanager
def peer(behave: Callable[[socket.socket], None]) -> Iterator[int]:
    """A TCP server that does ``behave`` with every connection, in a thread; its port."""
    listener = socket.create_server(("127.0.0.1", 0))
    threads: list[threading.Thread] = []
    open_ones: list[socket.socket] = []

    def attend(connection: socket.socket) -> None:
        with connection, suppress(OSError):
            behave(connection)

    def accept() -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return
            open_ones.append(connection)
            threads.append(threading.Thread(target=attend, args=(connection,)))
            threads[-1].start()

    acceptor = threading.Thread(target=accept)
    acceptor.start()
    try:
        yield listener.getsockname()[1]
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        acceptor.join()
        for one in open_ones:
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
        for thread in threads:
            thread.join()


def text(value: str) -> bytes:
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def header(**fields: str) -> bytes:
    packed = b"".join(text(f"{name}={value}") for name, value in fields.items())
    return struct.pack("<I", len(packed)) + packed


def diagnostics(level: int, message: str, name: str = "k3: driver") -> bytes:
    """A serialised diagnostic_msgs/DiagnosticArray with one status."""
    start = struct.pack("<III", 1, 0, 0) + text("")
    values = struct.pack("<I", 1) + text("port") + text("/dev/swarm/k3")
    return (
        start
        + struct.pack("<I", 1)
        + bytes([level])
        + text(name)
        + text(message)
        + text("Khepera k3")
        + values
    )


def received_header(connection: socket.socket) -> bytes:
    size = struct.unpack("<I", connection.recv(4, socket.MSG_WAITALL))[0]
    return connection.recv(size, socket.MSG_WAITALL)


def publishing(kind: str, rate: float, body: bytes = b"x" * 64) -> Callable[[socket.socket], None]:
    """Behave like a publisher at ``rate`` Hz."""

    def behave(connection: socket.socket) -> None:
        received_header(connection)
        connection.sendall(header(callerid="/fake", md5sum="0" * 32, type=kind))
        due = time.monotonic()
        while True:
            connection.sendall(struct.pack("<I", len(body)) + body)
            due += 1 / rate
            time.sleep(max(0.0, due - time.monotonic()))

    return behave


@dataclass
class FakeRos:
    """A master's memory: who is registered where, who publishes, subscribes and provides what."""

    nodes: dict[str, str] = field(default_factory=dict)
    publishers: dict[str, list[str]] = field(default_factory=dict)
    subscribers: dict[str, list[str]] = field(default_factory=dict)
    types: dict[str, str] = field(default_factory=dict)
    services: dict[str, list[str]] = field(default_factory=dict)
    calls: list[str] = field(default_factory=list)
    parameters: dict[str, Any] = field(default_factory=dict)

    def functions(self) -> dict[str, Callable[..., Any]]:
        def lookup(caller: str, name: str) -> list[Any]:
            uri = self.nodes.get(name)
            return [1, "", uri] if uri else [-1, f"unknown node [{name}]", ""]

        def parameter(caller: str, name: str) -> list[Any]:
            value = self.parameters.get(name, "run-1")
            return [-1, f"Parameter [{name}] is not set", 0] if value is None else [1, "", value]

        def state(caller: str) -> list[Any]:
            sides = (self.publishers, self.subscribers, self.services)
            return [1, "", [[list(pair) for pair in side.items()] for side in sides]]

        return {
            "getPid": self._noted("getPid", lambda caller: [1, "", 4711]),
            "hasParam": self._noted(
                "hasParam", lambda caller, name: [1, name, self.parameters.get(name) is not None]
            ),
            "getParam": self._noted("getParam", parameter),
            "lookupNode": self._noted("lookupNode", lookup),
            "getSystemState": self._noted("getSystemState", state),
            "getTopicTypes": self._noted(
                "getTopicTypes", lambda caller: [1, "", [list(pair) for pair in self.types.items()]]
            ),
        }

    def _noted(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def noted(*arguments: Any) -> Any:
            self.calls.append(name)
            return function(*arguments)

        return noted


def slave(
    ports: dict[str, int], kinds: dict[str, str], subscribes: dict[str, str] | None = None
) -> dict[str, Any]:
    """The slave API of a node that publishes ``kinds`` on ``ports``."""

    def request_topic(caller: str, topic: str, protocols: list[Any]) -> list[Any]:
        if topic not in ports:
            return [0, "not a publisher", 0]
        return [1, "", ["TCPROS", "127.0.0.1", ports[topic]]]

    return {
        "getPid": lambda caller: [1, "", 42],
        "getPublications": lambda caller: [1, "", [list(pair) for pair in kinds.items()]],
        "getSubscriptions": lambda caller: [1, "", [list(pair) for pair in (subscribes or {}).items()]],
        "requestTopic": request_topic,
    }
