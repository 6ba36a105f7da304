"""The device side of rosserial: negotiation, time requests, and its idea of being connected."""

from __future__ import annotations

import math
from collections.abc import Sequence

from swarmctl.lab.emulators.rosserial_frames import (
    FIRST_USER,
    PUBLISHER,
    SUBSCRIBER,
    TIME,
    TX_STOP,
    FrameError,
    Message,
    Parser,
    Topic,
    frame,
    topic_info,
)

TIME_REQUEST_PERIOD = 2.5  # s
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
        """Resets the connection; its topics are not negotiated."""
        self._parser = Parser(self._buffer)
        self._configured = False
        self._requested_at = self._time_reply_at = now

    def connected(self, now: float) -> bool:
        """Whether it may publish."""
        return self._configured and now - self._time_reply_at <= LOST_AFTER

    def push(self, byte: int, now: float) -> Message | FrameError | None:
        """Takes a byte; returns the message or error that it completes."""
        return self._parser.push(byte, now)

    def respond(self, event: Message | FrameError, now: float) -> list[bytes]:
        """Returns what it sends after a protocol message or a wrong version."""
        if event is FrameError.WRONG_VERSION and not self._configured:
            return [self._request_time(now)]
        if isinstance(event, Message):
            if event.topic == PUBLISHER:
                return self._negotiate(now)
            if event.topic == TIME:
                self._time_reply_at = now
            elif event.topic == TX_STOP:
                self._configured = False
        return []

    def _request_time(self, now: float) -> bytes:
        self._requested_at = now
        return TIME_REQUEST

    def _negotiate(self, now: float) -> list[bytes]:
        """Requests the time, then announces all publishers, then all subscribers."""
        self._configured = True
        self._time_reply_at = now
        return [
            self._request_time(now),
            *(topic_info(PUBLISHER, *known, self._buffer) for known in self._publishers.items()),
            *(topic_info(SUBSCRIBER, *known, self._buffer) for known in self._subscribers.items()),
        ]

    def due(self) -> float:
        """Returns when the next time request is due."""
        return self._requested_at + TIME_REQUEST_PERIOD if self._configured else math.inf

    def tick(self, now: float) -> list[bytes]:
        """Returns what is due. Without time replies it disconnects and waits for a topic request."""
        if not self.connected(now):
            self._configured = False
        return [self._request_time(now)] if self.due() <= now else []

    def topic(self, message: Message) -> str | None:
        """Returns the subscribed topic of ``message``."""
        topic = self._subscribers.get(message.topic)
        return topic.name if topic else None

    def publish(self, name: str, payload: bytes) -> bytes:
        """Returns the frame of a message on the topic ``name``."""
        number = next(number for number, topic in self._publishers.items() if topic.name == name)
        return frame(number, payload)
