"""One connection to a robot that has confirmed a stop: sends commands, applies the dead-man, reads sensors.

A session's state ends with it: nothing from before a lost line can move the robot after it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Callable, Protocol, Sequence

from swarm_onboard.command.battery_watch import BatteryWatch
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.dead_man import DeadMan
from swarm_onboard.command.report import Level, Report
from swarm_onboard.driver.actuators import ActuatorSettings, Change, SentSettings
from swarm_onboard.driver.codec import BadReplyError, Values
from swarm_onboard.driver.config import Config, Scale, Sensor
from swarm_onboard.driver.kinematics import (
    STANDSTILL,
    TRUSTED_SHARE,
    Counters,
    Odometry,
    Pose,
    Units,
    wheel_units,
)
from swarm_onboard.driver.link import FAILED_EXCHANGE, Link, LinkLostError
from swarm_onboard.driver.readings import charge
from swarm_onboard.driver.tally import Meter, Tally

COMMAND_REFRESH_S = 0.2  # s after which an unchanged speed is repeated; a lost robot is noticed that soon
MIN_COMMAND_GAP_S = 0.02  # s between two changes of speed, so that fast commands leave time for the sensors
EARLY_POLL_SHARE = 0.5  # of a poll's period by which a slower sensor may have its turn before it is due
RETRY_AFTER_S = 1.0  # s for which a sensor or a light that failed is left alone
TX_MARGIN = 3  # times what a request takes on the line, after one that no reply holds up
_PERIODS = 3  # of a slow sensor, over which its rate is measured, and for which a battery's reading is recent
_SHORTEST_CHARGE = 5.0  # s for which it is recent at least


class Sink(Protocol):
    """Receives a driver's data; ``ros.RosSink`` publishes it."""

    def odometry(self, pose: Pose) -> None:
        """Takes a new pose."""

    def reading(self, sensor: Sensor, values: Values) -> None:
        """Takes the raw numbers of a sensor."""

    def report(self, report: Report) -> None:
        """Takes the state of the driver, as /diagnostics shows it."""

    def event(self, level: Level, text: str) -> None:
        """Takes a line for the log."""


@dataclass
class Feed:
    """A sensor that one poll feeds; ``due`` is when it wants numbers again."""

    sensor: Sensor
    due: float
    meter: Meter = field(init=False)

    def __post_init__(self) -> None:
        self.meter = Meter(max(5.0, _PERIODS / self.sensor.rate))


@dataclass
class Poll:
    """A query that is sent regularly, as often as the fastest of its sensors needs."""

    query: str
    rate: float
    feeds: list[Feed]
    due: float
    wait: float | None = None  # s for its answer, where that takes a time of its own


