"""A board's side of rosserial, written from the protocol and not from our code, on a clock of the test's."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from swarm_onboard.rosserial.conversation import Conversation, Event
from swarm_onboard.rosserial.topics import MessageType

INT32, INT32_MD5 = "std_msgs/Int32", "da5909fbe378aeaf85e547e830cc1bb7"
TWIST, TWIST_MD5 = "geometry_msgs/Twist", "9f195f881246fdfa2798d1d3eebca84a"
TYPES = {INT32: MessageType(INT32_MD5, 4), TWIST: MessageType(TWIST_MD5, 48)}
REQUEST = bytes.fromhex("ff fe 00 00 ff 00 00 ff")
TIME_REQUEST = bytes.fromhex("ff fe 08 00 f7 0a 00 00 00 00 00 00 00 00 00 f5")
WALL = 1_700_000_000_500_000_000
SETTLE = 2.0


def framed(topic_id: int, message: bytes = b"") -> bytes:
    low, high = len(message) % 256, len(message) // 256
    body = bytes([topic_id % 256, topic_id // 256]) + message
    return bytes([0xFF, 0xFE, low, high, 255 - (low + high) % 256]) + body + bytes([255 - sum(body) % 256])


def text(value: str) -> bytes:
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def announcement(
    endpoint: int, topic_id: int, name: str, kind: str = INT32, *, md5: str = INT32_MD5, size: int = 280
) -> bytes:
    info = struct.pack("<H", topic_id) + text(name) + text(kind) + text(md5) + struct.pack("<i", size)
    return framed(endpoint, info)


LWHEEL = announcement(0, 125, "lwheel")
RWHEEL = announcement(0, 126, "rwheel")
CMD_VEL = announcement(1, 100, "cmd_vel", TWIST, md5=TWIST_MD5)
TOPICS = (LWHEEL, RWHEEL, CMD_VEL)


class Table:
    """A conversation with its clock and the bytes that it wrote."""

    def __init__(self, types: dict[str, MessageType] = TYPES) -> None:
        self.now = 50.0
        self.written: list[tuple[float, bytes]] = []
        self.events: list[Event] = []
        self.host = Conversation(
            lambda data: self.written.append((self.now, data)),
            types.get,
            settle=SETTLE,
            clock=lambda: self.now,
            wall=lambda: WALL,
        )

    def receive(self, *data: bytes) -> list[Event]:
        """Pass bytes from the board to the host; returns the events."""
        return self._kept(self.host.step(b"".join(data)))

    def run(self, seconds: float) -> list[Event]:
        """Let time pass, with a step whenever one is due."""
        end, events = self.now + seconds, []
        for _ in range(10_000):
            due = max(self.now, self.host.due())
            if due > end:
                self.now = end
                return events
            self.now = due
            events += self._kept(self.host.step())
        raise AssertionError("steps are due and due again")

    def sent(self) -> list[bytes]:
        """Return what was written since the last call."""
        sent, self.written = [data for _, data in self.written], []
        return sent

    def settled(self) -> Table:
        self.run(SETTLE)
        return self

    def connected(self, topics: Sequence[bytes] = TOPICS) -> Table:
        self.settled()
        self.receive(TIME_REQUEST, *topics)
        self.run(0.5)
        self.sent()
        self.events.clear()
        return self

    def _kept(self, events: list[Event]) -> list[Event]:
        self.events += events
        return events
