"""What each robot's line carries: requests and replies in bytes, and the time they take. Pure numbers.

A driver sends one request at a time and waits for its reply, so a line is full when the exchanges of a second
take a second: the bytes at the line's speed, and the delay between a request and its reply.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from swarmctl.links.link_base import Delay, Line
from swarmctl.links.link_kinds import kinds
from swarmctl.robot_types.driver_params import equipped, rates_of, waits_of
from swarmctl.robot_types.protocols import DriverProtocol, length_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.sensors import Range, Sensor, Wheels
from swarmctl.swarm.command_topics import COMMAND
from swarmctl.swarm.index import SwarmIndex

COMMAND_RATE = 10.0  # Hz of commands if no program declares its rate
MOST_COMMANDS = 50.0  # Hz; a driver sends a new speed at most every 20 ms
LEAST_COMMANDS = 5.0  # Hz; it repeats an unchanged speed after 200 ms
_OFTEN = 2.0  # Hz; a slower sensor does not matter for the load of a line
_SIXTEEN_BITS = len("-32768")
CAREFUL = 0.7  # share of its time above which a late reply delays the next exchange


@dataclass(frozen=True)
class Exchange:
    """A request and its reply, bytes each at their longest, and how often a second they are due."""

    name: str
    rate: float
    request: int
    reply: int
    sensors: tuple[tuple[str, float], ...] = ()  # in the reply, with the rate of each
    wait: float = 0.0  # s that the driver waits for the reply; 0 if it needs no time of its own

    @property
    def bytes(self) -> int:
        """The bytes of request and reply."""
        return self.request + self.reply


@dataclass(frozen=True)
class SerialLoad:
    """The exchanges on a line; one value for all robots with the same type, rates and kind of line."""

    kind: str  # of the line, such as usb-ftdi or bluetooth
    baud: int
    bits: int  # a byte takes on the line, with its start, parity and stop bits
    reply_timeout: float  # s
    exchanges: tuple[Exchange, ...]

    @property
    def needed(self) -> float:
        """Bytes a second, both ways."""
        return sum(one.rate * one.bytes for one in self.exchanges)

    @property
    def available(self) -> float:
        """Bytes a second that the line can carry without pauses."""
        return self.baud / self.bits

    @cached_property
    def slowest(self) -> Exchange | None:
        """The exchange with the longest wait for its reply; None if no reply needs time of its own."""
        return max((one for one in self.exchanges if one.wait), key=lambda one: one.wait, default=None)

    @cached_property
    def delay(self) -> Delay:
        """The time between a request and its reply, by the kind of line."""
        return next(model.delays[self.kind] for _, model in kinds(Line) if self.kind in model.delays)

    def seconds(self, exchange: Exchange) -> float:
        """Returns how long one exchange usually takes."""
        return exchange.bytes / self.available + self.delay.usual

    def held(self, exchange: Exchange) -> float:
        """For how long no other request is sent: a robot that sends a long reply receives nothing."""
        return max(exchange.wait, self.seconds(exchange))

    @cached_property
    def share(self) -> float:
        """Seconds of exchanges in a second, with the usual delay."""
        return sum(one.rate * self.held(one) for one in self.exchanges)

    @cached_property
    def least_share(self) -> float:
        """The same with the shortest possible delay; above 1 no adapter helps."""
        requests = sum(one.rate for one in self.exchanges)
        return self.needed / self.available + requests * self.delay.least

    @cached_property
    def cycle(self) -> float:
        """Seconds for one round of all exchanges."""
        return sum(self.seconds(one) for one in self.exchanges)

    def fitting(self) -> dict[str, float]:
        """Lower rates by sensor with which the load stays below CAREFUL; empty if that is impossible.

        Slow sensors, such as a battery's voltage, keep their rate: they do not fill the line.
        """
        queries = [one for one in self.exchanges if one.sensors and one.rate >= _OFTEN]
        kept = sum(one.rate * self.held(one) for one in self.exchanges if one not in queries)
        scaled = sum(one.rate * self.held(one) for one in queries)
        factor = (CAREFUL - kept) / scaled if scaled else 0.0
        fitting = {
            name: fit
            for one in queries
            for name, rate in one.sensors
            if (fit := _rounded_down(one.rate * min(factor, 1.0))) < rate
        }
        return fitting if all(rate > 0 for rate in fitting.values()) else {}

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {
            "kind": self.kind,
            "baud": self.baud,
            "bytes_per_second": round(self.needed, 1),
            "bytes_per_second_available": round(self.available, 1),
            "share": round(self.share, 3),
            "least_share": round(self.least_share, 3),
            "cycle_seconds": round(self.cycle, 4),
            "exchanges": [
                {"name": one.name, "rate": one.rate, "request": one.request, "reply": one.reply}
                for one in self.exchanges
            ],
        }


def _rounded_down(rate: float) -> float:
    """A rate as a person would write it: a whole number, or tenths below 2 Hz."""
    return float(int(rate)) if rate >= 2 else max(0.0, int(rate * 10) / 10)


class SerialBudget(NamedTuple):
    """The load of one robot's line, and the host it is connected to."""

    robot: str
    host: str
    load: SerialLoad

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {"robot": self.robot, "host": self.host, **self.load.to_json()}


