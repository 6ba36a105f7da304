"""A robot with a rosserial board, over one open port: commands, dead-man, odometry, and its other topics.

Opening the port of an Arduino resets it. The first command that its sketch then receives is a stop.
"""

from __future__ import annotations

import contextlib
import time
from collections import deque

from swarm_onboard.command.dead_man import DeadMan
from swarm_onboard.command.report import Level
from swarm_onboard.driver.config import Config
from swarm_onboard.driver.connection import UNKNOWN, ConnectionContext
from swarm_onboard.driver.kinematics import Odometry, Wheels, within_limits
from swarm_onboard.driver.link import BytePort, LinkLostError
from swarm_onboard.driver.protocols import RosserialProtocol
from swarm_onboard.driver.relay import MOST_WAITING, Outgoing, Parameter, Relay
from swarm_onboard.driver.sketch_drift import Drift
from swarm_onboard.driver.tally import Meter
from swarm_onboard.rosserial.conversation import (
    GREETING,
    Conversation,
    Event,
    Lost,
    Negotiated,
    ParameterRequest,
    Received,
    UnsendableError,
)
from swarm_onboard.rosserial.frames import OVERHEAD
from swarm_onboard.rosserial.messages import TWIST_TYPE, BadMessageError, Log, twist

COMMAND = "cmd_vel"
_STANDSTILL = (0.0, 0.0)
COMMAND_REFRESH_S = 0.2  # s after which an unchanged command is repeated
COMMAND_GAP_FACTOR = 3  # times what a command takes on the line, between two changes of it
TX_MARGIN = (
    2  # times what another message takes on the line, before the next one: a stop waits for all before it
)
_LAST_WORD = 0.05  # s for the last bytes to leave before the port is closed


