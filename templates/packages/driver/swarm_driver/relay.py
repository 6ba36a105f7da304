"""What passes between a board's topics and ROS beside commands: bytes, as they are. Knows no ROS."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any, Callable, Protocol, Sequence

from swarm_rosserial.topics import MessageType, Topic

MOST_WAITING = 32  # messages for the board; its line is slow, and what is old is not worth sending


@dataclass(frozen=True)
class Outgoing:
    """A message of ROS for the topic ``name`` to which the board subscribes."""

    name: str
    message: bytes


@dataclass(frozen=True)
class Parameter:
    """What the board asked for."""

    name: str
    value: Any


class Relay(Protocol):
    """ROS as a board sees it; ``forward.RosRelay`` is one. No call waits for anything."""

    def type_of(self, name: str) -> MessageType | None:
        """What the host knows of a message type; nothing if it has none of that name."""

    def serve(self, topics: Sequence[Topic]) -> None:
        """Publishes and subscribes to these topics from now on, and to no others."""

    def publish(self, topic: Topic, message: bytes) -> None: ...

    def log(self, level: int, text: str) -> None: ...

    def ask(self, name: str) -> None:
        """Find a parameter; it is ``taken`` when it is there."""

    def taken(self) -> list[Outgoing | Parameter]:
        """What came for the board since the last look."""


class Mailbox:
    """Holds what comes for the board, from any thread, until the one that owns the line takes it."""

    def __init__(self, ring: Callable[[], None]) -> None:
        self._ring = ring
        self._waiting: deque[Outgoing | Parameter] = deque(maxlen=MOST_WAITING)

    def put(self, one: Outgoing | Parameter) -> None:
        self._waiting.append(one)
        self._ring()

    def taken(self) -> list[Outgoing | Parameter]:
        return [self._waiting.popleft() for _ in range(len(self._waiting))]