class Session:
    """Serves one robot over ``link`` until an exchange raises ``LinkLostError`` or ``PortError``."""

    def __init__(
        self,
        link: Link,
        config: Config,
        scale: Scale,
        *,
        odometry: Odometry,
        commands: CommandMailbox,
        outputs: ActuatorSettings,
        sink: Sink,
        tally: Tally,
        battery: BatteryWatch,
        clock: Callable[[], float],
        slow: bool = True,
        left_out: Sequence[Sensor] = (),
    ) -> None:
        """``slow``: whether queries whose answers take longer than usual may be sent.

        The sensors that are ``left_out`` are not read.
        """
        self.since = clock()
        self.odometry = odometry
        self._link = link
        self._config = config
        self._scale = scale
        self._dead_man = DeadMan(commands, config.command_timeout, clock)
        self._sink = sink
        self._tally = tally
        self._battery = battery
        self._clock = clock
        self._slow = slow
        self._left_out = [one.name for one in left_out]
        self._polls = self._planned_polls(config.sensors, self.since)
        self._shown, self._show_at, self._showed = SentSettings(outputs, self.since), self.since, False
        self._confirmed: Units | None = STANDSTILL  # none while it is not known what the robot does
        self._sent_at = self.since
        self._aim = STANDSTILL

    def step(self) -> float:
        """One exchange at most, the most urgent one; then the moment at which the next is due."""
        now = self._clock()
        aim = self._wanted()
        if self._speed_due(aim) <= now:
            self._send_speed(aim)
        else:
            self._serve(now, aim)
        return self._next_due()

    def take(self, config: Config) -> None:
        """Works with the live values of ``config`` from now on."""
        self._config = config
        self._dead_man.timeout = config.command_timeout
        self._polls = self._planned_polls(config.sensors, self._clock())

    def activity(self) -> str:
        """What the robot is doing, in words."""
        return self._dead_man.activity(self._aim != STANDSTILL)

    def zero_at(self) -> float | None:
        """Returns when the robot last confirmed a zero; None while it may have another speed."""
        return self._sent_at if self._confirmed == STANDSTILL else None

    def wheel_step(self) -> float | None:
        """Returns the way of a wheel from one count to the next, in m; None if the wheels are not read."""
        wheels = any(feed.sensor.kind == "wheels" for poll in self._polls for feed in poll.feeds)
        return self._scale.metres_per_count if wheels else None

    def rates(self) -> list[tuple[str, float, float]]:
        """Name, measured and wanted rate of every sensor, in Hz."""
        now = self._clock()
        feeds = (feed for poll in self._polls for feed in poll.feeds)
        return [(feed.sensor.name, feed.meter.rate(now), feed.sensor.rate) for feed in feeds]

    def _wanted(self) -> Units:
        command = self._dead_man.in_force()
        if command is None:
            return STANDSTILL
        return wheel_units(
            command.velocity.forward, command.velocity.turn, self._config.kinematics, self._scale
        )

    def _speed_due(self, aim: Units) -> float:
        """Returns when ``aim`` must be sent: at once for a stop, or if the robot's speed is unknown."""
        if aim == self._confirmed:
            return self._sent_at + COMMAND_REFRESH_S
        return (
            -math.inf if self._confirmed is None or aim == STANDSTILL else self._sent_at + MIN_COMMAND_GAP_S
        )

    def _send_speed(self, aim: Units) -> None:
        if aim == STANDSTILL != self._aim and self._dead_man.expired():
            self._tally.dead_man_trips += 1
        self._aim = aim
        try:
            self._link.set_speed(*aim)
        except FAILED_EXCHANGE as error:
            self._failed(error)
            if self._confirmed is None:
                raise LinkLostError(str(error)) from error
            self._confirmed = None  # the second attempt says what is wanted by then
        else:
            self._confirmed, self._sent_at = aim, self._clock()
            self._tally.transfers.add(self._sent_at, right=1)

    def _serve(self, now: float, aim: Units) -> None:
        """Reads the sensor that is most overdue, or sends an actuator setting; in turns if both are due."""
        due = [one for one in self._polls if one.due <= now and self._fits(one, now, aim)]
        poll = min(due, key=lambda one: one.due, default=None)
        change = self._shown.next() if self._show_at <= now else None
        # What keeps silent must not hold up the dead-man.
        patience = self._dead_man_due() - now
        self._showed = change is not None and (poll is None or not self._showed)
        if change is not None and self._showed:
            self._show(change, patience)
        elif poll is not None:
            self._read(poll, patience)

    def _show(self, change: Change, patience: float) -> None:
        try:
            request = self._link.codec.actuator(change.actuator, change.index, change.values)
            self._link.ask(request, patience)
        except FAILED_EXCHANGE as error:
            self._failed(error)
            if not isinstance(error, BadReplyError):
                self._show_at = self._clock() + RETRY_AFTER_S
                return
        else:
            if request.answered:
                self._tally.transfers.add(self._clock(), right=1)
            else:  # what the line has not carried yet would hold up a stop
                self._show_at = self._clock() + TX_MARGIN * len(request.data) * 10 / self._config.serial.baud
        self._shown.mark_sent(change)  # not repeated to a robot that refuses it

    def _fits(self, poll: Poll, now: float, aim: Units) -> bool:
        """Whether its answer is over before the dead-man is due.

        A robot that is sending a long answer receives no stop before it is done, so waiting less would not
        help; nor does it receive a speed that is about to be sent.
        """
        if poll.wait is None or poll.wait <= self._link.reply_timeout:
            return True
        return self._slow and aim == self._confirmed and now + poll.wait <= self._dead_man_due()

    def _read(self, poll: Poll, patience: float) -> None:
        if poll.wait is not None and self._link.settle(patience):
            return  # and check anew whether there is time
        try:
            reply = self._link.ask(self._link.codec.query(poll.query), patience, poll.wait)
        except FAILED_EXCHANGE as error:
            self._failed(error)
            if poll.wait is not None:  # the rest of an answer that is too long would garble that to a speed
                self._link.settle(self._dead_man_due() - self._clock())
            poll.due = self._clock() + max(RETRY_AFTER_S, 1 / poll.rate)
            return
        arrived = self._clock()
        self._tally.transfers.add(arrived, right=1)
        poll.due = max(poll.due + 1 / poll.rate, arrived)
        for feed in poll.feeds:
            if feed.due <= arrived + EARLY_POLL_SHARE / poll.rate:
                feed.due = max(feed.due + 1 / feed.sensor.rate, arrived)
                feed.meter.tick(arrived)
                self._take(feed.sensor, reply.values, arrived)

    def _failed(self, error: Exception) -> None:
        self._tally.failed(error)
        self._tally.transfers.add(self._clock(), wrong=1)

    def _dead_man_due(self) -> float:
        return self._dead_man.due() if self._aim != STANDSTILL else math.inf

    def _next_due(self) -> float:
        now, aim = self._clock(), self._wanted()
        show_due = self._show_at if self._shown.next() else math.inf
        # What does not fit now is checked again with the next command, which rings, or once the robot stands.
        polls = (poll.due for poll in self._polls if self._fits(poll, now, aim))
        return min([self._speed_due(aim), self._dead_man_due(), show_due, *polls])

    def _planned_polls(self, sensors: Sequence[Sensor], due: float) -> list[Poll]:
        fed: dict[str, list[Feed]] = {}
        for sensor in sensors:
            if sensor.rate > 0 and sensor.name not in self._left_out:
                fed.setdefault(sensor.read, []).append(Feed(sensor, due))
        return [
            Poll(
                query,
                max(feed.sensor.rate for feed in feeds),
                feeds,
                due=due,
                wait=self._config.waits.get(query),
            )
            for query, feeds in fed.items()
        ]

    def _take(self, sensor: Sensor, numbers: Values, arrived: float) -> None:
        values = numbers[sensor.first : sensor.first + sensor.count]
        if not all(math.isfinite(value) for value in values):
            self._tally.failed(BadReplyError(f"`{sensor.name}` has a value that is not a number"))
            return
        if sensor.kind == "battery":
            recent = max(_SHORTEST_CHARGE, _PERIODS / sensor.rate)
            self._battery.take(charge(values, sensor.settings).share, recent)
        if sensor.kind != "wheels":
            self._sink.reading(sensor, values)
            return
        left, right = (int(value) for value in values)
        reading = Counters(left, right, arrived)
        trusted = TRUSTED_SHARE / sensor.rate
        self.odometry = self.odometry.update(reading, self._config.kinematics, self._scale, trusted)
        self._sink.odometry(self.odometry.pose)
