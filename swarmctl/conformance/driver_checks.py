"""Checks of the whole driver: its limits and its dead-man, as sent on the line."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import takewhile

from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.report import Report
from swarm_onboard.driver.actuators import ActuatorSettings
from swarm_onboard.driver.driver import Driver, Phase
from swarm_onboard.driver.kinematics import Pose
from swarm_onboard.driver.relay import Outgoing, Parameter
from swarm_onboard.rosserial.topics import MessageType

from swarmctl.conformance.bench import Bench, speeds_between
from swarmctl.conformance.board_bench import type_of
from swarmctl.conformance.results import Result, fail, ok, warn
from swarmctl.conformance.timed_port import TimedPort

_MUCH = 10.0  # times the top speed
_TOO_SLOW, _TOO_FAST = 0.5, 1.25  # times the limit, measured over half a second
_SETTLED = 0.3  # s after the first velocity, from which the wheels are measured
_COMMANDS, _MAX_COMMANDS = 0.9, 3.0  # s; on a loaded machine until the wheels are measured
_EVERY = 0.05  # s
_REPORTS = 10.0  # Hz
_READY = 10.0  # s
_LATE = 0.1  # s that a stop may be late, beyond the reply timeout
_WHEELS_LATE = 0.4  # s until counters, read ten times a second, stand


@dataclass
class Run:
    """What a driver did: bytes written, time of its first and last command, poses.

    ``jumps``: how often the counters moved as far as no wheel can; its odometry leaves that out.
    """

    clock: Callable[[], float]
    written: list[tuple[float, bytes]] = field(default_factory=list)
    first: float = 0.0
    last: float = 0.0
    poses: list[tuple[float, Pose]] = field(default_factory=list)
    jumps: int = 0

    def odometry(self, pose: Pose) -> None:
        """Records a pose and its time."""
        self.poses.append((self.clock(), pose))

    def reading(self, sensor: object, values: object) -> None:
        """Ignored."""

    def report(self, report: Report) -> None:
        """Keeps the number of jumps."""
        self.jumps = int(report.values["odometry jumps"])

    def event(self, level: object, text: str) -> None:
        """Ignored."""

    @property
    def sent(self) -> list[tuple[float, bytes]]:
        """What was written after the first command."""
        return [(at, data) for at, data in self.written if at > self.first]

    @property
    def speed(self) -> float | None:
        """Speed of the faster wheel during the commands, m/s, from the driver's odometry."""
        seen = [(at, one) for at, one in self.poses if self.first + _SETTLED <= at <= self.last]
        if len(seen) < 2:
            return None
        return max(map(abs, speeds_between(seen[0], seen[-1])))

    @property
    def stood(self) -> float | None:
        """When the wheels stood after the last command, and from then on; None if never.

        Two readings in quick succession may be equal while the wheels turn.
        """
        after = [(at, (one.left, one.right)) for at, one in self.poses if at > self.last]
        still = [at for at, _ in takewhile(lambda one: one[1] == after[-1][1], reversed(after))]
        return still[-2] if len(still) > 1 else None


class NoRos:
    """A relay that only knows message types."""

    def type_of(self, name: str) -> MessageType | None:
        """Returns a message type as far as it is known without ROS."""
        return type_of(name)

    def serve(self, topics: object) -> None:
        """Ignored."""

    def publish(self, topic: object, message: bytes) -> None:
        """Ignored."""

    def log(self, level: int, text: str) -> None:
        """Ignored."""

    def ask(self, name: str) -> None:
        """Ignored."""

    def taken(self) -> list[Outgoing | Parameter]:
        """Returns nothing: no message comes from ROS."""
        return []


