"""A rosserial board under test: the driver's own conversation with it, every frame with its time."""

from __future__ import annotations

import hashlib
import math
import time
from collections import defaultdict
from collections.abc import Callable

from swarm_onboard.driver.config import Config
from swarm_onboard.driver.kinematics import Odometry, Pose, Wheels, within_limits
from swarm_onboard.driver.link import BytePort, LinkLostError
from swarm_onboard.driver.protocols import RosserialProtocol
from swarm_onboard.driver.rosserial_robot import COMMAND
from swarm_onboard.rosserial import frames
from swarm_onboard.rosserial.conversation import (
    GREETING,
    Conversation,
    Event,
    Lost,
    Negotiated,
    Phase,
    Received,
    UnsendableError,
)
from swarm_onboard.rosserial.messages import TWIST_MD5, TWIST_TYPE, BadMessageError, Log, twist
from swarm_onboard.rosserial.topics import MessageType

from swarmctl.conformance.bench import STANDSTILL, Bench, Fixes, Pace, Reading, Velocity
from swarmctl.robot_types.sketch_settings import size_of

COMMAND_REFRESH_S = 0.1  # s after which a command is repeated
_STANDS = 0.3  # s without a count after which a wheel stands; counts come about ten times a second
_WARNING = 2  # of rosserial_msgs/Log
BRAKING = 0.35  # s
_COUNTS = 2.0  # s in which counts must come
_LAST_WORD = 0.05  # s for the last bytes to be sent before the port is closed
#: A sketch's loop needs a while to reach a speed, and 20 pulses a turn a while to be measured.
PACE = Pace(settle=1.0, measure=2.0, silence=2.0, questions=10)


def type_of(name: str) -> MessageType | None:
    """A message type as far as it is known without ROS: commands, and what is one number or text."""
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


