"""One robot drives one manoeuvre, in virtual time: by the driver's own core, or by a paper's formula."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import ClassVar

from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.driver.actuators import ActuatorSettings
from swarm_onboard.driver.config import Config
from swarm_onboard.driver.driver import Driver, Phase
from swarm_onboard.driver.kinematics import Pose
from swarm_onboard.driver.relay import Outgoing, Parameter
from swarm_onboard.rosserial.topics import MessageType

from motion_quality.line import Clock, TimedLine
from motion_quality.papers import Formula
from motion_quality.paths import Manoeuvre, Place, Twist
from swarmctl.lab.emulators import Robot

EVERY = 0.1  # s between two commands, as a joystick's node repeats them
SETTLED = 0.5  # s after the last command in which the last counters are read
PATIENCE = 5.0  # s until a robot must be known
STILL = Twist(0.0, 0.0)


class Track:
    """A driver's sink that keeps the latest pose; other reports are ignored."""

    def __init__(self) -> None:
        self.pose = Pose()

    def odometry(self, pose: Pose) -> None:
        self.pose = pose

    def reading(self, *_: object) -> None: ...

    def report(self, *_: object) -> None: ...

    def event(self, *_: object) -> None: ...


class NoRos:
    """Stands for ROS: knows the types that a rover speaks, and passes nothing on."""

    types: ClassVar = {
        "std_msgs/Int32": MessageType("da5909fbe378aeaf85e547e830cc1bb7", 4),
        "geometry_msgs/Twist": MessageType("9f195f881246fdfa2798d1d3eebca84a", 48),
    }

    def type_of(self, name: str) -> MessageType | None:
        return self.types.get(name)

    def serve(self, *_: object) -> None: ...

    def publish(self, *_: object) -> None: ...

    def log(self, *_: object) -> None: ...

    def ask(self, *_: object) -> None: ...

    def taken(self) -> list[Outgoing | Parameter]:
        return []


def commands_of(manoeuvre: Manoeuvre) -> Iterator[tuple[float, Twist]]:
    """Yields each command with its moment: a new one at once, then its repetitions, at the end a stop."""
    begun = 0.0
    for leg in manoeuvre.legs:
        repeats = range(int(leg.seconds / EVERY) + 1)
        yield from ((begun + EVERY * number, leg.twist) for number in repeats if EVERY * number < leg.seconds)
        begun += leg.seconds
    yield begun, STILL


class Ride:
    """A driver that holds its robot ready, at the origin."""

    def __init__(self, config: Config, robot: Robot) -> None:
        self.robot = robot
        self._clock = Clock()
        self._line = TimedLine(robot, config.serial, self._clock)
        self._commands = CommandMailbox(self._clock)
        self._track = Track()
        self._driver = Driver(
            config,
            self._commands,
            self._track,
            ActuatorSettings(config.actuators, self._commands.ring, self._clock),
            NoRos(),
            open_port=lambda: self._line,
            clock=self._clock,
            jitter=lambda: 1.0,
        )
        self._pass_until(PATIENCE)
        if self._driver.phase is not Phase.READY:
            raise RuntimeError(f"the driver does not find its {config.title}")

    def drive(self, manoeuvre: Manoeuvre) -> tuple[Place, Pose]:
        """Where the robot is in truth, and where its driver believes it to be."""
        start = self._clock.now
        for moment, twist in commands_of(manoeuvre):
            self._put(twist, start + moment)
        self._pass_until(self._clock.now + SETTLED)
        return place_of(self.robot), self._track.pose

    def hold(self, twist: Twist) -> None:
        """Commands it once, and lets the robot follow."""
        self._put(twist, self._clock.now)
        self._pass_until(self._clock.now + EVERY)

    def _put(self, twist: Twist, moment: float) -> None:
        self._pass_until(moment)
        self._commands.put((twist.linear, 0.0, 0.0), (0.0, 0.0, twist.angular), arrived=moment)

    def _pass_until(self, end: float) -> None:
        """Let time pass, as ``swarm_onboard.driver.driver.run`` does."""
        while self._clock.now < end:
            wait = self._driver.step()
            self._clock.now = max(self._clock.now, min(end, self._clock.now + wait))
        self._line.catch_up()


def by_paper(formula: Formula, manoeuvre: Manoeuvre, make: Callable[[], Robot]) -> Place:
    """Where the robot is after the same commands, each sent at once as the paper's formula has it."""
    robot, passed = make(), 0.0
    for moment, twist in commands_of(manoeuvre):
        robot.advance(moment - passed)
        robot.receive(formula.request(twist))
        passed = moment
    return place_of(robot)


def place_of(robot: Robot) -> Place:
    state = robot.state
    return Place(x=state.x, y=state.y, heading=state.theta, driven=state.distance)
