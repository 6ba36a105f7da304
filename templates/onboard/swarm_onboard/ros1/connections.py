"""Bounds the connections that rospy accepts, by address: a stranger's flood keeps out nobody else.

rospy has a thread for each connection, and reads the headers of topics one after the other: one that never
comes holds up all others. Once no file descriptor is left it stops listening for good.
"""

from __future__ import annotations

import ipaddress
import selectors
import socket
import time
from collections import Counter
from typing import Any

from rosgraph import network, xmlrpc
from rosgraph.xmlrpc import SilenceableXMLRPCRequestHandler, ThreadingXMLRPCServer
from rospy.impl import tcpros_base
from rospy.impl.tcpros_base import TCPServer

# Each of these has a thread: TasksMax of the units has as many, and those of the node itself. A host that
# records all topics calls once for each at the same time, and roscpp does not repeat a call that is refused.
_CALLS, _CALLS_OF_ONE = 256, 128
_TOPICS, _TOPICS_OF_ONE = 256, 128
_SECONDS = 3.0  # of silence, in which a call or a header must have come
_LARGEST_CALL = 256 << 10  # bytes, as for the static multimaster
_WAITING, _WAITING_OF_ONE = 256, 128  # for their headers
_LARGEST_HEADER = 32 << 10  # bytes; it has the definition of the message
_SIZE = 4  # bytes in front of a header
_BACKLOG = 128
_PAUSE = 0.1  # s
_any_address = network.get_bind_address


def bound() -> None:
    """Call it before joining."""
    network.get_bind_address = _bind_address
    xmlrpc.ThreadingXMLRPCServer = BoundedSlaveApi  # type: ignore[assignment, misc]
    tcpros_base.TCPServer = BoundedTopics  # type: ignore[misc]


def _bind_address(address: str | None = None) -> str:
    """The node's address, as others have it; all addresses if that is a name, or this host does not have it.

    To a firewall, connections to a node at 127.0.0.1 look like those to any other program.
    """
    own = network.get_address_override()
    try:
        if own and not network.use_ipv6() and str(ipaddress.ip_address(own)) == own:
            with socket.socket() as one:
                one.bind((own, 0))
            return str(own)
    except (ValueError, OSError):
        pass
    return str(_any_address(address))


class OpenConnections:
    """Those with a thread each: at most ``most``, and ``most_of_one`` from one address."""

    def __init__(self, most: int, most_of_one: int) -> None:
        self._most, self._most_of_one = most, most_of_one
        self._open: list[tuple[str, socket.socket]] = []

    def admit(self, address: str, connection: socket.socket) -> bool:
        """Returns False if there are too many. A closed one counts no more."""
        self._open = [one for one in self._open if one[1].fileno() != -1]
        of_one = sum(other == address for other, _ in self._open)
        if len(self._open) >= self._most or of_one >= self._most_of_one:
            return False
        self._open.append((address, connection))
        return True


class _OneCall(SilenceableXMLRPCRequestHandler):
    """A connection brings one call: those that are kept open would use up what one address may have."""

    protocol_version = "HTTP/1.0"
    timeout = _SECONDS

    def do_POST(self) -> None:  # noqa: N802  its name in Python
        size = self.headers.get("Content-Length", "")
        if size.isdigit() and int(size) <= _LARGEST_CALL:
            super().do_POST()


class BoundedSlaveApi(ThreadingXMLRPCServer):
    """The server of the slave API."""

    def __init__(self, address: tuple[str, int], log_requests: int) -> None:
        super().__init__(address, log_requests)
        self.RequestHandlerClass = _OneCall
        self._connections = OpenConnections(_CALLS, _CALLS_OF_ONE)

    def verify_request(self, request: Any, client_address: Any) -> bool:
        """Whether a thread is to serve the connection."""
        return self._connections.admit(client_address[0], request)


class BoundedTopics(TCPServer):
    """The server of topics and services: a connection gets to rospy once its header has arrived."""

    def run(self) -> None:
        """Runs until it is shut down."""
        self.server_sock.listen(_BACKLOG)
        self.server_sock.setblocking(False)
        self._connections = OpenConnections(_TOPICS, _TOPICS_OF_ONE)
        self._waiting: dict[socket.socket, tuple[tuple[str, int], float]] = {}  # oldest first
        with selectors.DefaultSelector() as self._selector:
            self._selector.register(self.server_sock, selectors.EVENT_READ)
            while not self.is_shutdown:
                for key, _ in self._selector.select(1.0):
                    if key.fileobj is self.server_sock:
                        self._accept()
                    elif key.fileobj in self._waiting:
                        self._read(key.fileobj)
                self._drop_late()

    def _accept(self) -> None:
        try:
            connection, address = self.server_sock.accept()
        except OSError:  # it is gone already, or no file descriptor is left
            time.sleep(_PAUSE)
            return
        connection.setblocking(False)
        _wake_at(connection, _SIZE)
        self._waiting[connection] = (address, time.monotonic() + _SECONDS)
        self._selector.register(connection, selectors.EVENT_READ)
        counts = Counter(host for (host, *_), _ in self._waiting.values())
        host, most = address[0], _WAITING_OF_ONE
        if len(self._waiting) > _WAITING:
            host, most = counts.most_common(1)[0][0], 0
        if counts[host] > most:
            oldest = next(one for one, ((other, *_), _) in self._waiting.items() if other == host)
            self._forget(oldest).close()

    def _read(self, connection: socket.socket) -> None:
        """Hands a connection to rospy once its header is complete; closes one that ends or sends nonsense."""
        try:
            seen = connection.recv(_SIZE + _LARGEST_HEADER, socket.MSG_PEEK)
        except OSError:
            seen = b""
        wanted = _SIZE + int.from_bytes(seen[:_SIZE], "little")
        if len(seen) < _SIZE or wanted > _SIZE + _LARGEST_HEADER:
            self._forget(connection).close()
        elif len(seen) >= wanted:
            address, _ = self._waiting[connection]
            self._forget(connection)
            _wake_at(connection, 1)
            connection.settimeout(socket.getdefaulttimeout())
            if self._connections.admit(address[0], connection):
                self.inbound_handler(connection, address)
            else:
                connection.close()
        elif not _wake_at(connection, wanted):  # it ended within its header
            self._forget(connection).close()

    def _drop_late(self) -> None:
        now = time.monotonic()
        for connection in [one for one, (_, end) in self._waiting.items() if end <= now]:
            self._forget(connection).close()

    def _forget(self, connection: socket.socket) -> socket.socket:
        self._selector.unregister(connection)
        del self._waiting[connection]
        return connection


def _wake_at(connection: socket.socket, size: int) -> bool:
    """Has the selector report the connection once it has ``size`` bytes, or ends; False if it did already."""
    before = connection.getsockopt(socket.SOL_SOCKET, socket.SO_RCVLOWAT)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVLOWAT, size)
    return size != before
