"""Checks with the whole driver at work: its limits, and its dead-man, as they go out on the wire."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise

from swarm_driver.driver import Driver, Phase
from swarm_driver.kinematics import Pose
from swarm_driver.orders import Orders
from swarm_driver.outputs import Outputs

from swarmctl.conformance.results import Result, Verdict
from swarmctl.conformance.wheeled import Wheeled
from swarmctl.conformance.wire import Wire

_MUCH = 10.0  # times the top speed
_TOO_SLOW, _TOO_FAST = 0.5, 1.25  # times the limit, measured over half a second
_SETTLED = 0.3  # s after the first order, from which the wheels are measured
_ORDERS, _MOST_ORDERS = 0.9, 3.0  # s; more on a loaded machine, until the wheels were measured
_EVERY = 0.05  # s
_READY = 10.0  # s
_LATE = 0.1  # s that a stop may come after its time, beside a reply that is waited for
_WHEELS_LATE = 0.4  # s more than that until counters, read ten times a second, stand


@dataclass
class Run:
    """What a driver did: what it wrote, when its first and its last order came, where it saw the robot."""

    clock: Callable[[], float]
    written: list[tuple[float, bytes]] = field(default_factory=list)
    first: float = 0.0
    last: float = 0.0
    poses: list[tuple[float, Pose]] = field(default_factory=list)

    def odometry(self, pose: Pose) -> None:
        self.poses.append((self.clock(), pose))

    def reading(self, sensor: object, values: object) -> None: ...

    def report(self, report: object) -> None: ...

    def event(self, level: object, text: str) -> None: ...

    @property
    def told(self) -> list[tuple[float, bytes]]:
        """What went out from the first order on."""
        return [(at, data) for at, data in self.written if at > self.first]

    @property
    def speed(self) -> float | None:
        """Of the faster wheel while orders came, m/s, as the driver measured it."""
        seen = [(at, one) for at, one in self.poses if self.first + _SETTLED <= at <= self.last]
        if len(seen) < 2:
            return None
        (began, before), (ended, after) = seen[0], seen[-1]
        return max(abs(after.left - before.left), abs(after.right - before.right)) / (ended - began)

    @property
    def stood(self) -> float | None:
        """When the wheels were first seen standing after the last order; nothing if they never were."""
        after = [one for one in self.poses if one[0] > self.last]
        still = [
            at for (_, before), (at, now) in pairwise(after)
            if (before.left, before.right) == (now.left, now.right)
        ]  # fmt: skip
        return still[0] if still else None


def stops_for_its_dead_man(bench: Wheeled) -> Iterator[Result]:
    """An order far beyond the limit again and again, then none. What goes out, and when?"""
    built = bench.config.kinematics
    asked = _MUCH * built.wheel_speed_max
    stop, limit, harmless = bench.speed_said(0.0), bench.speed_said(asked), bench.harmless()
    bench.disconnect()
    try:
        run = _run(bench, asked)
    finally:
        bench.connect()
        bench.stop()
    if stop is None or limit is None:
        yield from _seen_at_the_wheels(bench, run, asked, min(built.linear_max, built.wheel_speed_max))
        return
    halt = stop[0]
    stopped = next((at for at, data in run.told if at > run.last and data == halt), None)
    yield _limited(run, asked, limit, lambda data: data == halt or harmless(data))
    yield _dead_man(bench, run, stopped, _LATE)


def _run(bench: Wheeled, linear: float) -> Run:
    """A driver with orders for a while, then without."""
    run, wires = Run(bench.clock), list[Wire]()

    def opened() -> Wire:
        wires.append(Wire(bench.open_port(), bench.clock))
        return wires[-1]

    orders = Orders(bench.clock)
    outputs = Outputs(bench.config.actuators, orders.ring, bench.clock)
    driver = Driver(
        bench.config, orders, run, outputs, bench.relay, open_port=opened, clock=bench.clock
    )  # fmt: skip

    def live(seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        end = bench.clock() + seconds
        while not until() and bench.clock() < end:
            left = max(0.0, min(driver.step(), end - bench.clock()))
            (wires[-1].wait if driver.listens_to() else bench.sleep)(left)

    try:
        live(_READY, until=lambda: driver.phase is Phase.READY)
        run.first = bench.clock()
        while bench.clock() < run.first + (_ORDERS if run.speed or not bench.counts else _MOST_ORDERS):
            run.last = bench.clock()
            orders.put((linear, 0.0, 0.0), (0.0, 0.0, 0.0), run.last)
            live(_EVERY)
        live(bench.config.command_timeout + 2 * bench.reply_timeout + 0.3)
        run.written = [one for wire in wires for one in wire.written]
    finally:
        driver.close()
    return run


def _limited(run: Run, asked: float, limit: tuple[bytes, str], idle: Callable[[bytes], bool]) -> Result:
    """Of what went out, all is known: questions, stops, and the one speed that is the limit."""
    data, shown = limit
    strange = [one for _, one in run.told if one != data and not idle(one)]
    if strange or data not in {one for _, one in run.told}:
        return Result("limits", Verdict.FAIL, f"{strange[:1]} goes out for {asked:g} m/s", "report this")
    return Result("limits", Verdict.OK, f"{asked:g} m/s is said as {shown}")


def _seen_at_the_wheels(bench: Wheeled, run: Run, asked: float, most: float) -> Iterator[Result]:
    """Where a class may say the same thing in other bytes each time, the wheels tell."""
    if run.speed is None:
        told = "a class speaks, and no counters tell what becomes of it"
        yield Result("limits", Verdict.WARN, told)
        yield Result("dead-man of the driver", Verdict.WARN, told)
        return
    figure = f"{asked:g} m/s makes {run.speed:.3f} m/s; the limit is {most:g}"
    if _TOO_SLOW * most < run.speed < _TOO_FAST * most:
        yield Result("limits", Verdict.OK, figure)
    else:  # of a jump the driver's odometry makes nothing
        yield Result("limits", Verdict.FAIL, figure, "mend `speed` of the class, or its counters")
    yield _dead_man(bench, run, run.stood, _WHEELS_LATE)


def _dead_man(bench: Wheeled, run: Run, stopped: float | None, slack: float) -> Result:
    check, timeout = "dead-man of the driver", bench.config.command_timeout
    if stopped is None:
        return Result(check, Verdict.FAIL, "no stop is seen after the last order", "report this")
    took = stopped - run.last
    late = took > timeout + bench.reply_timeout + slack
    mend = "replies that come late hold it up: see there" if late else ""
    figure = f"{took:.3f} s from the last order to the stop; {timeout:g} s is set"
    return Result(check, Verdict.FAIL if late else Verdict.OK, figure, mend)
