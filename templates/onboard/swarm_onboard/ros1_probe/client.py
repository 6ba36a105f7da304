"""Reads the state of a ROS 1 graph without joining it: nothing is registered, so nothing is left behind.

Topics are TCPROS (wiki.ros.org/ROS/TCPROS). Waits and answers are bounded, each failure is a ``PeerError``.
"""

from __future__ import annotations

import asyncio
import os
import time
import xmlrpc.client
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

from swarm_onboard.agent.observations import Status
from swarm_onboard.agent.texts import clipped
from swarm_onboard.common import flow as common_flow
from swarm_onboard.common.tcpros import Cursor, number, packed, read_header
from swarm_onboard.common.xmlrpc import PIECE, Names, NonsenseError, PeerError, bounded, loads, place_of, post

if TYPE_CHECKING:
    from typing import AsyncIterator, Mapping

CALLER = f"/swarmctl_probe_{os.getpid()}"  # rospy closes the connection of a listener whose name comes again
CALL_SECONDS = 2.0
_CONNECT_SECONDS = 3.5  # Linux sends the first packet of a connection after 1 s and after 3 s again
_LARGEST_REPLY = 16 << 20  # the system state of some thousand robots
_ANY = {"md5sum": "*", "type": "*", "tcp_nodelay": "1"}
_LARGEST_HEADER = 64 << 10
_LARGEST_FLOW = 32 << 20  # bytes of one topic after which a measurement ends early, and of one message
_FOR_A_RATE = 2  # messages
_LARGEST_KEPT = 64 << 10  # of one message
_SMALL = 64  # bytes of a message that is always kept


class FailedCallError(PeerError):
    """The peer answers that it cannot: ERROR or FAILURE (wiki.ros.org/ROS/Master_Slave_APIs)."""


async def call(uri: str, method: str, *arguments: Any, seconds: float = CALL_SECONDS) -> Any:
    """The value that a master or a node returns for ``method``. Raises ``PeerError``."""
    return await call_plainly(uri, method, CALLER, *arguments, seconds=seconds)


async def call_plainly(uri: str, method: str, *arguments: Any, seconds: float = CALL_SECONDS) -> Any:
    """As ``call``, for a server whose methods take no name of the caller: roslaunch."""
    body = xmlrpc.client.dumps(arguments, method).encode("utf-8")
    return _value_in(await bounded(seconds, post(uri, body, Names(), _LARGEST_REPLY)))


def _value_in(reply: bytes) -> Any:
    """The third part of the ``[code, message, value]`` in an XML-RPC reply."""
    try:
        ((code, message, value),) = loads(reply)[0]
    except xmlrpc.client.Fault as fault:
        raise PeerError(f"it refused: {clipped(fault.faultString)}") from None
    except (TypeError, ValueError):
        raise NonsenseError("the answer is not that of a ROS node") from None
    if code != 1:
        raise FailedCallError(clipped(message))
    return value


async def system_state(uri: str) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """The publishers and the subscribers of each topic at a master. Raises ``PeerError``."""
    state = await call(uri, "getSystemState", seconds=3 * CALL_SECONDS)
    try:
        return _by_topic(state[0]), _by_topic(state[1])
    except (TypeError, ValueError, LookupError):
        raise PeerError("the master's system state makes no sense") from None


async def providers(uri: str) -> dict[str, list[str]]:
    """The nodes that provide each service at a master. Raises ``PeerError``."""
    state = await call(uri, "getSystemState", seconds=3 * CALL_SECONDS)
    try:
        return _by_topic(state[2])
    except (TypeError, ValueError, LookupError):
        raise PeerError("the master's system state makes no sense") from None


def _by_topic(pairs: Any) -> dict[str, list[str]]:
    return {str(topic): [clipped(node) for node in sorted(nodes)] for topic, nodes in pairs}


async def try_port(host: str, port: int, service: str = "") -> None:
    """Connects to a port of a node, and closes the connection. Raises ``PeerError`` if there is none.

    ``service``: one of the node, at its port for topics and services. The ``probe`` of a service, as in
    rospy's wait_for_service, neither subscribes nor calls, and is no error in the node's log.
    """
    _, writer = await bounded(_CONNECT_SECONDS, _connect(host, port), "timed out")
    if service:
        writer.write(packed({"callerid": CALLER, "service": service, "md5sum": "*", "probe": "1"}))
    writer.close()


