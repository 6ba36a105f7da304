"""A robot's driver without ROS: keeps a connection, begins and ends it with a stop, reports its state."""

from __future__ import annotations

import contextlib
import random
import time
from enum import Enum
from typing import Any, Callable, Mapping, Sequence

from swarm_onboard.command.authority import Standing
from swarm_onboard.command.battery_watch import BatteryWatch
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.dead_man import DeadMan
from swarm_onboard.command.limits import STANDSTILL
from swarm_onboard.command.report import Level, Report
from swarm_onboard.command.stop_latch import StopLatch
from swarm_onboard.driver.actuators import ActuatorSettings
from swarm_onboard.driver.config import Config
from swarm_onboard.driver.connection import (
    FIRST_RETRY,
    LAST_RETRY,
    UNKNOWN,
    Connection,
    ConnectionContext,
    Readable,
)
from swarm_onboard.driver.kinematics import Odometry
from swarm_onboard.driver.link import BytePort, LinkLostError
from swarm_onboard.driver.live_parameters import LiveParameters
from swarm_onboard.driver.polled_robot import PolledRobot, linked
from swarm_onboard.driver.port import PortError
from swarm_onboard.driver.protocols import RosserialProtocol
from swarm_onboard.driver.relay import Relay
from swarm_onboard.driver.rosserial_robot import Board
from swarm_onboard.driver.session import Sink
from swarm_onboard.driver.stillness import Stillness
from swarm_onboard.driver.tally import Tally

_STABLE = 5.0  # s a session must last before its loss counts as a new one
_WARM, _WARM_PERIODS = 2.0, 2.5  # s, and periods, until a sensor's rate can be measured
_LONGEST_FIRMWARE = 200  # characters, so that an answer fits into a datagram
_SLOW = 0.8  # of the wanted rate, below which a sensor is reported as slow


class Phase(Enum):
    """The state of the driver's connection."""

    DISCONNECTED = "disconnected"
    IDENTIFYING = "identifying"
    READY = "ready"


