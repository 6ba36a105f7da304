"""One robot on the bench: the driver's own link to it, every exchange timed, every motion measured."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from swarm_driver.asked import Asked, linked
from swarm_driver.codec import Reply, Request
from swarm_driver.config import Config, Scale, Sensor
from swarm_driver.kinematics import STANDSTILL, Counters, Units, wheel_units
from swarm_driver.lines import firmware_version
from swarm_driver.link import FAILED_EXCHANGE, BytePort, Link, LinkLostError
from swarm_driver.port import PortError
from swarm_driver.protocols import RosserialProtocol
from swarm_driver.report import Tally

_KEEP_UP = 0.2  # s after which a speed is said again, as a driver does
_LOOK_EVERY = 0.03  # s between two readings of the counters
_STOPS = 5  # attempts


def asked(config: Config) -> Asked:
    """The protocol of a robot that is asked; ValueError for one that speaks by itself."""
    if isinstance(config.protocol, RosserialProtocol):
        raise ValueError(f"a {config.robot} is asked nothing")
    return config.protocol


class NotStoppedError(Exception):
    """Nobody knows whether the robot stands."""


@dataclass(frozen=True)
class Pace:
    """Seconds to reach a speed, to measure it, to wait whether a robot stops by itself; how often to ask."""

    settle: float = 0.5
    measure: float = 0.8
    silence: float = 2.5
    questions: int = 50


@dataclass(frozen=True)
class Motion:
    """Speeds of the left and the right wheel, m/s: as they were ordered, and as the counters have it."""

    ordered: tuple[float, float]
    measured: tuple[float, float]
    resolution: float  # m/s that one count makes


@dataclass
class Wire:
    """The driver's port, with the time of everything that goes out."""

    port: BytePort
    written: list[tuple[float, bytes]] = field(default_factory=list)

    def write(self, data: bytes) -> None:
        self.port.write(data)
        self.written.append((time.monotonic(), data))

    def read(self, timeout: float) -> bytes:
        return self.port.read(timeout)

    def drain(self) -> None:
        self.port.drain()

    def fileno(self) -> int:
        return self.port.fileno()

    def close(self) -> None:
        self.port.close()


class Bench:
    """Exchanges raise what those of a driver do: ``FAILED_EXCHANGE``, ``LinkLostError``, ``PortError``."""

    def __init__(
        self,
        config: Config,
        open_port: Callable[[], BytePort],
        *,
        firmware_dead_man: bool,
        pace: Pace | None = None,
    ) -> None:
        self.config = config
        self.protocol = asked(config)
        self.firmware_dead_man = firmware_dead_man  # as its type says
        self.open_port = open_port
        self.pace = pace or Pace()
        self.firmware = "unknown"
        self.latencies: list[float] = []
        self.unanswered = 0
        self._wire: Wire | None = None
        self._link: Link | None = None

    @property
    def wire(self) -> Wire:
        if self._wire is None:
            raise PortError(f"{self.config.port} is not open")
        return self._wire

    @property
    def link(self) -> Link:
        if self._link is None:
            raise PortError(f"{self.config.port} is not open")
        return self._link

    @property
    def scale(self) -> Scale:
        """The robot's units. ``LinkLostError`` where they depend on a firmware that is not known."""
        scale = self.config.kinematics.scale_for(firmware_version(self.firmware))
        if scale is None:
            raise LinkLostError(f"without the firmware's version ({self.firmware}) speeds have no unit")
        return scale

    @property
    def odometer(self) -> Sensor | None:
        return next((one for one in self.config.sensors if one.kind == "wheels"), None)

    def connect(self) -> None:
        if self._link is None:
            self._wire = Wire(self.open_port())
            self._link = linked(self._wire, self.protocol, Tally())
            time.sleep(self.config.serial.settle)

    def disconnect(self) -> None:
        """Let go of the line as a killed driver does: without a word."""
        link, self._link = self._link, None
        if link is not None:
            link.close()

    def leave(self) -> None:
        """The last word is a stop, said on a line that is opened again if need be. ``NotStoppedError``."""
        try:
            self.connect()
            self.stop()
        except (LinkLostError, PortError) as error:
            raise NotStoppedError(str(error)) from error
        finally:
            self.disconnect()

    def ask(self, request: Request) -> Reply:
        began = time.monotonic()
        try:
            reply = self.link.ask(request)
        except FAILED_EXCHANGE:
            self.unanswered += 1
            raise
        if request.answered:
            self.latencies.append(time.monotonic() - began)
        return reply

    def ask_twice(self, request: Request) -> Reply:
        """One lost reply spoils no measurement; it is counted."""
        try:
            return self.ask(request)
        except FAILED_EXCHANGE:
            return self.ask(request)

    def stop(self) -> int:
        """Have the robot confirm a stop; the attempts it took."""
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
        """Moving for a while, and standing after it, whatever happens."""
        units = wheel_units(linear, angular, self.config.kinematics, self.scale)
        try:
            self.ask_twice(self.link.codec.speed(*units))
            yield units
        finally:
            self.stop()

    def counters(self, odometer: Sensor) -> Counters:
        values = self.ask_twice(self.link.codec.query(odometer.read)).values
        arrived = time.monotonic() - self.latencies[-1] / 2
        left, right = (int(one) for one in values[odometer.first : odometer.first + 2])
        return Counters(left, right, arrived)

    def way(self, before: Counters, after: Counters) -> tuple[float, float]:
        """What both wheels have driven between two readings, m, over the wrap if that is shorter."""
        half = 1 << (self.config.kinematics.counter_bits - 1)
        left, right = (
            (there - here + half) % (2 * half) - half
            for here, there in ((before.left, after.left), (before.right, after.right))
        )
        return left * self.scale.metres_per_count, right * self.scale.metres_per_count

    def motion(self, odometer: Sensor, linear: float, angular: float) -> Motion:
        """Drive so for a while, and compare what was said with what the counters tell."""
        with self.driving(linear, angular) as units:
            self.go_on(units, self.pace.settle)
            first = latest = self.counters(odometer)
            ways = [0.0, 0.0]
            said, end = time.monotonic(), first.stamp + self.pace.measure
            while latest.stamp < end:
                if time.monotonic() - said > _KEEP_UP:
                    self.ask_twice(self.link.codec.speed(*units))
                    said = time.monotonic()
                time.sleep(_LOOK_EVERY)
                reading = self.counters(odometer)
                ways = [sum(pair) for pair in zip(ways, self.way(latest, reading), strict=True)]
                latest = reading
        seconds = latest.stamp - first.stamp
        ordered = (units[0] / self.scale.speed_units_per_mps, units[1] / self.scale.speed_units_per_mps)
        return Motion(ordered, (ways[0] / seconds, ways[1] / seconds), self.scale.metres_per_count / seconds)

    def go_on(self, units: Units, seconds: float) -> None:
        """Keep a speed up, as a driver does."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            time.sleep(min(left, _KEEP_UP))
            self.ask_twice(self.link.codec.speed(*units))
