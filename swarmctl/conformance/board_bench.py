"""One board that speaks rosserial on the bench: the driver's own conversation with it, every frame timed."""

from __future__ import annotations

import hashlib
import math
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

from swarm_driver.board import COMMAND
from swarm_driver.config import Config
from swarm_driver.kinematics import Odometry, Pose, within_limits
from swarm_driver.link import BytePort, LinkLostError
from swarm_driver.port import PortError
from swarm_driver.protocols import RosserialProtocol
from swarm_driver.relay import Relay
from swarm_driver.wheels import Wheels
from swarm_rosserial import frames
from swarm_rosserial.conversation import (
    GREETING,
    Conversation,
    Event,
    Lost,
    Negotiated,
    Phase,
    Received,
    UnsendableError,
)
from swarm_rosserial.messages import TWIST_MD5, TWIST_TYPE, BadMessageError, Log, twist
from swarm_rosserial.topics import MessageType

from swarmctl.conformance.wheeled import Mends, Motion, NoBoard, NotStoppedError, Pace
from swarmctl.conformance.wire import Wire
from swarmctl.spec.messages import size_of

Order = tuple[float, float]  # m/s forward, rad/s to the left
STANDSTILL: Order = (0.0, 0.0)
KEEP_UP = 0.1  # s after which an order is said again
_STANDS = 0.3  # s without a count after which a wheel stands; counts come ten times a second or so
_WARNING = 2  # of rosserial_msgs/Log
_ANY = 10.0  # times the top speed
_COUNTS = 2.0  # s in which counts come, if they do
_LAST_WORD = 0.05  # s for the last bytes to leave before the port is closed
#: A sketch's loop needs a while to reach a speed, and 20 pulses a turn a while to be measured.
PACE = Pace(settle=1.0, measure=2.0, silence=2.0, questions=10)


def type_of(name: str) -> MessageType | None:
    """A message type as far as it is known without ROS: orders, and what is one number or text."""
    if name == TWIST_TYPE:
        return MessageType(TWIST_MD5, len(twist(*STANDSTILL)))
    package, _, kind = name.partition("/")
    one = size_of(kind.lower())
    if package != "std_msgs" or one is None:
        return None
    # A definition's digest is that of its text (genmsg), and `data` is what these have.
    return MessageType(
        hashlib.md5(f"{kind.lower()} data".encode(), usedforsecurity=False).hexdigest(), one.bytes
    )


class _Topics(NoBoard):
    """For a whole driver: what types there are."""

    def type_of(self, name: str) -> MessageType | None:
        return type_of(name)


