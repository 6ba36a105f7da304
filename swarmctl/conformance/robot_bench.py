"""A polled robot under test: the driver's own link to it, every exchange and motion measured."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from swarm_onboard.driver.codec import Reply, Request
from swarm_onboard.driver.config import Config, Scale, Sensor
from swarm_onboard.driver.kinematics import STANDSTILL, Counters, Units, wheel_units
from swarm_onboard.driver.line_protocol import firmware_version
from swarm_onboard.driver.link import FAILED_EXCHANGE, BytePort, Link, LinkLostError
from swarm_onboard.driver.polled_robot import PolledProtocol, linked
from swarm_onboard.driver.port import PortError
from swarm_onboard.driver.protocols import PythonProtocol, RosserialProtocol
from swarm_onboard.driver.relay import Relay
from swarm_onboard.driver.tally import Tally

from swarmctl.conformance.motion_base import (
    Fixes,
    HangError,
    Motion,
    NoBoard,
    NotStoppedError,
    Pace,
)
from swarmctl.conformance.serial_bench import SerialBench
from swarmctl.conformance.timed_port import TimedPort

_COMMAND_REFRESH_S = 0.2  # s after which a speed is repeated, as a driver does
_POLL_PERIOD = 0.03  # s between two readings of the counters
_STOPS = 5  # attempts


def polled_protocol(config: Config) -> PolledProtocol:
    """Returns the protocol of a polled robot. Raises ``ValueError`` for a rosserial board."""
    if isinstance(config.protocol, RosserialProtocol):
        raise ValueError(f"robot type {config.robot} is not polled")
    return config.protocol


class Bench(SerialBench):
    """A polled ``Wheeled`` robot.

    Exchanges raise ``FAILED_EXCHANGE``, ``LinkLostError`` and ``PortError``.
    """

    def __init__(
        self,
        config: Config,
        open_port: Callable[[], BytePort],
        *,
        firmware_dead_man: bool,
        pace: Pace | None = None,
    ) -> None:
        super().__init__(config, open_port, pace or Pace())
        self.protocol = polled_protocol(config)
        self.firmware_dead_man = firmware_dead_man  # as declared by its type
        self.relay: Relay = NoBoard()
        self.reply_timeout = self.protocol.reply_timeout
        self.firmware = "unknown"
        self.latencies: list[float] = []
        self.unanswered = 0
        self._link: Link | None = None
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
    def has_counters(self) -> bool:
        """True if the robot reports how far its wheels have turned."""
        return self.odometer is not None

    @property
    def link(self) -> Link:
        """The open link. Raises ``PortError`` if it is closed."""
        return self.opened(self._link)

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
    def odometer(self) -> Sensor | None:
        """The sensor that reads the position counters; None if the type has none."""
        return next((one for one in self.config.sensors if one.kind == "wheels"), None)

    def connect(self) -> None:
        """Opens the port, unless it is open."""
        if self._link is None:
            self._port = TimedPort(self.open_port())
            self._link = linked(self._port, self.protocol, Tally())
            self._halt = self._link.codec.speed(*STANDSTILL).data
            time.sleep(self.config.serial.settle)

    def disconnect(self) -> None:
        """Closes the port, if it is open."""
        link, self._link = self._link, None
        if link is not None:
            link.close()

    def finish(self) -> None:
        """Stops the robot on a port that is reopened if needed; with stored bytes if the codec hangs.

        Raises ``NotStoppedError``.
        """
        try:
            self.connect()
            self.stop()
        except (LinkLostError, PortError) as error:
            raise NotStoppedError(str(error)) from error
        except HangError:
            self.port.write(self._halt)
            raise
        finally:
            self.disconnect()

    def query(self, query: str) -> Reply:
        """Returns the reply to a query, within its own timeout."""
        return self.ask(self.link.codec.query(query), self.config.waits.get(query))

    def ask(self, request: Request, wait: float | None = None) -> Reply:
        """Returns the reply to a request and records its latency. Raises what ``Link.ask`` does."""
        began = time.monotonic()
        try:
            reply = self.link.ask(request, wait=wait)
        except FAILED_EXCHANGE:
            self.unanswered += 1
            raise
        if request.answered and wait is None:
            self.latencies.append(time.monotonic() - began)
        return reply

    def ask_twice(self, request: Request) -> Reply:
        """Repeats a request once: a lost reply is counted but does not end a measurement."""
        try:
            return self.ask(request)
        except FAILED_EXCHANGE:
            return self.ask(request)

    @property
    def confirms(self) -> bool:
        """Whether the robot answers a command, and so a stop."""
        return self.link.codec.speed(*STANDSTILL).answered

    def stop(self) -> int:
        """Stops the robot, which confirms it if it can; ``LinkLostError`` if it does not."""
        for attempt in range(1, _STOPS + 1):
            try:
                self.link.set_speed(*STANDSTILL)
            except FAILED_EXCHANGE as error:  # noqa: PERF203
                last = error
            else:
                return attempt
        raise LinkLostError(str(last))

    @contextmanager
    def driving(self, linear: float, angular: float) -> Iterator[Units]:
        """Drives at a velocity (m/s, rad/s) while entered; stops the robot at the end."""
        units = wheel_units(linear, angular, self.config.kinematics, self.scale)
        try:
            self.ask_twice(self.link.codec.speed(*units))
            yield units
        finally:
            self.stop()

    def counters(self) -> Counters:
        """Returns both position counters. Raises ``LinkLostError`` if the type has none."""
        odometer = self.odometer
        if odometer is None:
            raise LinkLostError("the type has no position counters")
        values = self.ask_twice(self.link.codec.query(odometer.read)).values
        arrived = time.monotonic() - self.latencies[-1] / 2
        left, right = (int(one) for one in values[odometer.first : odometer.first + 2])
        return Counters(left, right, arrived)

    def distance(self, before: Counters, after: Counters) -> tuple[float, float]:
        """Returns the distance of both wheels between two readings, m; counters may wrap."""
        half = 1 << (self.config.kinematics.counter_bits - 1)
        left, right = (
            (there - here + half) % (2 * half) - half
            for here, there in ((before.left, after.left), (before.right, after.right))
        )
        return left * self.scale.metres_per_count, right * self.scale.metres_per_count

    def motion(self, linear: float, angular: float) -> Motion:
        """Drives at a velocity (m/s, rad/s), measures the motion and stops."""
        with self.driving(linear, angular) as units:
            self.hold(units, self.pace.settle)
            first = latest = self.counters()
            ways = [0.0, 0.0]
            commanded_at, end = time.monotonic(), first.stamp + self.pace.measure
            while latest.stamp < end:
                if time.monotonic() - commanded_at > _COMMAND_REFRESH_S:
                    self.ask_twice(self.link.codec.speed(*units))
                    commanded_at = time.monotonic()
                time.sleep(_POLL_PERIOD)
                reading = self.counters()
                ways = [sum(pair) for pair in zip(ways, self.distance(latest, reading), strict=True)]
                latest = reading
        seconds = latest.stamp - first.stamp
        ordered = (units[0] / self.scale.speed_units_per_mps, units[1] / self.scale.speed_units_per_mps)
        return Motion(ordered, (ways[0] / seconds, ways[1] / seconds), self.scale.metres_per_count / seconds)

    def hold(self, units: Units, seconds: float) -> None:
        """Repeats the command for some seconds."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            time.sleep(min(left, _COMMAND_REFRESH_S))
            self.ask_twice(self.link.codec.speed(*units))

    def encoded_speed(self, linear: float) -> tuple[bytes, str] | None:
        """Returns the bytes of a speed command (m/s), and the speed as text; None for a Python codec."""
        if isinstance(self.protocol, PythonProtocol):  # a class may number its requests
            return None
        units = wheel_units(linear, 0.0, self.config.kinematics, self.scale)
        request = self.link.codec.speed(*units)
        return request.data, f"`{request.name}`"

    def is_harmless(self) -> Callable[[bytes], bool]:
        """Returns a predicate that is true of bytes that move no wheel."""
        questions = {self.link.codec.query(sensor.read).data for sensor in self.config.sensors}
        return lambda data: data in questions

    def _scales(self, ratio: float) -> str:
        units, metres = self.scale.speed_units_per_mps / ratio, self.scale.metres_per_count / ratio
        return (
            f"{ratio:.2f} times as fast as commanded: speed_units_per_mps: {units:.4g}, or metres_per_count: "
            f"{metres:.4g}; check with a tape measure which"
        )
