"""Checks of how it moves: each wheel the right way, at the right speed, never too fast; and that it stops."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from swarm_driver.config import Sensor
from swarm_driver.driver import Driver, Phase
from swarm_driver.kinematics import STANDSTILL, wheel_units
from swarm_driver.orders import Orders
from swarm_driver.outputs import Outputs
from swarm_driver.protocols import PythonProtocol
from swarm_driver.relay import Outgoing, Parameter

from swarmctl.conformance.bench import Bench, Motion, Wire
from swarmctl.conformance.results import Result, Verdict

_CLOSE, _FAR = 0.1, 0.25  # of the ordered speed: what slip and a loaded host explain, and what nothing does
_STILL = 0.02  # of the wheels' top speed: a wheel that turns less than this stands
_SLOW = 0.3  # of the top speed
_MUCH = 10.0  # times the top speed
_ORDERS = 0.6  # s
_READY = 10.0  # s
_LATE = 0.1  # s that a stop may come after its time, beside a reply that is waited for


def drives_as_ordered(bench: Bench) -> Iterator[Result]:
    """Both ways, slow and at the limit; each wheel alone; a turn on the spot."""
    odometer = bench.odometer
    if odometer is None:
        yield Result("motion", Verdict.WARN, "the type has no position counters: nothing can be measured")
        return
    built = bench.config.kinematics
    top = min(built.linear_max, built.wheel_speed_max)
    slow, turn = _slow(bench), built.wheel_separation
    half = slow / 2
    for name, linear, angular in (
        ("forward, slow", slow, 0.0),
        ("backward, slow", -slow, 0.0),
        ("forward, at the limit", top, 0.0),
        ("backward, at the limit", -top, 0.0),
        ("left wheel alone", half, -slow / turn),
        ("right wheel alone", half, slow / turn),
        ("turn to the left", 0.0, 2 * half / turn),
    ):
        yield judged(name, bench.motion(odometer, linear, angular), bench)


def judged(name: str, motion: Motion, bench: Bench) -> Result:
    """What the counters say of one motion."""
    figure = "{:+.3f} {:+.3f} m/s of {:+.3f} {:+.3f}".format(*motion.measured, *motion.ordered)
    still = _STILL * bench.config.kinematics.wheel_speed_max + 2 * motion.resolution
    swapped = (motion.measured[1], motion.measured[0])
    if all(abs(one) <= still for one in motion.measured):
        return Result(
            name, Verdict.FAIL, figure, "the counters stand: do the wheels turn? mend the query of `odom`"
        )
    if _ways(swapped, still) == _ways(motion.ordered, still) != _ways(motion.measured, still):
        mend = "the sides are swapped: swap {left} and {right} in `set_speed`, or the order of the counters"
        return Result(name, Verdict.FAIL, figure, mend)
    if _ways(motion.measured, still) != _ways(motion.ordered, still):
        mend = (
            "a counter runs the wrong way, or with the wrong wheel: mend `set_speed` or the query of `odom`"
        )
        return Result(name, Verdict.FAIL, figure, mend)
    ratios = [
        there / said for there, said in zip(motion.measured, motion.ordered, strict=True) if abs(said) > still
    ]
    worst = max(ratios, key=lambda one: abs(one - 1))
    least = min(abs(said) for said in motion.ordered if abs(said) > still)
    off = max(0.0, abs(worst - 1) - 2 * motion.resolution / least)
    if off <= _CLOSE:
        return Result(name, Verdict.OK, figure)
    return Result(name, Verdict.FAIL if off > _FAR else Verdict.WARN, figure, _scales(bench, worst))


def _ways(speeds: tuple[float, float], still: float) -> tuple[int, ...]:
    """Forward 1, backward -1, standing 0."""
    return tuple(0 if abs(one) <= still else 1 if one > 0 else -1 for one in speeds)


def _scales(bench: Bench, ratio: float) -> str:
    units, metres = bench.scale.speed_units_per_mps / ratio, bench.scale.metres_per_count / ratio
    return (
        f"{ratio:.2f} times as fast as ordered: speed_units_per_mps: {units:.4g}, or metres_per_count: "
        f"{metres:.4g}; a tape measure tells which"
    )


def stands_after_a_stop(bench: Bench) -> Iterator[Result]:
    """A confirmed stop is one: nothing moves after it."""
    odometer = bench.odometer
    if odometer is None:
        return
    with bench.driving(_slow(bench), 0.0):
        time.sleep(bench.pace.settle)
    time.sleep(bench.pace.settle)
    moving, figure = _moving(bench, odometer)
    if moving:
        mend = "the robot confirms a stop and goes on: mend `set_speed`"
        yield Result("stands after a stop", Verdict.FAIL, figure, mend)
    else:
        yield Result("stands after a stop", Verdict.OK, figure)


def _slow(bench: Bench) -> float:
    """A forward speed of no danger, m/s, that its wheels can go."""
    built = bench.config.kinematics
    return max(_SLOW * min(built.linear_max, built.wheel_speed_max), built.wheel_speed_min)


def _moving(bench: Bench, odometer: Sensor) -> tuple[bool, str]:
    """Whether the wheels turn now; nothing is said to them meanwhile."""
    before = bench.counters(odometer)
    time.sleep(bench.pace.measure / 2)
    after = bench.counters(odometer)
    fastest = max(abs(one) for one in bench.way(before, after)) / (after.stamp - before.stamp)
    return fastest > _STILL * bench.config.kinematics.wheel_speed_max, f"{fastest:.3f} m/s"


def stops_for_its_dead_man(bench: Bench) -> Iterator[Result]:
    """The whole driver at work: an order far beyond the limit, then none. What goes out on the wire, when?"""
    stop = bench.link.codec.speed(*STANDSTILL).data
    bench.disconnect()
    orders = Orders()
    wires: list[Wire] = []
    try:
        last = _ordered(bench, orders, wires)
        told = [(at, data) for wire in wires for at, data in wire.written if at > last[0]]
    finally:
        bench.connect()
        bench.stop()
    yield _limited(bench, told, last[0])
    stopped = next((at for at, data in told if data == stop and at > last[1]), None)
    timeout = bench.config.command_timeout
    if stopped is None:
        yield Result("dead-man of the driver", Verdict.FAIL, "no stop is seen on the wire", "report this")
        return
    took = stopped - last[1]
    late = took > timeout + bench.protocol.reply_timeout + _LATE
    mend = "replies that come late hold it up: see there" if late else ""
    yield Result(
        "dead-man of the driver", Verdict.FAIL if late else Verdict.OK,
        f"{took:.3f} s from the last order to the stop; {timeout:g} s is set", mend,
    )  # fmt: skip


def _ordered(bench: Bench, orders: Orders, wires: list[Wire]) -> tuple[float, float]:
    """Run a driver with orders for a while, then without; when its first and its last order came."""

    def opened() -> Wire:
        wires.append(Wire(bench.open_port()))
        return wires[-1]

    outputs = Outputs(bench.config.actuators, orders.ring)
    driver = Driver(bench.config, orders, Silence(), outputs, NoBoard(), open_port=opened)
    try:
        _run(driver, orders, _READY, until=lambda: driver.phase is Phase.READY)
        first = time.monotonic()
        while (last := time.monotonic()) < first + _ORDERS:
            orders.put((_MUCH * bench.config.kinematics.wheel_speed_max, 0.0, 0.0), (0.0, 0.0, 0.0))
            _run(driver, orders, 0.05)
        last = orders.latest.stamp if orders.latest else last
        _run(driver, orders, bench.config.command_timeout + 2 * bench.protocol.reply_timeout + 0.3)
    finally:
        driver.close()
    return first, last


def _run(driver: Driver, orders: Orders, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
    end = time.monotonic() + seconds
    while not until() and time.monotonic() < end:
        orders.wait(min(driver.step(), end - time.monotonic()))


def _limited(bench: Bench, told: list[tuple[float, bytes]], first: float) -> Result:
    """Of what went out, all is known: questions, stops, and the one speed that is the limit."""
    most = wheel_units(
        _MUCH * bench.config.kinematics.wheel_speed_max, 0.0, bench.config.kinematics, bench.scale
    )
    check, figure = (
        "limits",
        "{:g} m/s is said as {} {}".format(_MUCH * bench.config.kinematics.wheel_speed_max, *most),
    )
    if isinstance(bench.protocol, PythonProtocol):
        return Result(check, Verdict.OK, f"{figure} to the class")
    codec = bench.link.codec
    allowed = {codec.speed(*most).data, codec.speed(*STANDSTILL).data}
    allowed |= {codec.query(sensor.read).data for sensor in bench.config.sensors}
    strange = [data for at, data in told if at > first and data not in allowed]
    if strange or codec.speed(*most).data not in {data for _, data in told}:
        return Result(check, Verdict.FAIL, f"{strange[:1]} goes out", "report this")
    return Result(check, Verdict.OK, figure)


def stops_by_itself(bench: Bench) -> Iterator[Result]:
    """What becomes of a robot whose driver is killed: the line is dropped in motion, without a stop."""
    odometer = bench.odometer
    if odometer is None:
        return
    with bench.driving(_slow(bench), 0.0) as units:
        bench.go_on(units, bench.pace.settle)
        before = bench.counters(odometer)
        bench.disconnect()
        time.sleep(bench.pace.silence)
        bench.connect()
        after = bench.counters(odometer)
        moving, _ = _moving(bench, odometer)
    driven = abs(bench.way(before, after)[0])
    yield _judged_silence(moving, driven * bench.scale.speed_units_per_mps / abs(units[0]), bench)


def _judged_silence(moving: bool, seconds: float, bench: Bench) -> Result:
    check, declared = "driver killed in motion", bench.firmware_dead_man
    if moving and declared:
        return Result(
            check, Verdict.FAIL, f"it still drives after {bench.pace.silence:g} s",
            "the type says that it stops by itself: write `firmware_dead_man: false`, or mend its firmware",
        )  # fmt: skip
    if moving:
        return Result(check, Verdict.OK, f"it still drives after {bench.pace.silence:g} s, as its type says")
    if not declared:
        return Result(
            check, Verdict.WARN, f"it stops by itself after {seconds:.2f} s",
            "good: write `firmware_dead_man: true`",
        )  # fmt: skip
    return Result(check, Verdict.OK, f"it stops by itself after {seconds:.2f} s, as its type says")


class NoBoard:
    """The topics of a board that is none."""

    def type_of(self, name: str) -> None:
        return None

    def serve(self, topics: object) -> None: ...

    def publish(self, topic: object, message: bytes) -> None: ...

    def log(self, level: int, text: str) -> None: ...

    def ask(self, name: str) -> None: ...

    def taken(self) -> list[Outgoing | Parameter]:
        return []


class Silence:
    """Takes a driver's news and keeps them to itself."""

    def odometry(self, pose: object) -> None: ...

    def reading(self, sensor: object, values: object) -> None: ...

    def report(self, report: object) -> None: ...

    def event(self, level: object, text: str) -> None: ...