class BoardBench:
    """A ``Wheeled`` robot whose board speaks by itself. Raises ``LinkLostError`` and ``PortError``.

    ``said`` is an ``Order``. Frames are kept with the time at which they came.
    """

    reply_timeout = 0.0

    def __init__(
        self,
        config: Config,
        open_port: Callable[[], BytePort],
        *,
        pace: Pace = PACE,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        if not isinstance(config.protocol, RosserialProtocol):
            raise ValueError(f"a {config.robot} speaks no rosserial")
        self.config, self.protocol = config, config.protocol
        self.open_port, self.pace, self.clock, self.sleep = open_port, pace, clock, sleep
        self.relay: Relay = _Topics()
        self.firmware = ""
        self.complaint = ""  # what the sketch warned of last
        self.announced: Negotiated | None = None
        self.frames: list[tuple[float, int]] = []  # when, and the id of its topic
        self.arrivals: dict[str, list[float]] = defaultdict(list)
        self.misfits: dict[str, str] = {}  # topics whose messages are none of their type
        self.poses: list[tuple[float, Pose]] = []
        self.turned_at = -math.inf  # when a wheel was last seen to have turned
        self.said_at = -math.inf
        self.lost_frames = self.lost_bytes = 0  # on connections that are over
        self._said: Order | None = None
        self._odometry = Odometry()
        # A driver takes a wheel far beyond its limit for a board that was reset; here it is to be seen.
        self._any_speed = replace(config.kinematics, wheel_speed_max=_ANY * config.kinematics.wheel_speed_max)
        self._wire: Wire | None = None
        self._conversation: Conversation | None = None

    @property
    def mends(self) -> Mends:
        says = f"; the sketch says: {self.complaint}" if self.complaint else ""
        return Mends(
            still="the counters stand: do the wheels turn? is the battery on, "
            f"each encoder in, at its own wheel?{says}",
            swapped="the sides are swapped: exchange the motors' pins in `settings.firmware`, or encoders",
            wrong="a wheel turns or counts the wrong way, or counts for the other one: swap a motor's wires, "
            f"or mend the pins in `settings.firmware`{says}",
            off=lambda ratio: (
                f"{ratio:.2f} times as fast as ordered: are the wheels' radius and the pulses of a turn "
                "right? a tape measure tells"
            ),
        )

    @property
    def counts(self) -> bool:
        return self.protocol.ticks is not None

    @property
    def way(self) -> float:
        """Of a wheel for one count, m."""
        return self._wheels.scale.metres_per_count

    @property
    def wire(self) -> Wire:
        if self._wire is None:
            raise PortError(f"{self.config.port} is not open")
        return self._wire

    @property
    def conversation(self) -> Conversation:
        if self._conversation is None:
            raise PortError(f"{self.config.port} is not open")
        return self._conversation

    @property
    def moving(self) -> bool:
        """Whether a wheel turned just now."""
        return self.clock() - self.turned_at < _STANDS

    def connect(self) -> None:
        if self._conversation is not None:
            return
        self._wire = Wire(self.open_port(), self.clock)
        self._conversation = Conversation(
            self._wire.write, type_of, settle=self.config.serial.settle, clock=self.clock, wall=time.time_ns
        )
        self._wheels = Wheels(self.protocol, self._any_speed, self._odometry.forget())
        self._ear = frames.FrameReader()
        self._said = None

    def disconnect(self) -> None:
        conversation, self._conversation = self._conversation, None
        if conversation is None:
            return
        self._odometry = self._wheels.odometry
        self.lost_frames += conversation.reader.losses.frames
        self.lost_bytes += conversation.reader.losses.bytes
        self.wire.close()

    def meet(self) -> float:
        """Until it has announced its topics: the seconds that this takes from opening the line."""
        self.connect()
        began = self.clock()
        if not self.run(self.pace.patience, until=lambda: self.conversation.phase is Phase.CONNECTED):
            raise LinkLostError(f"it has not announced its topics within {self.pace.patience:g} s")
        return self.clock() - began

    def leave(self) -> None:
        """A board that was never told to drive is left alone."""
        try:
            if self.said_at > -math.inf:
                self.stop()
                self.conversation.stop()
                self.run(_LAST_WORD)
        except (LinkLostError, PortError) as error:
            raise NotStoppedError(str(error)) from error
        finally:
            with suppress(PortError):
                self.disconnect()

    def run(
        self, seconds: float, order: Order | None = None, until: Callable[[], bool] = lambda: False
    ) -> bool:
        """Live for a while, with an order kept up if there is one: whether ``until`` came true."""
        end = self.clock() + seconds
        while not until():
            now = self.clock()
            if now >= end:
                return False
            if order is not None and (order != self._said or now >= self.said_at + KEEP_UP):
                self.say(order)
            due = min(end, self.conversation.due(), math.inf if order is None else self.said_at + KEEP_UP)
            self._hear(self.wire.read(max(0.0, due - now)))
        return True

    def say(self, order: Order) -> None:
        try:
            self.conversation.send(COMMAND, twist(*order))
        except UnsendableError as error:
            raise LinkLostError(str(error)) from error
        self._said, self.said_at = order, self.clock()

    def stop(self) -> int:
        """No board confirms it: its counters do."""
        if self._conversation is None or self._conversation.phase is not Phase.CONNECTED:
            self.meet()
        self.say(STANDSTILL)
        if self.counts and not self.run(self.pace.silence, STANDSTILL, until=lambda: not self.moving):
            raise LinkLostError(f"the wheels still turn {self.pace.silence:g} s after the order to stop")
        return 1

    @contextmanager
    def driving(self, linear: float, angular: float) -> Iterator[Order]:
        order = within_limits(linear, angular, self.config.kinematics)
        try:
            self.say(order)
            yield order
        finally:
            self.stop()

    def go_on(self, said: Order, seconds: float) -> None:
        self.run(seconds, said)

    def motion(self, linear: float, angular: float) -> Motion:
        with self.driving(linear, angular) as order:
            return self.measured(order)

    def measured(self, order: Order) -> Motion:
        """The speeds that come of an order, whatever its limits."""
        self.go_on(order, self.pace.settle)
        began, before = self.next_pose(order)
        self.go_on(order, self.pace.measure)
        ended, after = self.next_pose(order)
        seconds, half = ended - began, order[1] * self.config.kinematics.wheel_separation / 2
        measured = ((after.left - before.left) / seconds, (after.right - before.right) / seconds)
        return Motion((order[0] - half, order[0] + half), measured, self.way / seconds)

    def next_pose(self, order: Order | None = None) -> tuple[float, Pose]:
        """Where the wheels are, and when."""
        known = len(self.poses)
        if not self.run(_COUNTS, order, until=lambda: len(self.poses) > known):
            raise LinkLostError(f"no counts of both wheels have come for {_COUNTS:g} s")
        return self.poses[-1]

    def speed_said(self, linear: float) -> tuple[bytes, str]:
        [topic] = [one for one in self.conversation.topics if one.name == COMMAND and not one.published]
        order = within_limits(linear, 0.0, self.config.kinematics)
        return frames.encode(topic.id, twist(*order)), f"{order[0]:g} m/s"

    def harmless(self) -> Callable[[bytes], bool]:
        head = self.speed_said(0.0)[0][:7]
        return lambda data: not data.startswith(head)

    def _hear(self, data: bytes) -> None:
        now = self.clock()
        if self.conversation.phase is not Phase.SETTLING:
            self.frames += [(now, frame.topic_id) for frame in self._ear.feed(data)]
        for event in self.conversation.step(data):
            self._take(event, now)

    def _take(self, event: Event, now: float) -> None:
        if isinstance(event, Lost):
            raise LinkLostError(f"{event.reason} (at {self.config.serial.baud} baud)")
        if isinstance(event, Negotiated):
            self.announced = event
            self._wheels.forget()
        elif isinstance(event, Log) and event.text.startswith(GREETING):
            self.firmware = event.text[len(GREETING) :].strip()
            self._wheels.forget()
        elif isinstance(event, Log) and event.level >= _WARNING:
            self.complaint = event.text
        elif isinstance(event, Received):
            self.arrivals[event.topic.name].append(now)
            try:
                pose = self._wheels.take(event.topic, event.message, now)
            except BadMessageError as error:
                self.misfits[event.topic.name] = str(error)
                return
            if pose is not None:
                self._moved(now, pose)

    def _moved(self, now: float, pose: Pose) -> None:
        before = self.poses[-1][1] if self.poses else pose
        if (before.left, before.right) != (pose.left, pose.right):
            self.turned_at = now
        self.poses.append((now, pose))
