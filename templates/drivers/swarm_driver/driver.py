"""A robot's driver without ROS: keeps a connection, begins and ends it with a stop, reports how it goes."""

from __future__ import annotations

import contextlib
import random
import time
from enum import Enum
from functools import partial
from typing import Callable, Iterator

from swarm_driver.authority import Standing
from swarm_driver.binary import BinaryCodec
from swarm_driver.codec import BadReplyError, Codec
from swarm_driver.config import BinaryProtocol, Config, PythonProtocol
from swarm_driver.kinematics import STANDSTILL, Odometry
from swarm_driver.lines import LineCodec, firmware_version
from swarm_driver.link import BytePort, Link, LinkLostError
from swarm_driver.orders import Orders
from swarm_driver.outputs import Outputs
from swarm_driver.own import OwnCodec
from swarm_driver.port import PortError
from swarm_driver.report import Level, Report, Tally
from swarm_driver.session import Session, Sink

_FIRST_RETRY, _LAST_RETRY = 0.2, 5.0  # s between two attempts to connect, doubled from the one to the other
_STABLE = 5.0  # s a session must last before its loss counts as a new one
_WARM, _WARM_PERIODS = 2.0, 2.5  # s, and periods, until a sensor's rate can be told
_SLOW = 0.8  # of the wanted rate, below which a sensor is reported as slow


class Phase(Enum):
    DISCONNECTED = "disconnected"
    IDENTIFYING = "identifying"
    READY = "ready"


