"""A simulated board and our host's side of rosserial, on the board's own time."""

from __future__ import annotations

import math
import struct
from itertools import pairwise

from swarm_onboard.rosserial.conversation import Conversation, Event, Phase, Received
from swarm_onboard.rosserial.messages import Log
from swarm_onboard.rosserial.topics import MessageType

from swarmctl.lab.emulators.arduino_rover import SimulatedBoard

TYPES = {
    "std_msgs/Int32": MessageType("da5909fbe378aeaf85e547e830cc1bb7", 4),
    "geometry_msgs/Twist": MessageType("9f195f881246fdfa2798d1d3eebca84a", 48),
}
STEP = 0.01  # s
COMMAND_RATE = 10  # Hz
RADIUS, SEPARATION, PULSES = 0.0325, 0.13, 20


def twist(v: float, omega: float) -> bytes:
    return struct.pack("<6d", v, 0, 0, 0, 0, omega)


class Bench:
    """``run`` lets time pass, with a command at 10 Hz if given. Speeds are of the wheels over ground, m/s."""

    def __init__(self, board: SimulatedBoard) -> None:
        self.board = board
        self.events: list[Event] = []
        self.host = Conversation(
            lambda data: self.board.replies(data) and None,
            TYPES.get,
            settle=0.05,
            clock=lambda: board.truth.time,
            wall=lambda: 1_700_000_000_500_000_000,
        )

    def negotiated(self) -> Bench:
        self.run(1.0)
        assert self.host.phase is Phase.CONNECTED
        return self

    def run(self, seconds: float, command: tuple[float, float] | None = None) -> list[Event]:
        """The events of that time, s. The first command is sent at once."""
        before = len(self.events)
        for count in range(round(seconds / STEP)):
            if command is not None and count % round(1 / STEP / COMMAND_RATE) == 0:
                self.host.send("cmd_vel", twist(*command))
            self.events += self.host.step(b"".join(self.board.run_for(STEP)))
        return self.events[before:]

    def drive(self, v: float, omega: float, seconds: float) -> tuple[float, float]:
        """The mean speeds of the wheels while the command is repeated."""
        start = self.board.truth
        self.run(seconds, (v, omega))
        end = self.board.truth
        left, right = (
            RADIUS * (after - before) / (end.time - start.time)
            for before, after in zip(start.angles, end.angles, strict=True)
        )
        return left, right

    @property
    def speeds(self) -> tuple[float, float]:
        left, right = self.board.truth.speeds
        return left * RADIUS, right * RADIUS

    @property
    def logs(self) -> list[str]:
        return [event.text for event in self.events if isinstance(event, Log)]

    def ticks(self, name: str) -> list[int]:
        """Everything that the board published on the topic of that name."""
        return [
            struct.unpack("<i", event.message)[0]
            for event in self.events
            if isinstance(event, Received) and event.topic.name == name
        ]

    def odometry(self) -> tuple[float, float, float]:
        """Where the ticks put the robot that began at 0, 0, 0 (REP-103): two arcs' midpoint formula."""
        x = y = theta = 0.0
        for before, after in pairwise(zip(self.ticks("lwheel"), self.ticks("rwheel"), strict=False)):
            left, right = (
                (b - a) * 2 * math.pi * RADIUS / PULSES for a, b in zip(before, after, strict=True)
            )
            turn = (right - left) / SEPARATION
            x += (left + right) / 2 * math.cos(theta + turn / 2)
            y += (left + right) / 2 * math.sin(theta + turn / 2)
            theta += turn
        return x, y, theta
