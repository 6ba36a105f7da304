"""What each robot's line carries: requests and replies in bytes, and the time they take. Pure numbers.

A driver has one request on the line at a time and waits for its reply, so a line is full when the exchanges
of a second take a second: the bytes at the line's speed, and the wait between a request and its reply.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from swarmctl.spec.model import Bluetooth, Serial, Spec
from swarmctl.spec.protocols import Asked
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.sensors import Range, Sensor, Wheels
from swarmctl.spec.settings import RobotSettings
from swarmctl.spec.tuning import equipped, rates_of, waits_of
from swarmctl.topology import names
from swarmctl.topology.interfaces import COMMAND, Endpoint

FTDI = "0403"  # vendor id of Future Technology Devices International (usb.ids)
COMMAND_RATE = 10.0  # Hz of orders where no program says how often it sends them
MOST_COMMANDS = 50.0  # Hz; a driver says a new speed every 20 ms at most
LEAST_COMMANDS = 5.0  # Hz; it says an unchanged one again after 200 ms
_OFTEN = 2.0  # Hz; below that a sensor fills no line
_SIXTEEN_BITS = len("-32768")
CAREFUL = 0.7  # share of its time above which a line has no room for a reply that comes late

# Seconds between the end of a request and its reply. An FTDI adapter hands over what it has when its latency
# timer runs out (AN232B-04): 16 ms, or the 1 ms that our udev rule sets and a USB frame of 1 ms to fetch it.
# An unknown adapter counts as one left as it came; none is faster than such a frame. By Bluetooth, an e-puck
# brings all its sensors but the camera in one exchange at about 30 Hz (epuck_driver's launch file), 20 ms of
# which are no bytes; request and reply take four slots of 625 us at least.
USUAL_DELAY = {"usb": 0.016, "usb-ftdi": 0.002, "uart": 0.002, "bluetooth": 0.020}
LEAST_DELAY = {"usb": 0.001, "usb-ftdi": 0.001, "uart": 0.0, "bluetooth": 0.0025}


@dataclass(frozen=True)
class Exchange:
    """A request and its reply, bytes each at their longest, and how often a second they are due."""

    name: str
    rate: float
    request: int
    reply: int
    sensors: tuple[tuple[str, float], ...] = ()  # whose numbers the reply has, and how often they want them
    wait: float = 0.0  # s that the driver gives its reply, where that takes a time of its own

    @property
    def bytes(self) -> int:
        return self.request + self.reply


@dataclass(frozen=True)
class Load:
    """What is asked of a line: the same for all robots of a type whose rates and lines are alike."""

    kind: str  # usb, usb-ftdi, uart or bluetooth
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
        """Bytes a second that the line could carry without a pause."""
        return self.baud / self.bits

    @cached_property
    def slowest(self) -> Exchange | None:
        """The one whose reply is waited for longest, of those that take a time of their own."""
        return max((one for one in self.exchanges if one.wait), key=lambda one: one.wait, default=None)

    def seconds(self, exchange: Exchange) -> float:
        """How long one exchange usually takes."""
        return exchange.bytes / self.available + USUAL_DELAY[self.kind]

    def held(self, exchange: Exchange) -> float:
        """For how long nothing else is asked: a robot that makes an image, and sends it, hears nothing."""
        return max(exchange.wait, self.seconds(exchange))

    @cached_property
    def share(self) -> float:
        """Seconds of exchanges in a second, with the wait that is usual."""
        return sum(one.rate * self.held(one) for one in self.exchanges)

    @cached_property
    def least_share(self) -> float:
        """The same with the shortest wait there can be; above 1 nothing helps."""
        requests = sum(one.rate for one in self.exchanges)
        return self.needed / self.available + requests * LEAST_DELAY[self.kind]

    @cached_property
    def cycle(self) -> float:
        """Seconds until every exchange has had its turn."""
        return sum(self.seconds(one) for one in self.exchanges)

    def fitting(self) -> dict[str, float]:
        """The sensors' rates scaled down until they fit with room to spare; none if that is not enough.

        What comes rarely, as a battery's voltage does, stays: it is not what fills the line.
        """
        questions = [one for one in self.exchanges if one.sensors and one.rate >= _OFTEN]
        kept = sum(one.rate * self.held(one) for one in self.exchanges if one not in questions)
        asked = sum(one.rate * self.held(one) for one in questions)
        factor = (CAREFUL - kept) / asked if asked else 0.0
        fitting = {
            name: fit
            for one in questions
            for name, rate in one.sensors
            if (fit := _rounded_down(one.rate * min(factor, 1.0))) < rate
        }
        return fitting if all(rate > 0 for rate in fitting.values()) else {}


def _rounded_down(rate: float) -> float:
    """A rate as people write it: whole numbers, and tenths where it is low."""
    return float(int(rate)) if rate >= 2 else max(0.0, int(rate * 10) / 10)


@dataclass(frozen=True)
class LineBudget:
    """One robot's line, and the host at its other end."""

    robot: str
    host: str
    load: Load

    def to_json(self) -> dict[str, object]:
        load = self.load
        return {
            "robot": self.robot,
            "host": self.host,
            "kind": load.kind,
            "baud": load.baud,
            "bytes_per_second": round(load.needed, 1),
            "bytes_per_second_available": round(load.available, 1),
            "share": round(load.share, 3),
            "least_share": round(load.least_share, 3),
            "cycle_seconds": round(load.cycle, 4),
            "exchanges": [
                {"name": one.name, "rate": one.rate, "request": one.request, "reply": one.reply}
                for one in load.exchanges
            ],
        }