async def _connect(host: str, port: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    return await asyncio.open_connection(await Names().address_of(host), port, limit=PIECE)


class Flow(common_flow.Flow):
    """What came over a topic, with the first message if it was wanted.

    ``first_small`` and ``last_small``: the first and the last message of up to 64 bytes.
    """

    def __init__(self, seconds: float) -> None:
        super().__init__(seconds)
        self.first_body = self.first_small = self.last_small = b""


async def listen(uri: str, topic: str, flow: Flow, *, keep_first: bool = False, caller: str = CALLER) -> None:
    """Counts the messages of the node at ``uri`` on ``topic`` for ``flow.seconds``. Raises ``PeerError``.

    Large messages end it early; ``flow.seconds`` is then the time that it took. Of two listeners of one name
    on one topic, rospy closes the connection of the first: ``caller`` sets them apart.
    """
    async with _subscription(uri, topic, caller) as (reader, header):
        flow.type = clipped(header.get("type", ""))
        began = time.monotonic()
        end = began + flow.seconds
        try:
            await asyncio.wait_for(_count(reader, flow, end, keep_first), flow.seconds)
            flow.seconds = min(flow.seconds, time.monotonic() - began)
        except asyncio.TimeoutError:
            pass
        except (asyncio.IncompleteReadError, OSError):
            raise PeerError("the publisher closed the connection") from None


async def type_of(uri: str, topic: str) -> tuple[str, str]:
    """The type of ``topic`` at its publisher at ``uri``, and the MD5 sum of it. Raises ``PeerError``."""
    async with _subscription(uri, topic, f"{CALLER}_type") as (_, header):
        return clipped(header.get("type", "")), clipped(header.get("md5sum", ""))


@asynccontextmanager
async def _subscription(
    uri: str, topic: str, caller: str
) -> AsyncIterator[tuple[asyncio.StreamReader, Mapping[str, str]]]:
    """A connection to the publisher at ``uri``, and its header. Raises ``PeerError``."""
    host, port = await offered(uri, topic)
    reader, writer = await bounded(CALL_SECONDS, _connect(host, port), f"no connection to port {port}")
    try:
        writer.write(packed({"callerid": caller, "topic": topic, **_ANY}))
        yield reader, await bounded(CALL_SECONDS, _greeted(reader), "no answer to the connection header")
    finally:
        writer.close()


async def offered(uri: str, topic: str) -> tuple[str, int]:
    """Host and port at which the node at ``uri`` publishes ``topic``. Raises ``PeerError``."""
    protocol = await call(uri, "requestTopic", topic, [["TCPROS"]])
    try:
        name, host, port = protocol
        place = place_of(f"http://{host}:{int(port)}" if ":" not in host else f"http://[{host}]:{int(port)}")
    except (TypeError, ValueError):
        raise PeerError("it does not offer this topic over TCPROS") from None
    if name != "TCPROS":
        raise PeerError("it does not offer this topic over TCPROS")
    return place


async def _greeted(reader: asyncio.StreamReader) -> Mapping[str, str]:
    """The publisher's header."""
    fields = await read_header(reader, _LARGEST_HEADER)
    if "error" in fields:
        raise PeerError(f"it refused: {clipped(fields['error'])}")
    return fields


async def _count(reader: asyncio.StreamReader, flow: Flow, end: float, keep_first: bool) -> None:
    taken = 0
    # A flood of tiny messages never waits, so the clock is read here too.
    while time.monotonic() < end and (taken <= _LARGEST_FLOW or flow.count < _FOR_A_RATE):
        size = number(await reader.readexactly(4))
        taken += 4 + size
        if size > _LARGEST_FLOW:
            raise PeerError(f"it sends a message of more than {_LARGEST_FLOW >> 20} MB")
        kept = keep_first and not flow.count and size <= _LARGEST_KEPT
        wanted = size if kept or size <= _SMALL else 0
        body = await reader.readexactly(wanted)
        await _skip(reader, size - wanted)
        if size <= _SMALL:
            flow.first_small, flow.last_small = flow.first_small or body, body
        flow.tick(time.monotonic())
        flow.first_body = flow.first_body or (body if kept else b"")


async def _skip(reader: asyncio.StreamReader, size: int) -> None:
    while size:
        piece = await reader.readexactly(min(size, PIECE))
        size -= len(piece)


def diagnostics_in(body: bytes) -> list[Status]:
    """The statuses of a serialised diagnostic_msgs/DiagnosticArray, as far as anyone will read them."""
    cursor = Cursor(body)
    cursor.take(12)  # sequence number, stamp
    cursor.text()  # frame
    statuses: list[Status] = []
    for _ in range(cursor.number()):
        level = cursor.take(1)[0]
        name, message, _ = (clipped(cursor.text()) for _ in range(3))
        pairs = [(clipped(cursor.text(), 40), clipped(cursor.text())) for _ in range(cursor.number())]
        statuses.append(Status(level, name, message, dict(pairs[:40])))
    return statuses[:8]