class Driver:
    """``step`` and ``close`` belong to one thread; commands come through ``commands`` from any other."""

    def __init__(
        self,
        config: Config,
        commands: CommandMailbox,
        sink: Sink,
        outputs: ActuatorSettings,
        relay: Relay,
        *,
        open_port: Callable[[], BytePort],
        standing: Callable[[], Standing] = Standing,
        clock: Callable[[], float] = time.monotonic,
        jitter: Callable[[], float] = random.random,
    ) -> None:
        self._config = config
        self._commands = commands
        self._sink = sink
        self._outputs = outputs
        self._open_port = open_port
        self._standing = standing
        self._dead_man = DeadMan(commands, config.command_timeout, clock)
        self._clock = clock
        self._jitter = jitter
        self._tally = Tally()
        self._battery = BatteryWatch(config.battery_limits, commands, clock)
        self._relay = relay
        self._connection: Connection | None = None
        self._odometry = Odometry()
        self._stillness = Stillness()
        self._firmware = UNKNOWN
        self._trouble = "not connected yet"
        self._attempt = 0
        self._due = self._report_due = self._taken_at = clock()

    @property
    def phase(self) -> Phase:
        """The state of the connection."""
        if self._connection is None:
            return Phase.DISCONNECTED
        return Phase.IDENTIFYING if self._connection.since is None else Phase.READY

    def step(self) -> float:
        """Does what is due: one exchange at most, or two attempts at one.

        Returns the seconds until more is due.
        """
        if self._connection is not None or self._due <= self._clock():
            try:
                self._due = self._advance()
                self._stillness.take(self._connection.odometry.counters if self._connection else None)
            except (LinkLostError, PortError) as error:
                self._due = self._give_up(str(error), missing=isinstance(error, PortError) and error.missing)
        now = self._clock()
        if self._report_due <= now:
            self._report_due = now + 1 / self._config.diagnostics_rate
            self._sink.report(self._report())
        return max(0.0, min(self._due, self._report_due) - self._clock())

    def take(self, config: Config) -> None:
        """Works with the live values of ``config`` from the next step on; the robot keeps its command."""
        self._config = config
        self._dead_man.timeout = config.command_timeout
        if self._connection is not None:
            self._connection.take(config)
        self._taken_at = self._report_due = self._clock()

    def listens_to(self) -> Sequence[Readable]:
        """Returns the files whose input calls for a step before the time that ``step`` returned is over."""
        return self._connection.listens_to() if self._connection is not None else ()

    def motion(self) -> Mapping[str, Any]:
        """Returns who commands the robot, and what is known of its wheels; moments by the driver's clock.

        ``commanded`` and ``driven``: m/s and rad/s; ``pose``: x and y in m, yaw in rad, by odometry.

        ``zero_at``: when a zero was last confirmed; ``still_since``: by the counters of the wheels;
        ``idle_since``: the latest of its start, the last command and the last turn of a wheel; ``battery``:
        how full it is, 0 to 1; ``firmware``: its version, empty if the robot has not sent it.
        """
        connection = self._connection
        known = connection is not None and connection.since is not None
        zero_at = connection.zero_at() if connection is not None and known else None
        step = connection.wheel_step() if connection is not None and known else None
        moved = self._stillness.unchanged_since()
        pose = connection.odometry.pose if connection is not None and step is not None else None
        command = self._dead_man.in_force()
        velocity = command.velocity if command is not None else STANDSTILL
        idle_since = self._commands.commanded_at if moved is None else max(moved, self._commands.commanded_at)
        return {
            "held": self._commands.held,
            "commander": self._standing().commander,
            "commanded": [velocity.forward, velocity.turn],
            "driven": [pose.linear, pose.angular] if pose is not None else None,
            "pose": [pose.x, pose.y, pose.yaw] if pose is not None else None,
            "zero_at": zero_at,
            "confirms": not isinstance(self._config.protocol, RosserialProtocol),
            "measured": step is not None,
            "still_since": self._stillness.since(step, zero_at),
            "idle_since": idle_since,
            "battery": self._battery.share() if known else None,
            "firmware": _named(connection.firmware) if connection is not None and known else "",
            "trouble": "" if known else (connection.trouble if connection else "") or self._trouble,
        }

    def close(self) -> None:
        """Stops the robot, waits for its confirmation and closes the line."""
        connection, self._connection = self._connection, None
        if connection is None:
            return
        try:
            connection.stop()
        except (LinkLostError, PortError) as error:
            self._sink.event(Level.ERROR, f"the robot did not confirm the last stop: {error}")
        finally:
            connection.close()

    def _advance(self) -> float:
        if self._connection is None:
            self._connection = self._connected(self._open_port())
        return self._connection.step()

    def _connected(self, port: BytePort) -> Connection:
        protocol = self._config.protocol
        around = ConnectionContext(
            self._config,
            self._commands,
            self._outputs,
            self._sink,
            self._tally,
            self._battery,
            self._clock,
        )
        if isinstance(protocol, RosserialProtocol):
            return Board(port, protocol, self._relay, self._odometry.forget(), around)
        link = linked(port, protocol, self._tally, self._clock)
        return PolledRobot(link, self._odometry.forget(), around)

    def _give_up(self, trouble: str, *, missing: bool) -> float:
        """Closes the line, with a stop if it still takes one. Returns the moment of the next attempt."""
        connection, self._connection = self._connection, None
        known = connection is not None and connection.since is not None
        if connection is not None:
            self._odometry, self._firmware = connection.odometry, connection.firmware
            if connection.since is not None and self._clock() - connection.since > _STABLE:
                self._attempt = 0
            with contextlib.suppress(
                PortError
            ):  # a line that is gone takes no stop; the next one begins with it
                connection.send_stop()
            connection.close()
        if known:
            self._tally.lost(self._clock(), trouble)
        if known or trouble != self._trouble:
            self._sink.event(Level.ERROR, trouble)
        self._trouble = self._tally.last_error = trouble
        if missing:  # looking for it costs nothing, and a robot that is plugged in again may be driving
            return self._clock() + FIRST_RETRY
        delay: float = min(LAST_RETRY, FIRST_RETRY * 2 ** min(self._attempt, 16))
        self._attempt += 1
        return self._clock() + delay * (0.75 + 0.25 * self._jitter())

    def _report(self) -> Report:
        standing, connection = self._standing(), self._connection
        figures = {**self._figures(), **standing.values()}
        if connection is None or connection.since is None:
            trouble = connection.trouble if connection is not None else ""
            level = Level.ERROR if connection is None or trouble else Level.WARN
            return Report(level, trouble or self._trouble, figures)
        strangers = [standing.complaint] if standing.complaint else []
        age = self._clock() - max(connection.since, self._taken_at)
        slow = [
            f"{name} comes at {measured:.1f} instead of {wanted:g} Hz"
            for name, measured, wanted in connection.rates()
            if measured < _SLOW * wanted and age > max(_WARM, _WARM_PERIODS / wanted)
        ]
        losing = self._tally.losing(self._clock())
        lost = [f"{losing}: check the plugs, the robot's supply and its battery"] if losing else []
        complaints = [*strangers, *connection.complaints(), *lost, *slow, *self._battery.complaints()]
        message = "; ".join([connection.activity(), *complaints])
        level = max(self._battery.level(), Level.WARN if complaints else Level.OK)
        return Report(level, message, figures)

    def _figures(self) -> dict[str, str]:
        tally, connection = self._tally, self._connection
        odometry = connection.odometry if connection else self._odometry
        rates = connection.rates() if connection and connection.since is not None else []
        return {
            "state": self.phase.value,
            "port": self._config.port,
            "baud": str(self._config.serial.baud),
            "firmware": connection.firmware if connection else self._firmware,
            **{f"{name} rate": f"{got:.1f} of {wanted:g} Hz" for name, got, wanted in rates},
            "connections": str(tally.connections),
            "failed exchanges": str(tally.failed_exchanges),
            "noise lines": str(tally.noise_lines),
            **(connection.figures() if connection else {}),
            "dead-man trips": str(tally.dead_man_trips),
            "refused commands": str(self._commands.refused),
            "refused settings": str(self._outputs.refused),
            "odometry jumps": str(odometry.jumps),
            "last error": tally.last_error,
            **({"the robot reports": tally.reported} if tally.reported else {}),
        }


def _named(firmware: str) -> str:
    return "" if firmware == UNKNOWN else firmware[:_LONGEST_FIRMWARE]


def run(
    driver: Driver,
    commands: CommandMailbox,
    latch: StopLatch,
    beat: Callable[[], None],
    longest_wait: float,
    *,
    live: LiveParameters,
) -> None:
    """Steps ``driver`` until ``commands`` are stopped, with ``beat`` after each step.

    Always ends with a stop.
    """
    try:
        while not commands.stopped:
            latch.look()
            live.look()
            wait = driver.step()
            beat()
            latch.answer(lambda: {**driver.motion(), **live.state()}, live.requested)
            commands.wait(min(wait, longest_wait), [*driver.listens_to(), *latch.listens_to()])
    finally:
        driver.close()
