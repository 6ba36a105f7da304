"""The device's end of rosserial: negotiation, time, and when it holds itself for connected."""

from __future__ import annotations

import math
from collections.abc import Sequence

from swarmctl.lab.emulators.rosserial_frames import (
    FIRST_USER,
    PUBLISHER,
    SUBSCRIBER,
    TIME,
    TX_STOP,
    Message,
    Mishap,
    Parser,
    Topic,
    frame,
    topic_info,
)

ASKS_TIME_EVERY = 2.5  # s
LOST_AFTER = 11.0  # s without a time reply
TIME_REQUEST = frame(TIME, bytes(8))


class Device:
    """A node with ``slots`` places for subscribers and as many for publishers. Times are in s."""

    def __init__(
        self, publishers: Sequence[Topic], subscribers: Sequence[Topic], *, slots: int, buffer: int
    ) -> None:
        self._publishers = {FIRST_USER + slots + index: topic for index, topic in enumerate(publishers)}
        self._subscribers = {FIRST_USER + index: topic for index, topic in enumerate(subscribers)}
        self._buffer = buffer
        self.boot(0.0)

    def boot(self, now: float) -> None:
        """Start anew: nobody knows its topics."""
        self._parser = Parser(self._buffer)
        self._configured = False
        self._asked = self._heard = now

    def connected(self, now: float) -> bool:
        """Whether it may publish."""
        return self._configured and now - self._heard <= LOST_AFTER

    def push(self, byte: int, now: float) -> Message | Mishap | None:
        """Take a byte; the message or the mishap that it completes."""
        return self._parser.push(byte, now)

    def respond(self, event: Message | Mishap, now: float) -> list[bytes]:
        """What it sends because of a message of the protocol itself, or because of a wrong version."""
        if event is Mishap.WRONG_VERSION and not self._configured:
            return [self._ask_time(now)]
        if isinstance(event, Message):
            if event.topic == PUBLISHER:
                return self._negotiate(now)
            if event.topic == TIME:
                self._heard = now
            elif event.topic == TX_STOP:
                self._configured = False
        return []

    def _ask_time(self, now: float) -> bytes:
        self._asked = now
        return TIME_REQUEST

    def _negotiate(self, now: float) -> list[bytes]:
        """First the time is asked for, then all publishers are told, then all subscribers."""
        self._configured = True
        self._heard = now
        return [
            self._ask_time(now),
            *(topic_info(PUBLISHER, *known, self._buffer) for known in self._publishers.items()),
            *(topic_info(SUBSCRIBER, *known, self._buffer) for known in self._subscribers.items()),
        ]

    def due(self) -> float:
        """When it asks for the time again."""
        return self._asked + ASKS_TIME_EVERY if self._configured else math.inf

    def tick(self, now: float) -> list[bytes]:
        """What is due now. Once it holds itself for lost it waits to be asked for its topics."""
        if not self.connected(now):
            self._configured = False
        return [self._ask_time(now)] if self.due() <= now else []

    def topic(self, message: Message) -> str | None:
        """The name of the topic that it subscribes to and ``message`` is for."""
        topic = self._subscribers.get(message.topic)
        return topic.name if topic else None

    def publish(self, name: str, payload: bytes) -> bytes:
        number = next(number for number, topic in self._publishers.items() if topic.name == name)
        return frame(number, payload)
