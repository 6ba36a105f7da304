"""Checks of a polled robot's protocol: stop, firmware, queries, actuators, reply times."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from statistics import median

from swarm_onboard.driver import readings
from swarm_onboard.driver.codec import Request, Values
from swarm_onboard.driver.config import Actuator, Sensor
from swarm_onboard.driver.link import FAILED_EXCHANGE, LinkLostError

from swarmctl.conformance.polled_bench import PolledBench
from swarmctl.conformance.results import Result, fail, ok, warn
from swarmctl.robot_types.sensors import SENSORS

_ROUNDS = 3  # of every query
_CLOSE = 0.7  # of the reply timeout; longer replies are almost too late
_WARMTH = (-20.0, 90.0)  # plausible degrees Celsius
_UNCONFIRMED = "sent; the robot answers no command"


def confirms_stop(bench: PolledBench) -> Iterator[Result]:
    """Comes first: a robot that cannot be stopped is not queried."""
    hint = bench.config.serial.hint or "check that the robot is on, the port, and the baud rate"
    try:
        attempts = bench.stop()
    except LinkLostError as error:
        figure = f"{error} at {bench.config.serial.baud} baud"
        yield fail("stop", figure, hint, bench.port.received)
        return
    if not bench.confirms:
        yield ok("stop", _UNCONFIRMED)
        return
    figure = "confirmed" if attempts == 1 else f"confirmed at attempt {attempts}"
    yield ok("stop", figure) if attempts <= 2 else warn("stop", figure, hint)


def reports_firmware(bench: PolledBench) -> Iterator[Result]:
    """The robot answers the request for its firmware version."""
    request = bench.link.codec.identify()
    if request is None:
        yield ok("firmware", "the type has no query for it")
        return

    def identify() -> str:
        bench.firmware = bench.ask_twice(request).text or "unknown"
        return f"{bench.firmware}: {bench.scale.speed_units_per_mps:g} units are 1 m/s"

    yield _tried("firmware", identify, bench, "fix `identify`, or the bounds in `scales`")


def accepts_setup(bench: PolledBench) -> Iterator[Result]:
    """The robot confirms each request of the setup."""

    def confirmed(request: Request) -> str:
        bench.ask(request)
        return "confirmed"

    fix = "fix `setup` of the protocol"
    for request in bench.link.codec.setup():
        yield _tried(f"setup {request.name}", partial(confirmed, request), bench, fix)


def _tried(check: str, exchange: Callable[[], str], bench: PolledBench, fix: str) -> Result:
    """Returns the figure of an exchange, or a failure with the bytes that were received."""
    try:
        return ok(check, exchange())
    except (*FAILED_EXCHANGE, LinkLostError) as error:
        return fail(check, str(error), fix, bench.port.received)


def answers_queries(bench: PolledBench) -> Iterator[Result]:
    """Sends each query several times: checks the count of numbers and their ranges."""
    # A sensor with settings of its own that is off is not set, so its reply is of unknown length.
    on = [one for one in bench.config.sensors if one.rate > 0 or not SENSORS[one.kind].settings_key]
    for name in dict.fromkeys(sensor.read for sensor in on):
        sensors = [one for one in on if one.read == name]
        if bench.config.readable(sensors[0], bench.firmware):
            yield from _answers(bench, name, sensors)
        else:
            yield ok(f"query {name}", f"not sent: the firmware is not {bench.config.firmware_of[name]}'s")


def _answers(bench: PolledBench, name: str, sensors: list[Sensor]) -> Iterator[Result]:
    try:
        replies = [bench.query(name).values for _ in range(_ROUNDS)]
    except FAILED_EXCHANGE as error:
        fix = f"fix the query `{name}`: its request or its reply"
        yield fail(f"query {name}", str(error), fix, bench.port.received)
        return
    for sensor in sensors:
        values = [reply[sensor.first : sensor.first + sensor.count] for reply in replies]
        wrong = next((why for one in values if (why := _implausible(sensor, one))), "")
        if wrong:
            yield warn(f"sensor {sensor.name}", wrong, f"check query, `first` and scale of `{sensor.name}`")
        else:
            yield ok(f"sensor {sensor.name}", _shown(sensor, values[-1]))


def _implausible(sensor: Sensor, values: Values) -> str:
    """Returns why ``values`` are implausible; empty if they are not."""
    settings = sensor.settings
    if sensor.kind == "range":
        largest = settings["max_reading"]
        outside = [one for one in readings.every(values, settings["stride"]) if not 0 <= one <= largest]
        return f"{outside[0]:g} is outside 0 to {largest}" if outside else ""
    if sensor.kind == "battery":
        volts = readings.charge(values, settings).volts
        return f"{volts:.2f} V" if not 0.5 * settings["empty"] <= volts <= 1.5 * settings["full"] else ""
    if sensor.kind == "temperature":
        [degrees] = readings.scaled(values, settings)
        return f"{degrees:.1f} degrees" if not _WARMTH[0] <= degrees <= _WARMTH[1] else ""
    return ""


def _shown(sensor: Sensor, values: Values) -> str:
    if sensor.kind == "battery":
        return f"{readings.charge(values, sensor.settings).volts:.2f} V"
    if sensor.kind == "temperature":
        return f"{readings.scaled(values, sensor.settings)[0]:.1f} degrees"
    return ", ".join(f"{one:g}" for one in values[:8]) + (" ..." if len(values) > 8 else "")


def sets_actuators(bench: PolledBench) -> Iterator[Result]:
    """Sets every light and sound to its maximum and back to 0."""
    for actuator in bench.config.actuators:
        fix = f"fix `send` or `reply` of `{actuator.name}`"
        yield _tried(f"actuator {actuator.name}", partial(_set, bench, actuator), bench, fix)


def _set(bench: PolledBench, actuator: Actuator) -> str:
    for value in (actuator.max, 0):
        values = (value,) * len(actuator.channels)
        for index in range(1 if actuator.at_once else len(values)):
            bench.ask(bench.link.codec.actuator(actuator, index, values))
    return f"0 to {actuator.max} and back to 0"


def answers_in_time(bench: PolledBench) -> Iterator[Result]:
    """Sends many queries in a row; reports reply times of the whole test."""
    read = dict.fromkeys(sensor.read for sensor in bench.config.sensors)
    names = [one for one in read if one not in bench.config.waits]  # these have longer timeouts
    for number in range(bench.pace.questions):
        request = (
            bench.link.codec.query(names[number % len(names)]) if names else bench.link.codec.speed(0, 0)
        )
        try:
            bench.ask(request)
        except FAILED_EXCHANGE:
            continue
    timeout = bench.protocol.reply_timeout
    if not bench.latencies:
        yield ok("replies", "the robot sends no replies, as its type declares")
        return
    ordered = sorted(bench.latencies)
    p99 = ordered[min(len(ordered) - 1, int(0.99 * len(ordered)))]
    figure = (
        f"median {median(ordered) * 1000:.1f}, p99 {p99 * 1000:.1f}, max {ordered[-1] * 1000:.1f} ms "
        f"of {timeout * 1000:g} ms; {bench.unanswered} of {len(ordered) + bench.unanswered} failed"
    )
    share = bench.unanswered / (len(ordered) + bench.unanswered)
    if share > 0.02:
        yield fail("replies", figure, "raise `reply_timeout`, or check the line")
    elif bench.unanswered or p99 > _CLOSE * timeout:
        yield warn("replies", figure, "raise `reply_timeout`: some replies come late or never")
    else:
        yield ok("replies", figure)


def recovers_from_half_a_request(bench: PolledBench) -> Iterator[Result]:
    """Sends half a request, like a cable that is unplugged during it."""
    whole = bench.link.codec.speed(0, 0).data
    if len(whole) > 1:
        bench.port.write(whole[: len(whole) // 2])
    fix = "the robot does not recover from half a request; switch it off and on"
    yield _recovered("half a request", bench, fix)


def recovers_from_a_reconnect(bench: PolledBench) -> Iterator[Result]:
    """The robot answers after its port was closed and opened again."""
    bench.disconnect()
    bench.connect()
    yield _recovered("reconnect", bench, "if opening the port restarts the robot, raise `settle` of the link")


def _recovered(check: str, bench: PolledBench, fix: str) -> Result:
    """Checks how soon a stop is confirmed."""
    began = bench.clock()
    try:
        attempts = bench.stop()
    except LinkLostError as error:
        return fail(check, f"a stop is not confirmed: {error}", fix)
    if not bench.confirms:
        return ok(check, f"a stop is {_UNCONFIRMED}")
    figure = f"{attempts}, {bench.clock() - began:.2f} s"
    if attempts <= 2:  # a driver sends everything twice before it closes the port
        return ok(check, f"a stop is confirmed at attempt {figure}")
    fix = "a driver closes the port after two; it takes a second longer to recover"
    return warn(check, f"a stop is confirmed only at attempt {figure}", fix)