class Board:
    """Serves one board until ``step`` raises ``LinkLostError`` or ``PortError``."""

    def __init__(
        self,
        port: BytePort,
        protocol: RosserialProtocol,
        relay: Relay,
        odometry: Odometry,
        around: ConnectionContext,
    ) -> None:
        config, clock = around.config, around.clock
        self.since: float | None = None
        self.trouble = ""
        self.firmware = UNKNOWN
        self._port = port
        self._config = config
        self._commands = around.commands
        self._sink = around.sink
        self._relay = relay
        self._tally = around.tally
        self._clock = clock
        self._conversation = Conversation(
            port.write, relay.type_of, settle=config.serial.settle, clock=clock, wall=time.time_ns
        )
        self._drift = Drift(protocol)
        self._wheels = Wheels(protocol, config.kinematics, odometry)
        self._meters = {name: Meter() for name in protocol.rates}
        self._wanted_rates = protocol.rates
        self._dead_man = DeadMan(around.commands, config.command_timeout, clock)
        self._refresh = min(COMMAND_REFRESH_S, protocol.firmware_timeout / 2)
        self._command_gap = COMMAND_GAP_FACTOR * self._seconds(twist(*_STANDSTILL))
        self._aim = _STANDSTILL
        self._sent_at = clock()
        self._accepts_commands = False
        self._outbox: deque[Outgoing | Parameter] = deque(maxlen=MOST_WAITING)
        self._free_at = self._sent_at
        self._frames = self._damaged = self._unsent = 0  # counted so far; not reported yet

    @property
    def odometry(self) -> Odometry:
        return self._wheels.odometry

    def listens_to(self) -> list[BytePort]:
        """Returns the port: a board sends at any time."""
        return [self._port]

    def step(self) -> float:
        """Handles what the board sent and sends what is due. Returns the moment at which more is due."""
        for event in self._conversation.step(self._port.read(0.0)):
            self._take(event)
        self._count_frames()
        if self.since is None:
            self._relay.taken()
            return self._conversation.due()
        self._send_speed()
        self._pass_on()
        post_due = self._free_at if self._outbox else float("inf")
        return min(self._conversation.due(), self._speed_due(self._wanted()), self._dead_man_due(), post_due)

    def take(self, config: Config) -> None:
        self._config = config
        self._dead_man.timeout = config.command_timeout
        self._wheels.kinematics = config.kinematics

    def stop(self) -> None:
        """Sends a stop. No board confirms it."""
        self.send_stop()
        if self.since is not None:
            self._conversation.stop()
            end = self._clock() + _LAST_WORD
            while self._clock() < end:
                self._port.read(end - self._clock())

    def send_stop(self) -> None:
        if self._accepts_commands:  # bytes of another type would write anywhere in the sketch's memory
            with contextlib.suppress(UnsendableError):
                self._conversation.send(COMMAND, twist(*_STANDSTILL))

    def close(self) -> None:
        self._port.close()

    def activity(self) -> str:
        return self._dead_man.activity(self._aim != _STANDSTILL)

    def zero_at(self) -> float | None:
        return self._sent_at if self._aim == _STANDSTILL and self.since is not None else None

    def wheel_step(self) -> float | None:
        return self._wheels.scale.metres_per_count or None

    def rates(self) -> list[tuple[str, float, float]]:
        """Name, measured and wanted rate of every topic that the sketch publishes, in Hz."""
        now = self._clock()
        return [(name, self._meters[name].rate(now), rate) for name, rate in self._wanted_rates.items()]

    def complaints(self) -> list[str]:
        damaged = self._tally.failing(self._clock(), "frames in the last minute were damaged")
        unsent, self._unsent = self._unsent, 0
        return [
            *([f"{damaged}: check the cable or radio, and what disturbs it"] if damaged else []),
            *([f"{unsent} messages did not pass ({self._tally.last_error})"] if unsent else []),
            *self._drift.complaints(self.firmware),
        ]

    def figures(self) -> dict[str, str]:
        conversation = self._conversation
        losses, synced = conversation.reader.losses, conversation.synced_at
        return {
            "last sync": "never" if synced is None else f"{self._clock() - synced:.1f} s ago",
            "damaged frames": str(losses.frames),
            "lost bytes": str(losses.bytes),
            "unknown frames": str(conversation.strange),
        }

    def _take(self, event: Event) -> None:
        if isinstance(event, Received):
            self._received(event)
        elif isinstance(event, Negotiated):
            self._negotiated(event)
        elif isinstance(event, Log):
            self._logged(event)
        elif isinstance(event, ParameterRequest):
            self._relay.ask(event.name)
        else:
            self._lost(event)

    def _count_frames(self) -> None:
        """Counts frames of a board that is connected; a board that starts also sends what is none."""
        reader = self._conversation.reader
        right, wrong = reader.good - self._frames, reader.losses.frames - self._damaged
        self._frames, self._damaged = reader.good, reader.losses.frames
        if self.since is not None and (right or wrong):
            self._tally.transfers.add(self._clock(), right, wrong)

    def _negotiated(self, event: Negotiated) -> None:
        self._drift.negotiated(event)
        subscribed = [one.type for one in event.topics if one.name == COMMAND and not one.published]
        self._accepts_commands = subscribed == [TWIST_TYPE]
        if not self._accepts_commands:
            raise LinkLostError(self._drift.why_not(COMMAND, subscribed))
        self._relay.serve([one for one in event.topics if one.name != COMMAND])
        self._wheels.forget()
        if self.since is None:
            self._tally.connections += 1
            self._sink.event(Level.OK, f"connected to {self._config.port}: {_listed(event)}")
            self._dead_man = DeadMan(self._commands, self._config.command_timeout, self._clock)
            self.since, self.trouble = self._clock(), ""
        self.send_stop()
        self._aim, self._sent_at = _STANDSTILL, self._clock()

    def _received(self, event: Received) -> None:
        now = self._clock()
        if event.topic.name in self._meters:
            self._meters[event.topic.name].tick(now)
        self._relay.publish(event.topic, event.message)
        try:
            pose = self._wheels.take(event.topic, event.message, now)
        except BadMessageError as error:
            self._failed(f"`{event.topic.name}`: {error}")
            return
        if pose is not None:
            self._sink.odometry(pose)

    def _logged(self, log: Log) -> None:
        if log.text.startswith(GREETING):
            self.firmware = log.text[len(GREETING) :].strip()
            self._wheels.forget()  # it says so when it has started
        self._relay.log(log.level, log.text)

    def _lost(self, lost: Lost) -> None:
        """Requests the topics of a silent board on the same line for a while, then on a new one."""
        if self.since is None:
            hint = "; " + self._config.serial.hint if self._config.serial.hint else ""
            raise LinkLostError(f"{lost.reason} (at {self._config.serial.baud} baud){hint}")
        self._sink.event(Level.ERROR, lost.reason)
        self._tally.last_error = self.trouble = lost.reason
        self._tally.lost(self._clock(), lost.reason)
        self.since, self.firmware = None, UNKNOWN  # another may have been written to it

    def _wanted(self) -> tuple[float, float]:
        command = self._dead_man.in_force()
        if command is None:
            return _STANDSTILL
        return within_limits(command.velocity.forward, command.velocity.turn, self._config.kinematics)

    def _speed_due(self, aim: tuple[float, float]) -> float:
        """Returns the moment at which ``aim`` must be sent; a stop at once."""
        if aim == self._aim:
            return self._sent_at + self._refresh
        return self._sent_at + (0.0 if aim == _STANDSTILL else self._command_gap)

    def _send_speed(self) -> None:
        aim, now = self._wanted(), self._clock()
        if now < self._speed_due(aim):
            return
        if aim == _STANDSTILL != self._aim and self._dead_man.expired():
            self._tally.dead_man_trips += 1
        self._conversation.send(COMMAND, twist(*aim))
        self._aim, self._sent_at = aim, now

    def _dead_man_due(self) -> float:
        return self._dead_man.due() if self._aim != _STANDSTILL else float("inf")

    def _pass_on(self) -> None:
        """Sends what ROS has for the board, no faster than the line carries it."""
        self._outbox.extend(self._relay.taken())
        while self._outbox and self._clock() >= self._free_at:
            one = self._outbox.popleft()
            try:
                if isinstance(one, Outgoing):
                    self._conversation.send(one.name, one.message)
                    self._free_at = self._clock() + TX_MARGIN * self._seconds(one.message)
                else:
                    self._conversation.parameter(one.name, one.value)
            except UnsendableError as error:
                self._failed(str(error))

    def _seconds(self, message: bytes) -> float:
        """Returns how long a message takes on the line, in s."""
        return (len(message) + OVERHEAD) * 10 / self._config.serial.baud

    def _failed(self, reason: str) -> None:
        self._unsent += 1
        self._tally.last_error = reason


def _listed(event: Negotiated) -> str:
    names = [f"{'publishes' if one.published else 'subscribes to'} {one.name}" for one in event.topics]
    return ", ".join(names)
