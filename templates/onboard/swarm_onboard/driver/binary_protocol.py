"""Requests and replies as bytes of a known layout. Pure; a reply ends where its layout does."""

from __future__ import annotations

import re
import struct
from typing import Mapping, Sequence

from swarm_onboard.driver.codec import BadReplyError, Reply, Request
from swarm_onboard.driver.config import Actuator
from swarm_onboard.driver.line_protocol import LineBuffer
from swarm_onboard.driver.protocols import BinaryProtocol, BinaryQuery

_PLACE = re.compile(r"\{([a-z]+):([bBhHiIf])\}")
_ORDERS = {"little": "<", "big": ">"}


class BinaryCodec:
    """The codec of robots that are polled in bytes."""

    def __init__(self, protocol: BinaryProtocol) -> None:
        self._protocol = protocol
        self._order = _ORDERS[protocol.byte_order]

    def speed(self, left: int, right: int) -> Request:
        speed = self._protocol.set_speed
        begins = (left, right) if speed.echo else speed.begins
        values = {"left": (left,), "right": (right,)}
        return self._request(f"speed {left} {right}", speed, values, begins, urgent=True)

    def query(self, name: str) -> Request:
        query = self._protocol.queries[name]
        return self._request(name, query, {}, query.begins)

    def actuator(self, actuator: Actuator, index: int, values: Sequence[int]) -> Request:
        places = {"index": (index,), "value": (values[index],), "values": tuple(values)}
        return self._request(actuator.name, BinaryQuery(actuator.send, actuator.reply or ""), places)

    def setup(self) -> list[Request]:
        return [self._request(f"setup {one.send}", one, {}, one.begins) for one in self._protocol.setup]

    def identify(self) -> Request | None:
        query = self._protocol.identify
        if query is None:
            return None
        return Request(
            bytes.fromhex(query.send),
            "identify",
            lambda: TextReader(query.reply),
            framed=False,
            trails=True,
        )

    def _request(
        self,
        name: str,
        query: BinaryQuery,
        places: Mapping[str, tuple[int, ...]],
        begins: tuple[int, ...] = (),
        *,
        urgent: bool = False,
    ) -> Request:
        layout = struct.Struct(self._order + query.reply.replace(" ", ""))
        data = b"".join(self._piece(token, places) for token in query.send.split())
        return Request(
            data,
            name,
            lambda: BinaryReader(layout, begins),
            answered=layout.size > 0,
            framed=False,
            urgent=urgent,
        )

    def _piece(self, token: str, places: Mapping[str, tuple[int, ...]]) -> bytes:
        place = _PLACE.fullmatch(token)
        if place is None:
            return bytes.fromhex(token)
        values = places[place.group(1)]
        return struct.pack(f"{self._order}{len(values)}{place.group(2)}", *values)


class TextReader:
    """Waits for a line of text that begins with ``head``, among whatever else arrives."""

    def __init__(self, head: str) -> None:
        self._head = head
        self._lines = LineBuffer()
        self.noise = 0
        self.stray = ""

    def feed(self, data: bytes) -> Reply | None:
        for line in self._lines.feed(data):
            head, _, rest = line.decode("ascii", "backslashreplace").strip().partition(",")
            if head == self._head:
                return Reply((), rest)
            self.noise += 1
        return None


class BinaryReader:
    """Waits for as many bytes as a reply has. Its first numbers identify the request that it answers."""

    def __init__(self, layout: struct.Struct, begins: tuple[int, ...]) -> None:
        self._layout = layout
        self._begins = begins
        self._arrived = b""
        self.noise = 0
        self.stray = ""

    def feed(self, data: bytes) -> Reply | None:
        self._arrived += data
        if len(self._arrived) < self._layout.size:
            return None
        if len(self._arrived) > self._layout.size:
            raise BadReplyError(
                f"the robot sends {len(self._arrived)} bytes or more instead of {self._layout.size}"
            )
        values = self._layout.unpack(self._arrived)
        reported = values[: len(self._begins)]
        if reported != self._begins:
            raise BadReplyError(f"the robot reports {reported} instead of {self._begins}")
        return Reply(values)
