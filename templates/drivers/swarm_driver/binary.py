"""Requests and replies as bytes of a known layout. Pure; a reply ends where its layout does."""

from __future__ import annotations

import math
import re
import struct

from swarm_driver.codec import BadReplyError, Reply, Request
from swarm_driver.config import Actuator, BinaryProtocol

_PLACE = re.compile(r"\{([a-z]+):([bBhHiIf])\}")
_ORDERS = {"little": "<", "big": ">"}


class BinaryCodec:
    """The codec of robots that are asked in bytes."""

    def __init__(self, protocol: BinaryProtocol) -> None:
        self._protocol = protocol
        self._order = _ORDERS[protocol.byte_order]

    def speed(self, left: int, right: int) -> Request:
        speed = self._protocol.set_speed
        echo = (left, right) if speed.echo else None
        return self._request(f"speed {left} {right}", speed.send, speed.reply, echo, left=left, right=right)

    def query(self, name: str) -> Request:
        query = self._protocol.queries[name]
        return self._request(name, query.send, query.reply)

    def actuator(self, actuator: Actuator, index: int, value: int) -> Request:
        name = f"{actuator.name} {index} {value}"
        return self._request(name, actuator.send, actuator.reply or "", index=index, value=value)

    def identify(self) -> Request | None:
        """Nothing in a stream of bytes names a firmware."""
        return None

    def _request(
        self, name: str, send: str, reply: str, echo: tuple[int, int] | None = None, **values: int
    ) -> Request:
        layout = struct.Struct(self._order + reply.replace(" ", ""))
        data = b"".join(self._piece(token, values) for token in send.split())
        return Request(data, name, lambda: BinaryReader(layout, echo), answered=layout.size > 0)

    def _piece(self, token: str, values: dict[str, int]) -> bytes:
        place = _PLACE.fullmatch(token)
        if place is None:
            return bytes.fromhex(token)
        return struct.pack(self._order + place.group(2), values[place.group(1)])


class BinaryReader:
    """Waits for as many bytes as a reply has."""

    def __init__(self, layout: struct.Struct, echo: tuple[int, int] | None) -> None:
        self._layout = layout
        self._echo = echo
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
        if self._echo is not None and values != self._echo:
            raise BadReplyError(f"the robot repeats {values} instead of {self._echo}")
        if not all(math.isfinite(value) for value in values):
            raise BadReplyError("the robot sends what is no number")
        return Reply(values)