class BoardBench(Bench):
    """The bench of a robot with a rosserial board. Frames are stored with the time of their arrival."""

    def __init__(
        self,
        config: Config,
        open_port: Callable[[], BytePort] | None = None,
        *,
        pace: Pace = PACE,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Raises ``ValueError`` for a robot without a rosserial board."""
        super().__init__(config, pace, open_port, clock, sleep)
        if not isinstance(config.protocol, RosserialProtocol):
            raise ValueError(f"robot type {config.robot} does not use rosserial")
        self.protocol = config.protocol
        self.has_counters = self.protocol.ticks is not None
        self.firmware = ""
        self.warning = ""  # the latest warning of the sketch
        self.announced: Negotiated | None = None
        self.frames: list[tuple[float, int]] = []  # time, topic id
        self.arrivals: dict[str, list[float]] = defaultdict(list)
        self.bad_messages: dict[str, str] = {}  # by topic: why its messages are invalid
        self.readings: list[Reading] = []
        self.turned_at = -math.inf  # time of the latest movement of a wheel
        self.conversations: list[Conversation] = []  # one each time the port was opened
        self._commanded: Velocity | None = None
        self._wheels = Wheels(self.protocol, self.any_speed, Odometry())

    @property
    def fixes(self) -> Fixes:
        """The texts that explain failed motion checks."""
        warning = f"; warning of the sketch: {self.warning}" if self.warning else ""
        return Fixes(
            still="the counters stand: do the wheels turn? is the battery on, "
            f"each encoder in, at its own wheel?{warning}",
            swapped="the sides are swapped: swap the motors' pins in `settings.firmware`, or the encoders",
            wrong="a wheel turns or counts the wrong way, or counts for the other one: swap a motor's ports, "
            f"or fix the pins in `settings.firmware`{warning}",
            off=lambda ratio: (
                f"{ratio:.2f} times as fast as commanded: check the wheels' radius and the pulses of a turn "
                "with a tape measure"
            ),
        )

    @property
    def metres_per_count(self) -> float:
        """The distance of a wheel per count, m."""
        return self._wheels.scale.metres_per_count

    @property
    def conversation(self) -> Conversation:
        """The latest conversation with the board."""
        return self.conversations[-1]

    @property
    def moving(self) -> bool:
        """Whether a wheel turned within the last 0.3 s."""
        return self.clock() - self.turned_at < _STANDS

    def negotiate(self) -> float:
        """Waits until the board has announced its topics. Returns the seconds since the port was opened.

        Raises ``LinkLostError``.
        """
        self.connect()
        began = self.clock()
        if not self.run(self.pace.patience, until=lambda: self.conversation.phase is Phase.CONNECTED):
            raise LinkLostError(f"no topics were announced within {self.pace.patience:g} s")
        return self.clock() - began

    def run(
        self, seconds: float, velocity: Velocity | None = None, until: Callable[[], bool] = lambda: False
    ) -> bool:
        """Runs for a while, repeating the command if there is one. Returns whether ``until`` came true."""
        end = self.clock() + seconds
        while not until():
            now = self.clock()
            if now >= end:
                return False
            if velocity is not None and (
                velocity != self._commanded or now >= self.commanded_at + COMMAND_REFRESH_S
            ):
                self.command(velocity)
            due = min(
                end,
                self.conversation.due(),
                math.inf if velocity is None else self.commanded_at + COMMAND_REFRESH_S,
            )
            self._receive(self.port.read(max(0.0, due - now)))
        return True

    def command(self, velocity: Velocity) -> None:
        """Sends a velocity. Raises ``LinkLostError`` if the board does not accept it."""
        try:
            self.conversation.send(COMMAND, twist(*velocity))
        except UnsendableError as error:
            raise LinkLostError(str(error)) from error
        self._commanded, self.commanded_at = velocity, self.clock()

    def hold(self, velocity: Velocity, seconds: float) -> None:
        """Repeats the command for some seconds."""
        self.run(seconds, velocity)

    def stop(self) -> int:
        """Stops the board. Boards do not confirm a stop: their counters show it. Raises ``LinkLostError``."""
        self.negotiate()
        self.command(STANDSTILL)
        if self.has_counters and not self.run(self.pace.silence, STANDSTILL, until=lambda: not self.moving):
            raise LinkLostError(f"the wheels still turn {self.pace.silence:g} s after the stop command")
        return 1

    def position(self, velocity: Velocity | None = None) -> Reading:
        """Returns the next reading of the counters. Raises ``LinkLostError`` if none comes for 2 s."""
        known = len(self.readings)
        if not self.run(_COUNTS, velocity, until=lambda: len(self.readings) > known):
            raise LinkLostError(f"no counts of both wheels for {_COUNTS:g} s")
        return self.readings[-1]

    def still_turns(self) -> bool:
        """Waits longer than wheels need to come to rest; returns whether they turn."""
        if self.has_counters:
            self.position()
            self.run(2 * BRAKING)
        return self.moving

    def wheel_speeds(self, velocity: Velocity) -> tuple[float, float]:
        """Returns the speeds of the left and right wheel, m/s, that a command asks for."""
        linear, half = velocity[0], velocity[1] * self.config.kinematics.wheel_separation / 2
        return linear - half, linear + half

    def encoded_speed(self, linear: float) -> tuple[bytes, str]:
        """Returns the bytes of a speed command (m/s), and the speed in them as text."""
        [topic] = [one for one in self.conversation.topics if one.name == COMMAND and not one.published]
        velocity = within_limits(linear, 0.0, self.config.kinematics)
        return frames.encode(topic.id, twist(*velocity)), f"{velocity[0]:g} m/s"

    def is_harmless(self) -> Callable[[bytes], bool]:
        """Returns a predicate that is true of bytes that move no wheel."""
        head = self.encoded_speed(0.0)[0][:7]
        return lambda data: not data.startswith(head)

    def _connected(self) -> None:
        settle = self.config.serial.settle
        self.conversations.append(
            Conversation(self.port.write, type_of, settle=settle, clock=self.clock, wall=time.time_ns)
        )
        self._wheels.forget()
        self._reader = frames.FrameReader()
        self._commanded = None

    def _stop_finally(self) -> None:
        """Stops a board that was commanded to drive; nothing is sent to another one."""
        if self.commanded_at > -math.inf:
            self.stop()
            self.conversation.stop()
            self.run(_LAST_WORD)

    def _receive(self, data: bytes) -> None:
        now = self.clock()
        if self.conversation.phase is not Phase.SETTLING:
            self.frames += [(now, frame.topic_id) for frame in self._reader.feed(data)]
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
            self.warning = event.text
        elif isinstance(event, Received):
            self.arrivals[event.topic.name].append(now)
            try:
                pose = self._wheels.take(event.topic, event.message, now)
            except BadMessageError as error:
                self.bad_messages[event.topic.name] = str(error)
                return
            if pose is not None:
                self._moved(now, pose)

    def _moved(self, now: float, pose: Pose) -> None:
        before = self.readings[-1][1] if self.readings else pose
        if (before.left, before.right) != (pose.left, pose.right):
            self.turned_at = now
        self.readings.append((now, pose))