class Driver:
    """``step`` and ``close`` belong to one thread; orders come through ``orders`` from any other."""

    def __init__(
        self,
        config: Config,
        orders: Orders,
        sink: Sink,
        outputs: Outputs,
        *,
        open_port: Callable[[], BytePort],
        standing: Callable[[], Standing] = Standing,
        clock: Callable[[], float] = time.monotonic,
        jitter: Callable[[], float] = random.random,
    ) -> None:
        self._config = config
        self._orders = orders
        self._sink = sink
        self._outputs = outputs
        self._open_port = open_port
        self._standing = standing
        self._clock = clock
        self._jitter = jitter
        self._tally = Tally()
        self._link: Link | None = None
        self._session: Session | None = None
        self._odometry = Odometry()
        self._firmware = "unknown"
        self._unprepared: list[str] = []
        self._trouble = "not connected yet"
        self._attempt = 0
        self._due = self._report_due = clock()
        self._failures_reported = 0

    @property
    def phase(self) -> Phase:
        if self._link is None:
            return Phase.DISCONNECTED
        return Phase.IDENTIFYING if self._session is None else Phase.READY

    def step(self) -> float:
        """Do what is due, one exchange at most once the robot is known; the seconds until more is due."""
        if self._session is not None or self._due <= self._clock():
            try:
                self._due = self._advance()
            except (LinkLostError, PortError) as error:
                self._due = self._give_up(str(error))
        now = self._clock()
        if self._report_due <= now:
            self._report_due = now + 1 / self._config.diagnostics_rate
            self._sink.report(self._report())
        return max(0.0, min(self._due, self._report_due) - self._clock())

    def close(self) -> None:
        """Stop the robot, have it confirm that, let go of the line."""
        link, self._link, self._session = self._link, None, None
        if link is None:
            return
        try:
            link.twice(lambda: link.set_speed(*STANDSTILL))
        except (LinkLostError, PortError) as error:
            self._sink.event(Level.ERROR, f"the robot did not confirm the last stop: {error}")
        finally:
            link.close()

    def _advance(self) -> float:
        if self._session is not None:
            return self._session.step()
        if self._link is None:
            self._link = linked(self._open_port(), self._config, self._tally, self._clock)
            return self._clock() + self._config.serial.settle
        self._session = self._identified(self._link)
        return self._clock()

    def _identified(self, link: Link) -> Session:
        """A session, once the robot has confirmed a stop (so it is there) and its units are known."""
        try:
            link.twice(lambda: link.set_speed(*STANDSTILL))
        except LinkLostError as error:
            advice = "; " + self._config.serial.hint if self._config.serial.hint else ""
            raise LinkLostError(f"{error} at {self._config.serial.baud} baud{advice}") from error
        self._firmware = self._asked_firmware(link)
        scale = self._config.kinematics.scale_for(firmware_version(self._firmware))
        if scale is None:
            raise LinkLostError(f"without the firmware's version ({self._firmware}) speeds have no unit")
        self._unprepared = list(self._refused_setup(link))
        self._tally.connections += 1
        self._sink.event(Level.OK, f"connected to {self._config.port}, firmware {self._firmware}")
        return Session(
            link,
            self._config,
            scale,
            odometry=self._odometry.forget(),
            orders=self._orders,
            outputs=self._outputs,
            sink=self._sink,
            tally=self._tally,
            clock=self._clock,
        )

    def _asked_firmware(self, link: Link) -> str:
        try:
            request = link.codec.identify()
            return (link.twice(lambda: link.ask(request)).text if request else "") or "unknown"
        except (BadReplyError, LinkLostError):
            return "unknown"

    def _refused_setup(self, link: Link) -> Iterator[str]:
        """Prepare the robot; what it does not confirm costs some readings, and is no reason not to drive."""
        try:
            requests = link.codec.setup()
        except BadReplyError as error:
            yield f"the setup cannot be made: {error}"
            return
        for request in requests:
            try:
                link.twice(partial(link.ask, request))
            except LinkLostError as error:  # noqa: PERF203
                trouble = f"the setup `{request.name}` is not confirmed: {error}"
                self._sink.event(Level.WARN, trouble)
                yield trouble

    def _give_up(self, trouble: str) -> float:
        """Close the line, with a stop if it still takes one; the moment of the next attempt."""
        if self._session is not None:
            self._odometry = self._session.odometry
            if self._clock() - self._session.since > _STABLE:
                self._attempt = 0
        if self._link is not None:
            with contextlib.suppress(
                PortError
            ):  # a line that is gone takes no stop; the next one begins with it
                self._link.blurt_stop()
            self._link.close()
        if self._session is not None or trouble != self._trouble:
            self._sink.event(Level.ERROR, trouble)
        self._link, self._session, self._trouble = None, None, trouble
        self._tally.last_error = trouble
        delay: float = min(_LAST_RETRY, _FIRST_RETRY * 2 ** min(self._attempt, 16))
        self._attempt += 1
        return self._clock() + delay * (0.75 + 0.25 * self._jitter())

    def _report(self) -> Report:
        failures = self._tally.failed_exchanges - self._failures_reported
        self._failures_reported += failures
        standing = self._standing()
        figures = {**self._figures(), "commander": standing.commander, "refused senders": standing.refused}
        if self._session is None:
            level = Level.ERROR if self._link is None else Level.WARN
            return Report(level, self._trouble, figures)
        complaints = self._complaints(self._session, failures, standing)
        message = "; ".join([self._session.activity(), *complaints])
        return Report(Level.WARN if complaints else Level.OK, message, figures)

    def _complaints(self, session: Session, failures: int, standing: Standing) -> list[str]:
        """What is not as it should be with a robot that is there."""
        found = [standing.complaint] if standing.complaint else []
        found += [f"{failures} exchanges failed"] if failures else []
        found += self._unprepared
        age = self._clock() - session.since
        return found + [
            f"{name} comes at {measured:.1f} instead of {wanted:g} Hz"
            for name, measured, wanted in session.rates()
            if measured < _SLOW * wanted and age > max(_WARM, _WARM_PERIODS / wanted)
        ]

    def _figures(self) -> dict[str, str]:
        tally = self._tally
        odometry = self._session.odometry if self._session else self._odometry
        rates = self._session.rates() if self._session else []
        return {
            "state": self.phase.value,
            "port": self._config.port,
            "baud": str(self._config.serial.baud),
            "firmware": self._firmware,
            **{f"{name} rate": f"{got:.1f} of {wanted:g} Hz" for name, got, wanted in rates},
            "connections": str(tally.connections),
            "failed exchanges": str(tally.failed_exchanges),
            "noise lines": str(tally.noise_lines),
            "dead-man trips": str(tally.dead_man_trips),
            "refused orders": str(self._orders.refused),
            "refused settings": str(self._outputs.refused),
            "odometry jumps": str(odometry.jumps),
            "last error": tally.last_error,
        }


def linked(port: BytePort, config: Config, tally: Tally, clock: Callable[[], float] = time.monotonic) -> Link:
    """The conversation with the robot that ``config`` describes; LinkLostError if nobody can."""
    try:
        return Link(port, _codec(config), config.protocol.reply_timeout, tally, clock)
    except BadReplyError as error:  # a class of the robot type's own that cannot even be made
        port.close()
        raise LinkLostError(str(error)) from error


def _codec(config: Config) -> Codec:
    if isinstance(config.protocol, BinaryProtocol):
        return BinaryCodec(config.protocol)
    if isinstance(config.protocol, PythonProtocol):
        return OwnCodec(config.protocol)
    return LineCodec(config.protocol)


def run(driver: Driver, orders: Orders, beat: Callable[[], None], longest_wait: float) -> None:
    """Step ``driver`` until ``orders`` are stopped; ``beat`` after each step; always end with a stop."""
    try:
        while not orders.stopped:
            wait = driver.step()
            beat()
            orders.wait(min(wait, longest_wait))
    finally:
        driver.close()