def serial_budgets(index: SwarmIndex) -> Iterator[tuple[int, SerialBudget]]:
    """The budget of every line on which a driver polls, with its index in ``links``.

    Robots with the same type, rates and line share a ``SerialLoad``. Boards with a sketch: `rosserial_load`.
    """
    command_rate = command_rates(index)
    loads: dict[tuple[object, ...], SerialLoad] = {}
    robots, driven = index.spec.robots, index.driven_robots
    polled = {name for name, one in index.native_types.items() if one.driver_protocol is not None}
    for number, link, robot_type in index.native_lines:
        robot = robots[link.robot]
        if robot.type not in polled or link.robot not in driven:
            continue
        kind, baud = link.line_kind, link.own_baud
        commands = command_rate[link.robot]
        own = robot.settings.of_sensors if robot.settings.model_fields_set else None
        key = (robot.type, kind, baud, commands, own)
        load = loads.get(key)
        if load is None:
            layers = index.document.settings_layers(link.robot)
            rates = rates_of(robot_type, *layers)
            load = load_of(equipped(robot_type, *layers), kind, baud or robot_type.link.baud, commands, rates)
            loads[key] = load
        yield number, SerialBudget(link.robot, link.host, load)


def command_rates(index: SwarmIndex, pick: Callable[[float, float], float] = max) -> dict[str, float]:
    """Returns how often each robot receives commands, Hz: as programs declare, else ``COMMAND_RATE``.

    Of several commanders it is the fastest one's, or the one that ``pick`` returns.
    """
    rates: dict[str, float] = {}
    for one in index.endpoints:
        if one.publishes and one.rate is not None:
            for robot in index.robots_by_command.get(one.topic, ()):
                rates[robot] = pick(one.rate, rates.get(robot, one.rate))
    return dict.fromkeys(index.spec.robots, COMMAND_RATE) | rates


def load_of(
    robot_type: RobotType, kind: str, baud: int, commands: float, rates: Mapping[str, float]
) -> SerialLoad:
    """Returns the load of a line by a driver with these ``rates`` of sensors and of ``commands``, Hz."""
    link, protocol = robot_type.link, robot_type.driver_protocol
    if protocol is None:  # a sketch is not polled
        return SerialLoad(kind, baud, link.bits, 0.0, ())
    rate = min(MOST_COMMANDS, max(LEAST_COMMANDS, commands))
    queries = _queries(robot_type, protocol, rates, waits_of(robot_type, baud, rates))
    command = Exchange(COMMAND, rate, *_command(robot_type, protocol))
    return SerialLoad(kind, baud, link.bits, protocol.reply_timeout, (command, *queries))


def _command(robot_type: RobotType, protocol: DriverProtocol) -> tuple[int, int]:
    """Bytes of the longest speed command and its reply: both wheels at full speed backwards, finest units."""
    kinematics = robot_type.kinematics
    units = max(scale.speed_units_per_mps for scale in kinematics.scales)
    fastest = len(str(-round(kinematics.wheel_speed_max * units)))
    request, reply = protocol.set_speed.length(0)
    if protocol.kind == "line":
        request += 2 * fastest - len("{left}{right}")
    return request, reply


def _queries(
    robot_type: RobotType, protocol: DriverProtocol, rates: Mapping[str, float], waits: Mapping[str, float]
) -> Iterator[Exchange]:
    """One exchange for each query, at the rate of its fastest sensors and named after them."""
    for name in protocol.queries:
        fed = {key: one for key, one in robot_type.sensors.items() if (one.read or key) == name}
        on = tuple((key, rates[key]) for key in fed if rates[key] > 0)
        if not on:
            continue
        highest = max(rate for _, rate in on)
        digits = max(_digits(robot_type, one) for one in fed.values())
        label = " + ".join(key for key, rate in on if rate == highest)
        yield Exchange(
            label, highest, *length_of(protocol, name, digits), sensors=on, wait=waits.get(name, 0.0)
        )


def _digits(robot_type: RobotType, sensor: Sensor) -> int:
    """Characters of the longest number in a sensor's reply."""
    match sensor:
        case Range(max_reading=largest):
            return len(str(largest))
        case Wheels():
            return len(str(-(2 ** (robot_type.kinematics.counter_bits - 1))))
    return _SIXTEEN_BITS
