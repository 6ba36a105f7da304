"""The host's side of a rosserial connection to one board. The caller opens the port and passes in the clock.

The board's side is rosserial's node_handle.h: it announces its topics on request, requests the time every
2.5 s, and drops the host 11 s after the last answer, or when it is reset. It announces nothing by itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any, Callable, Union

from swarm_onboard.rosserial import frames, messages
from swarm_onboard.rosserial.frames import Frame, FrameReader
from swarm_onboard.rosserial.messages import BadMessageError, Log, TopicInfo
from swarm_onboard.rosserial.topics import Refusal, Topic, Types, judge, unserved_service

GREETING = "swarmctl firmware "  # first log of a swarmctl sketch: sent at start, and after its announcements
LOST = 15.0  # s without a request for the time, as rosserial_python has it
_ASK_AGAIN = 2.0  # s between two requests for topics while none is answered
_DOUBT = 6.0  # s without a request for the time after which topics are requested again: was the board reset?
_QUIET = 0.3  # s after the last announcement until they are complete
_STALLED = 0.5  # s without a byte in the middle of a frame
_MOST_ROUNDS = 3  # of announcements, while some are lost on the line


class Phase(Enum):
    """The state of the connection to a board."""

    SETTLING = "waiting for the board to start"
    ASKING = "asking for its topics"
    CONNECTED = "connected"


@dataclass(frozen=True)
class Negotiated:
    """All topics that the board publishes and subscribes to; replaces earlier announcements."""

    topics: tuple[Topic, ...]
    refusals: tuple[Refusal, ...]


@dataclass(frozen=True)
class Received:
    """A message of the board."""

    topic: Topic
    message: bytes


@dataclass(frozen=True)
class ParameterRequest:
    """To be answered by ``Conversation.parameter``; a board waits 1 s by default."""

    name: str


@dataclass(frozen=True)
class Lost:
    """No valid communication with the board. The host keeps requesting its topics."""

    reason: str


Event = Union[Negotiated, Received, Log, ParameterRequest, Lost]


class UnsendableError(Exception):
    """A message that must not be sent to this board, and why."""


class Conversation:
    """Call ``step`` when bytes arrive, and at ``due``. ``write`` takes bytes for the board, and may raise.

    ``wall`` returns ns since 1970, the time that is sent to the board.
    """

    def __init__(
        self,
        write: Callable[[bytes], None],
        types: Types,
        *,
        settle: float,
        clock: Callable[[], float],
        wall: Callable[[], int],
    ) -> None:
        self.phase = Phase.SETTLING
        self.reader = FrameReader()
        self.strange = 0  # frames of an unknown topic, or with an invalid message
        self.synced_at: float | None = None  # the last request for the time
        self._write = write
        self._types = types
        self._clock = clock
        self._wall = wall
        self._topics: dict[tuple[bool, int], Topic] = {}
        self._refusals: list[Refusal] = []
        self._round: dict[tuple[bool, int], Topic | Refusal] = {}
        self._rounds = 0
        self._damaged_before = 0  # frames, when the topics were requested
        self._requested_at = self._announced_at = self._received_at = self._deadline = clock()
        self._settled_at = clock() + settle

    @property
    def topics(self) -> tuple[Topic, ...]:
        """The topics that the board has announced."""
        return tuple(self._topics.values())

    def due(self) -> float:
        """Returns when ``step`` must be called even if no byte arrives."""
        if self.phase is Phase.SETTLING:
            return self._settled_at
        moments = [self._ask_due(), self._deadline]
        moments += [self._announced_at + _QUIET] if self._round else []
        moments += [self._received_at + _STALLED] if self.reader.within_frame else []
        return min(moments)

    def step(self, data: bytes = b"") -> list[Event]:
        """Handles received bytes: answers them, sends requests that are due, returns the events."""
        now = self._clock()
        if self.phase is Phase.SETTLING:  # a bootloader's bytes, or the end of an earlier connection
            if now >= self._settled_at:
                self.phase, self._deadline = Phase.ASKING, now + LOST
                self._ask(now)
            return []
        arrived = self.reader.feed(data)
        if data:
            self._received_at = now
        elif self.reader.within_frame and now >= self._received_at + _STALLED:
            arrived = self.reader.give_up()
            self._received_at = now
        events = [event for frame in arrived for event in self._taken(frame, now)]
        if self._round and now >= self._announced_at + _QUIET:
            events += self._concluded(now)
        if now >= self._deadline:
            events.append(Lost(self._trouble()))
            self.phase, self._deadline = Phase.ASKING, now + LOST
        if now >= self._ask_due():
            if not self.reader.good:
                self._write(frames.OLD_REQUEST_TOPICS)
            self._ask(now)
        return events

    def send(self, name: str, message: bytes) -> None:
        """Sends ``message`` to the subscribers of topic ``name``, or raises ``UnsendableError``."""
        subscribed = [one for one in self._topics.values() if one.name == name and not one.published]
        if self.phase is not Phase.CONNECTED or not subscribed:
            raise UnsendableError(f"the board does not subscribe to `{name}`")
        for topic in subscribed:
            if len(message) > topic.capacity:  # a client library writes beyond its buffer
                raise UnsendableError(
                    f"a message on `{name}` has {len(message)} bytes; the board's buffer holds "
                    f"{topic.capacity}"
                )
            self._write(frames.encode(topic.id, message))

    def parameter(self, name: str, value: Any) -> None:
        """Answers a request for a parameter. The protocol has no answer for a missing one.

        Raises ``UnsendableError``.
        """
        try:
            answer = messages.parameter(value)
        except BadMessageError as error:
            raise UnsendableError(f"the board asks for the parameter {name}: {error}") from error
        capacity = min(
            (one.capacity for one in self._topics.values() if not one.published), default=frames.LONGEST
        )
        if len(answer) > capacity:
            raise UnsendableError(
                f"the parameter {name} has {len(answer)} bytes; the board's buffer holds {capacity}"
            )
        self._write(frames.encode(frames.ID_PARAMETER, answer))

    def stop(self) -> None:
        """Requests that the board stops sending; send nothing after this."""
        self._write(frames.TX_STOP)

    def _ask(self, now: float) -> None:
        self._write(frames.REQUEST_TOPICS)
        self._requested_at = now
        self._damaged_before = self.reader.losses.frames

    def _ask_due(self) -> float:
        if self.phase is Phase.ASKING:
            return self._requested_at + _ASK_AGAIN
        return max(self._requested_at, self._deadline - LOST) + _DOUBT

    def _taken(self, frame: Frame, now: float) -> list[Event]:
        if frame.topic_id in (frames.ID_PUBLISHER, frames.ID_SUBSCRIBER, *frames.ID_SERVICES):
            self._announced(frame, now)
            return []
        events = self._concluded(now) if self._round else []
        try:
            return [*events, *self._handled(frame, now)]
        except BadMessageError:
            self.strange += 1
            return events

    def _announced(self, frame: Frame, now: float) -> None:
        try:
            info = TopicInfo.decode(frame.message)
        except BadMessageError:
            self.strange += 1
            return
        service = frame.topic_id in frames.ID_SERVICES
        judged = unserved_service(info) if service else judge(frame.topic_id, info, self._types)
        self._round[frame.topic_id == frames.ID_PUBLISHER, info.topic_id] = judged
        self._announced_at = now

    def _concluded(self, now: float) -> list[Event]:
        """Ends a round of announcements: takes over its topics, requests another one if some may be lost."""
        judged, self._round = self._round, {}
        damaged = self.reader.losses.frames > self._damaged_before
        self._rounds = self._rounds + 1 if damaged else 0
        if damaged and self._rounds < _MOST_ROUNDS:
            self._ask(now)
        topics = {key: one for key, one in judged.items() if isinstance(one, Topic)}
        if damaged:
            topics = {**self._topics, **topics}
        refusals = [one for one in judged.values() if isinstance(one, Refusal)]
        if self.phase is Phase.CONNECTED and (topics, refusals) == (self._topics, self._refusals):
            return []
        if self.phase is not Phase.CONNECTED:
            self.phase, self._deadline = Phase.CONNECTED, now + LOST
        self._topics, self._refusals = topics, refusals
        return [Negotiated(tuple(topics.values()), tuple(refusals))]

    def _handled(self, frame: Frame, now: float) -> list[Event]:
        if frame.topic_id == frames.ID_TIME:
            self._write(frames.encode(frames.ID_TIME, messages.time(self._wall())))
            self.synced_at = now
            if self.phase is Phase.CONNECTED:
                self._deadline = now + LOST
            return []
        if frame.topic_id == frames.ID_LOG:
            log = Log.decode(frame.message)
            if log.text.startswith(GREETING) and now >= max(self._requested_at, self._announced_at) + _QUIET:
                self._ask(now)  # it has just started, and has no host yet
            return [log]
        if frame.topic_id == frames.ID_PARAMETER:
            return [ParameterRequest(messages.parameter_name(frame.message))]
        topic = self._topics.get((True, frame.topic_id))
        if topic is None:
            self.strange += 1
            if now >= self._requested_at + _ASK_AGAIN:  # its announcement was lost
                self._ask(now)
            return []
        return [Received(topic, frame.message)] if self.phase is Phase.CONNECTED else []

    def _trouble(self) -> str:
        if self.reader.old_protocol:
            return (
                "the sketch speaks rosserial 0.4 (of ROS groovy or older): "
                "build it with the library of hydro or a later one"
            )
        if self.reader.good:
            omitted = "announced topics" if self.phase is Phase.ASKING else "requested the time"
            return f"no sync with the board: it has not {omitted} for {LOST:g} s"
        if self.reader.losses.bytes:
            return "the bytes from the board are not rosserial: check the baud rate and the sketch"
        return f"the board has sent nothing for {LOST:g} s"
