"""What passes between a board's topics and ROS beside commands: bytes of ROS 1. Knows no ROS."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any, Callable, Protocol, Sequence

from swarm_onboard.rosserial.topics import MessageType, Topic

MOST_WAITING = 32  # messages for the board; its line is slow, and what is old is not worth sending


@dataclass(frozen=True)
class Outgoing:
    """A message of ROS for the topic ``name`` to which the board subscribes."""

    name: str
    message: bytes


@dataclass(frozen=True)
class Parameter:
    """The value of a parameter that the board requested."""

    name: str
    value: Any


class Relay(Protocol):
    """ROS as a board sees it; ``board_relay.BoardRelay`` is one. No call blocks."""

    def type_of(self, name: str) -> MessageType | None:
        """Returns the message type of that name as this host has it; None if it has none."""

    def serve(self, topics: Sequence[Topic]) -> None:
        """Publishes and subscribes to these topics from now on, and to no others."""

    def publish(self, topic: Topic, message: bytes) -> None:
        """Publishes a message of the board."""

    def log(self, level: int, text: str) -> None:
        """Logs a text of the board; ``level`` as in rosserial_msgs/Log."""

    def ask(self, name: str) -> None:
        """Looks up a parameter; ``taken`` returns it once it is there."""

    def taken(self) -> list[Outgoing | Parameter]:
        """Returns and removes what has arrived for the board."""


class Mailbox:
    """Holds what arrives for the board, from any thread, until the thread that owns the line takes it."""

    def __init__(self, ring: Callable[[], None]) -> None:
        self._ring = ring
        self._waiting: deque[Outgoing | Parameter] = deque(maxlen=MOST_WAITING)

    def put(self, one: Outgoing | Parameter) -> None:
        """Stores a message or a parameter for the board."""
        self._waiting.append(one)
        self._ring()

    def taken(self) -> list[Outgoing | Parameter]:
        """Returns and removes everything stored."""
        return [self._waiting.popleft() for _ in range(len(self._waiting))]
