"""A polled robot under test: the driver's own link to it, every exchange measured."""

from __future__ import annotations

from collections.abc import Callable

from swarm_onboard.driver import kinematics
from swarm_onboard.driver.codec import Reply, Request
from swarm_onboard.driver.config import Config, Scale
from swarm_onboard.driver.kinematics import Counters, Odometry, wheel_units
from swarm_onboard.driver.line_protocol import firmware_version
from swarm_onboard.driver.link import FAILED_EXCHANGE, Link, LinkLostError
from swarm_onboard.driver.polled_robot import linked
from swarm_onboard.driver.protocols import PythonProtocol, RosserialProtocol
from swarm_onboard.driver.session import COMMAND_REFRESH_S
from swarm_onboard.driver.tally import Tally

from swarmctl.conformance.bench import Bench, Fixes, HangError, Pace, Reading, Velocity

_POLL_PERIOD = 0.03  # s between two readings of the counters
_STOPS = 5  # attempts


class PolledBench(Bench):
    """The bench of a polled robot. Exchanges also raise ``FAILED_EXCHANGE``."""

    link: Link

    def __init__(self, config: Config, *, firmware_dead_man: bool, pace: Pace | None = None) -> None:
        """``firmware_dead_man``: as declared by its type. Raises ``ValueError`` for a rosserial board."""
        super().__init__(config, pace or Pace())
        if isinstance(config.protocol, RosserialProtocol):
            raise ValueError(f"robot type {config.robot} is not polled")
        self.protocol = config.protocol
        self.firmware_dead_man = firmware_dead_man
        self.reply_timeout = self.protocol.reply_timeout
        self.odometer = next((one for one in config.sensors if one.kind == "wheels"), None)
        self.has_counters = self.odometer is not None
        self.firmware = "unknown"
        self.latencies: list[float] = []
        self.unanswered = 0
        self._odometry = Odometry()
        self._halt = b""  # the stop request

    @property
    def fixes(self) -> Fixes:
        """The texts that explain failed motion checks."""
        return Fixes(
            still="the counters stand: do the wheels turn? fix the query of `odom`",
            swapped="the sides are swapped: swap {left} and {right} in `set_speed`, or the order of the "
            "counters",
            wrong="a counter runs the wrong way, or with the wrong wheel: fix `set_speed` or the query of "
            "`odom`",
            off=self._scales,
        )

    @property
    def scale(self) -> Scale:
        """The robot's units. Raises ``LinkLostError`` if they depend on an unknown firmware."""
        scale = self.config.kinematics.scale_for(firmware_version(self.firmware))
        if scale is None:
            raise LinkLostError(
                f"the unit of speeds depends on the firmware, whose version is unknown ({self.firmware})"
            )
        return scale

    @property
    def metres_per_count(self) -> float:
        """The distance of a wheel per count, m."""
        return self.scale.metres_per_count

    @property
    def confirms(self) -> bool:
        """Whether the robot answers a command, and so a stop."""
        return self.link.codec.speed(*kinematics.STANDSTILL).answered

    def query(self, query: str) -> Reply:
        """Returns the reply to a query, within its own timeout."""
        return self.ask(self.link.codec.query(query), self.config.waits.get(query))

    def ask(self, request: Request, wait: float | None = None) -> Reply:
        """Returns the reply to a request and records its latency. Raises what ``Link.ask`` does."""
        began = self.clock()
        try:
            reply = self.link.ask(request, wait=wait)
        except FAILED_EXCHANGE:
            self.unanswered += 1
            raise
        if request.answered and wait is None:
            self.latencies.append(self.clock() - began)
        return reply

    def ask_twice(self, request: Request) -> Reply:
        """Repeats a request once: a lost reply is counted but does not end a measurement."""
        try:
            return self.ask(request)
        except FAILED_EXCHANGE:
            return self.ask(request)

    def command(self, velocity: Velocity) -> None:
        """Sets the wheels' speeds, in the robot's units."""
        self.ask_twice(self._speed(velocity))
        self.commanded_at = self.clock()

    def hold(self, velocity: Velocity, seconds: float) -> None:
        """Repeats the command for some seconds, and reads the counters before they wrap twice."""
        end = self.clock() + seconds
        while (left := end - self.clock()) > 0:
            self.sleep(min(left, _POLL_PERIOD))
            if self.clock() - self.commanded_at > COMMAND_REFRESH_S:
                self.command(velocity)
            if self.has_counters:
                self.position()

    def stop(self) -> int:
        """Stops the robot, which confirms it if it can; ``LinkLostError`` if it does not."""
        for attempt in range(1, _STOPS + 1):
            try:
                self.link.set_speed(*kinematics.STANDSTILL)
            except FAILED_EXCHANGE as error:  # noqa: PERF203
                last = error
            else:
                return attempt
        raise LinkLostError(str(last))

    def position(self, velocity: Velocity | None = None) -> Reading:
        """Reads both counters. A command needs no repetition until then."""
        assert self.odometer is not None
        values = self.ask_twice(self.link.codec.query(self.odometer.read)).values
        arrived = self.clock() - self.latencies[-1] / 2
        left, right = (int(one) for one in values[self.odometer.first : self.odometer.first + 2])
        self._odometry = self._odometry.update(Counters(left, right, arrived), self.any_speed, self.scale)
        return arrived, self._odometry.pose

    def wheel_speeds(self, velocity: Velocity) -> tuple[float, float]:
        """Returns the wheels' speeds, m/s, as they are sent: in whole units."""
        left, right = wheel_units(*velocity, self.config.kinematics, self.scale)
        return left / self.scale.speed_units_per_mps, right / self.scale.speed_units_per_mps

    def encoded_speed(self, linear: float) -> tuple[bytes, str] | None:
        """Returns the bytes of a speed command (m/s), and the speed as text; None for a Python codec."""
        if isinstance(self.protocol, PythonProtocol):  # a class may number its requests
            return None
        request = self._speed((linear, 0.0))
        return request.data, f"`{request.name}`"

    def is_harmless(self) -> Callable[[bytes], bool]:
        """Returns a predicate that is true of bytes that move no wheel."""
        questions = {self.link.codec.query(sensor.read).data for sensor in self.config.sensors}
        return lambda data: data in questions

    def _speed(self, velocity: Velocity) -> Request:
        return self.link.codec.speed(*wheel_units(*velocity, self.config.kinematics, self.scale))

    def _connected(self) -> None:
        self.link = linked(self.port, self.protocol, Tally())
        self._halt = self.link.codec.speed(*kinematics.STANDSTILL).data
        self.sleep(self.config.serial.settle)

    def _stop_finally(self) -> None:
        """Stops the robot on a port that is reopened if needed; with stored bytes if the codec hangs."""
        try:
            self.connect()
            self.stop()
        except HangError:
            self.port.write(self._halt)
            raise

    def _scales(self, ratio: float) -> str:
        units, metres = self.scale.speed_units_per_mps / ratio, self.scale.metres_per_count / ratio
        return (
            f"{ratio:.2f} times as fast as commanded: speed_units_per_mps: {units:.4g}, or metres_per_count: "
            f"{metres:.4g}; check with a tape measure which"
        )