def line_budgets(
    spec: Spec, types: Mapping[str, RobotType], endpoints: Sequence[Endpoint]
) -> Iterator[tuple[int, LineBudget]]:
    """Every line that a driver asks on, with its index in ``links``. Robots that are alike share a ``Load``.

    What a board's sketch says is counted in topology/boards.
    """
    ordered = command_rates(spec, endpoints)
    loads: dict[tuple[object, ...], Load] = {}
    asked = {name for name, one in types.items() if one.asked is not None}
    for index, link in enumerate(spec.links):
        if not isinstance(link, (Serial, Bluetooth)):
            continue
        robot = spec.robots[link.robot]
        if robot.type not in asked:
            continue
        own, kind = robot.settings.rates, line_kind(link)
        baud = link.baud if isinstance(link, Serial) else None
        commands = ordered.get(link.robot, COMMAND_RATE)
        key = (robot.type, kind, baud, commands, robot.settings.camera, *sorted(own.items()))
        load = loads.get(key)
        if load is None:
            robot_type = types[robot.type]
            said = layers(spec, robot_type, robot.settings)
            rates = rates_of(robot_type, *said)
            load = load_of(equipped(robot_type, *said), kind, baud or robot_type.link.baud, commands, rates)
            loads[key] = load
        yield index, LineBudget(link.robot, link.host, load)


def layers(spec: Spec, robot_type: RobotType, own: RobotSettings) -> tuple[RobotSettings, ...]:
    """The settings of one robot from general to special, as ``resolve`` merges them."""
    return spec.defaults.robot, robot_type.settings, own


def line_kind(link: Serial | Bluetooth) -> str:
    if isinstance(link, Bluetooth):
        return "bluetooth"
    if link.usb is None:
        return "uart"
    return "usb-ftdi" if link.usb.vendor == FTDI else "usb"


def command_rates(spec: Spec, endpoints: Sequence[Endpoint]) -> dict[str, float]:
    """How often a robot is given orders, Hz, as far as programs say how often they publish them."""
    said: dict[str, float] = {}
    for one in endpoints:
        if one.publishes and one.rate is not None and one.topic.endswith(COMMAND):
            said[one.topic] = max(one.rate, said.get(one.topic, 0.0))
    if not said:
        return {}
    topics = {f"{names.namespace(robot)}/{COMMAND}": robot for robot in spec.robots}
    return {topics[topic]: rate for topic, rate in said.items() if topic in topics}


def load_of(robot_type: RobotType, kind: str, baud: int, commands: float, rates: Mapping[str, float]) -> Load:
    """What a driver with these ``rates`` asks of its line while it is given ``commands`` orders a second."""
    link, protocol = robot_type.link, robot_type.asked
    if protocol is None:  # nobody asks a sketch
        return Load(kind, baud, link.bits, 0.0, ())
    said = min(MOST_COMMANDS, max(LEAST_COMMANDS, commands))
    questions = _questions(robot_type, protocol, rates, waits_of(robot_type, baud, rates))
    order = Exchange(COMMAND, said, *_order(robot_type, protocol))
    return Load(kind, baud, link.bits, protocol.reply_timeout, (order, *questions))


def _order(robot_type: RobotType, protocol: Asked) -> tuple[int, int]:
    """Bytes of the longest order and its reply: both wheels backwards at their fastest, in finest units."""
    kinematics = robot_type.kinematics
    units = max(scale.speed_units_per_mps for scale in kinematics.scales)
    fastest = len(str(-round(kinematics.wheel_speed_max * units)))
    request, reply = protocol.set_speed.length(0)
    if protocol.kind == "line":
        request += 2 * fastest - len("{left}{right}")
    return request, reply


def _questions(
    robot_type: RobotType, protocol: Asked, rates: Mapping[str, float], waits: Mapping[str, float]
) -> Iterator[Exchange]:
    """One exchange a query, as often as the sensor wants it that wants it most often; it gives its name."""
    for name, query in protocol.queries.items():
        fed = {key: one for key, one in robot_type.sensors.items() if (one.read or key) == name}
        on = tuple((key, rates[key]) for key in fed if rates[key] > 0)
        if not on:
            continue
        rate = max(wanted for _, wanted in on)
        digits = max(_digits(robot_type, one) for one in fed.values())
        called = " + ".join(key for key, wanted in on if wanted == rate)
        yield Exchange(called, rate, *query.length(digits), sensors=on, wait=waits.get(name, 0.0))


def _digits(robot_type: RobotType, sensor: Sensor) -> int:
    """Characters of the longest number that a sensor reads."""
    match sensor:
        case Range(max_reading=largest):
            return len(str(largest))
        case Wheels():
            return len(str(-(2 ** (robot_type.kinematics.counter_bits - 1))))
    return _SIXTEEN_BITS