def driver_dead_man_stops(bench: Bench) -> Iterator[Result]:
    """Commands far above the limit, then none; checks what the driver sends, and when."""
    built = bench.config.kinematics
    speed = _MUCH * built.wheel_speed_max
    stop, limit, harmless = bench.encoded_speed(0.0), bench.encoded_speed(speed), bench.is_harmless()
    bench.disconnect()
    try:
        run = _run(bench, speed)
    finally:
        bench.connect()
        bench.stop()
    if stop is None or limit is None:
        yield from _measured_at_the_wheels(bench, run, speed, min(built.linear_max, built.wheel_speed_max))
        return
    halt = stop[0]
    stopped = next((at for at, data in run.sent if at > run.last and data == halt), None)
    yield _limited(run, speed, limit, lambda data: data == halt or harmless(data))
    yield _dead_man(bench, run, stopped, _LATE)


def _run(bench: Bench, linear: float) -> Run:
    """Runs a driver with commands for a while, then without."""
    run, ports = Run(bench.clock), list[TimedPort]()

    def opened() -> TimedPort:
        ports.append(TimedPort(bench.open_port(), bench.clock))
        return ports[-1]

    commands = CommandMailbox(bench.clock)
    outputs = ActuatorSettings(bench.config.actuators, commands.ring, bench.clock)
    config = replace(bench.config, diagnostics_rate=_REPORTS)
    driver = Driver(
        config, commands, run, outputs, NoRos(), open_port=opened, clock=bench.clock
    )  # fmt: skip

    def live(seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        end = bench.clock() + seconds
        while not until() and bench.clock() < end:
            left = max(0.0, min(driver.step(), end - bench.clock()))
            (ports[-1].wait if driver.listens_to() else bench.sleep)(left)

    try:
        live(_READY, until=lambda: driver.phase is Phase.READY)
        run.first = bench.clock()
        while bench.clock() < run.first + (
            _COMMANDS if run.speed or not bench.has_counters else _MAX_COMMANDS
        ):
            run.last = bench.clock()
            commands.put((linear, 0.0, 0.0), (0.0, 0.0, 0.0), run.last)
            live(_EVERY)
        live(bench.config.command_timeout + 2 * bench.reply_timeout + 0.3)
        run.written = [one for wire in ports for one in wire.written]
    finally:
        driver.close()
    return run


def _limited(run: Run, commanded: float, limit: tuple[bytes, str], idle: Callable[[bytes], bool]) -> Result:
    """Only queries, stops and the limited speed may be sent."""
    data, shown = limit
    unexpected = [one for _, one in run.sent if one != data and not idle(one)]
    if unexpected or data not in {one for _, one in run.sent}:
        return fail("limits", f"{unexpected[:1]} is sent for {commanded:g} m/s", "report this as a bug")
    return ok("limits", f"{commanded:g} m/s is sent as {shown}")


def _measured_at_the_wheels(bench: Bench, run: Run, commanded: float, most: float) -> Iterator[Result]:
    """A user's codec may encode a speed differently each time: the wheels are measured instead."""
    if run.speed is None:
        figure = "the codec is a class, and there are no counters to measure the wheels"
        yield warn("limits", figure)
        yield warn("dead-man of the driver", figure)
        return
    figure = f"{commanded:g} m/s results in {run.speed:.3f} m/s; the limit is {most:g}"
    if _TOO_SLOW * most < run.speed < _TOO_FAST * most and not run.jumps:
        yield ok("limits", figure)
    else:
        yield fail("limits", figure, "fix `speed` of the class or its counters")
    yield _dead_man(bench, run, run.stood, _WHEELS_LATE)


def _dead_man(bench: Bench, run: Run, stopped: float | None, slack: float) -> Result:
    check, timeout = "dead-man of the driver", bench.config.command_timeout
    if stopped is None:
        return fail(check, "no stop after the last command", "report this as a bug")
    took = stopped - run.last
    late = took > timeout + bench.reply_timeout + slack
    figure = f"{took:.3f} s from the last command to the stop; {timeout:g} s is set"
    return fail(check, figure, "late replies delay it: see `replies`") if late else ok(check, figure)
