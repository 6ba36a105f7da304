"""A robot that answers requests, over one open port.

It confirms a stop and its identity before it is served.
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from typing import Callable, Iterator, Union

from swarm_onboard.command.report import Level
from swarm_onboard.driver.binary_protocol import BinaryCodec
from swarm_onboard.driver.codec import BadReplyError, Codec
from swarm_onboard.driver.config import Config
from swarm_onboard.driver.connection import UNKNOWN, ConnectionContext
from swarm_onboard.driver.kinematics import STANDSTILL, Odometry
from swarm_onboard.driver.line_protocol import LineCodec, firmware_version, overheard
from swarm_onboard.driver.link import BytePort, Link, LinkLostError
from swarm_onboard.driver.protocols import BinaryProtocol, LineProtocol, PythonProtocol
from swarm_onboard.driver.session import Session
from swarm_onboard.driver.tally import Tally
from swarm_onboard.driver.user_codec import UserCodec


class PolledRobot:
    """A ``Connection`` of one request, one reply."""

    def __init__(self, link: Link, odometry: Odometry, around: ConnectionContext) -> None:
        self.trouble = ""
        self.firmware = UNKNOWN
        self._link = link
        self._odometry = odometry
        self._around = around
        self._settled_at = around.clock() + around.config.serial.settle
        self._session: Session | None = None
        self._unprepared: list[str] = []
        self._left_out: list[str] = []
        self._meeting = self._met()

    @property
    def since(self) -> float | None:
        return self._session.since if self._session else None

    @property
    def odometry(self) -> Odometry:
        return self._session.odometry if self._session else self._odometry

    def step(self) -> float:
        """Makes one exchange at most. Before the robot is known, a failed exchange is repeated once."""
        if self._session is not None:
            return self._session.step()
        if self._around.clock() < self._settled_at:
            return self._settled_at
        self._session = next(self._meeting)
        return self._around.clock()

    def listens_to(self) -> list[BytePort]:
        """Returns nothing: unsolicited bytes are noise."""
        return []

    def take(self, config: Config) -> None:
        self._around = replace(self._around, config=config)
        if self._session is not None:
            self._session.take(config)

    def stop(self) -> None:
        self._link.twice(lambda: self._link.set_speed(*STANDSTILL))

    def send_stop(self) -> None:
        self._link.send_stop()

    def close(self) -> None:
        self._link.close()

    def activity(self) -> str:
        return self._session.activity() if self._session else ""

    def zero_at(self) -> float | None:
        return self._session.zero_at() if self._session else None

    def wheel_step(self) -> float | None:
        return self._session.wheel_step() if self._session else None

    def rates(self) -> list[tuple[str, float, float]]:
        return self._session.rates() if self._session else []

    def complaints(self) -> list[str]:
        tally, port = self._around.tally, self._around.config.port
        failing = tally.failing(self._around.clock(), "requests in the last minute failed")
        advice = f"check the cable or radio, what disturbs it, and that no other program uses {port}"
        failures = [f"{failing} (last: {tally.last_error}): if replies are lost, {advice}"] if failing else []
        return [*failures, *self._unprepared, *self._left_out]

    def figures(self) -> dict[str, str]:
        return {}

    def _met(self) -> Iterator[Session | None]:
        """Exchange by exchange to a session: the robot confirms a stop, so it is there; units are known."""
        config, around = self._around.config, self._around
        try:
            self.stop()
        except LinkLostError as error:
            advice = "; " + config.serial.hint if config.serial.hint and not around.tally.reported else ""
            raise LinkLostError(f"{error} at {config.serial.baud} baud{advice}") from error
        yield None
        self.firmware = self._requested_firmware()
        scale = config.kinematics.scale_for(firmware_version(self.firmware))
        if scale is None:
            raise LinkLostError(f"without the firmware's version ({self.firmware}) speeds have no unit")
        yield None
        for trouble in self._set_up():
            self._unprepared += [trouble] if trouble else []
            yield None
        on = [one for one in config.sensors if one.rate > 0]
        left_out = [one for one in on if not config.readable(one, self.firmware)]
        self._left_out = [
            f"`{one.name}` is left out: the firmware is not {config.firmware_of[one.read]}'s "
            f"({self.firmware}); set its rate to 0"
            for one in left_out
        ]
        around.tally.connections += 1
        around.tally.reported = ""
        around.sink.event(Level.OK, f"connected to {config.port}, firmware {self.firmware}")
        yield Session(
            self._link,
            self._around.config,  # taken since, if it is another one
            scale,
            odometry=self._odometry,
            commands=around.commands,
            outputs=around.outputs,
            sink=around.sink,
            tally=around.tally,
            battery=around.battery,
            clock=around.clock,
            slow=not self._unprepared,  # what is not set may send more than is expected
            left_out=left_out,
        )

    def _requested_firmware(self) -> str:
        try:
            request = self._link.codec.identify()
            reply = self._link.twice(lambda: self._link.ask(request)) if request else None
            if request and request.trails:
                self._link.pass_by()
            return (reply.text if reply else "") or UNKNOWN
        except BadReplyError as error:  # a class that cannot even ask
            self._around.tally.failed(error)
        except LinkLostError:
            pass
        return UNKNOWN

    def _set_up(self) -> Iterator[str]:
        """Prepare the robot, request by request: what is wrong with each, or nothing.

        What is not confirmed costs some readings, and is no reason not to drive.
        """
        try:
            requests = self._link.codec.setup()
        except BadReplyError as error:
            yield f"the setup cannot be made: {error}"
            return
        for request in requests:
            trouble = ""
            try:
                self._link.twice(partial(self._link.ask, request))
            except LinkLostError as error:
                trouble = f"the setup `{request.name}` is not confirmed: {error}"
                self._around.sink.event(Level.WARN, trouble)
            yield trouble


PolledProtocol = Union[LineProtocol, BinaryProtocol, PythonProtocol]


def linked(
    port: BytePort, protocol: PolledProtocol, tally: Tally, clock: Callable[[], float] = time.monotonic
) -> Link:
    """Returns a link over an open port in ``protocol``. Raises LinkLostError if its codec cannot be made."""
    try:
        codec, overhear = _codec(protocol), _overhear(protocol)
        return Link(port, codec, protocol.reply_timeout, tally, clock, overhear=overhear)
    except BadReplyError as error:  # a class of the robot type's own that cannot even be made
        port.close()
        raise LinkLostError(str(error)) from error


def _overhear(protocol: PolledProtocol) -> Callable[[bytes], str]:
    if isinstance(protocol, LineProtocol):
        return partial(overheard, protocol=protocol)
    return lambda _: ""


def _codec(protocol: PolledProtocol) -> Codec:
    if isinstance(protocol, BinaryProtocol):
        return BinaryCodec(protocol)
    if isinstance(protocol, PythonProtocol):
        return UserCodec(protocol)
    return LineCodec(protocol)
