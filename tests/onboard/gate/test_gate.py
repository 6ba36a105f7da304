"""The gate with a fake clock: what it sends when, and what it reports."""

from __future__ import annotations

import contextlib
import math
import random
import struct
import time
from dataclasses import replace

import pytest
from swarm_onboard.command.authority import Authority, Commander
from swarm_onboard.command.command_gate import CommandGate
from swarm_onboard.command.command_log import CommandLog
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.limits import STANDSTILL, Velocity
from swarm_onboard.command.report import Level
from swarm_onboard.command.stop_latch import StopLatch
from swarm_onboard.gate.config import Config
from swarm_onboard.gate.gate import Gate, run
from swarm_onboard.gate.motion import Motion, zero
from swarm_onboard.gate.robot_state import OdometryWatch, Reading
from swarm_onboard.gate.wiring import Wiring, wiring_of, without_ended

CONFIG = Config(
    robot="tb",
    title="TurtleBot3 Burger",
    namespace="/tb",
    command_type="geometry_msgs/Twist",
    output_type="geometry_msgs/Twist",
    command_timeout=0.5,
    rate=10.0,
    diagnostics_rate=1.0,
    commanders=(
        Commander("boss", 10, nodes=("/boss",), hosts=("host",)),
        Commander("joy", 20, nodes=("/joy",), hosts=("host",)),
    ),
    motion=Motion("differential", 0.22, 0.0, 0.0, 2.84, wheel_separation=0.16),
    odom_frame="tb/odom",
)
CONNECTED = Wiring(receivers=("/tb/driver",))


class Bench:
    """A gate whose clock moves only here. ``sent`` are pairs of moment and velocity."""

    def __init__(self, wiring: Wiring | None = CONNECTED) -> None:
        self.now = 100.0
        self.wiring = wiring
        self.sent: list[tuple[float, Velocity]] = []
        self.reports = []
        self.flushed = False
        self.connected = 1
        self.commands = CommandMailbox(lambda: self.now)
        self.senders = CommandGate(
            Authority(CONFIG.commanders, CONFIG.command_timeout),
            self.commands,
            CommandLog(None, {}),
            lambda: self.now,
        )
        self.gate = Gate(
            CONFIG, self.commands, self, standing=self.senders.standing, wiring=lambda: self.wiring,
            clock=lambda: self.now,
        )  # fmt: skip

    def send(self, velocity: Velocity) -> None:
        self.sent.append((round(self.now - 100.0, 3), velocity))

    def receivers(self) -> int:
        return self.connected

    def flush(self) -> None:
        self.flushed = True

    def report(self, report) -> None:
        self.reports.append(report)

    def command(self, linear: float, angular: float = 0.0, *, node: str = "/boss", left: float = 0.0) -> None:
        self.senders.give(node, "host", (linear, left, 0.0), (0.0, 0.0, angular), self.now)
        self.gate.step()

    def wait(self, seconds: float) -> None:
        """Steps when the gate wants to, as ``run`` does."""
        end = self.now + seconds
        while self.now < end:
            self.now = min(end, self.now + max(self.gate.step(), 1e-6))
        self.gate.step()

    def moving(self) -> list[tuple[float, Velocity]]:
        return [one for one in self.sent if one[1] != STANDSTILL]

    def latest_report(self):
        self.wait(1.0)
        return self.reports[-1]


def test_the_first_message_is_a_zero_repeated_while_nobody_commands():
    bench = Bench()
    bench.wait(1.0)
    assert bench.sent[0] == (0.0, STANDSTILL)
    assert 10 <= len(bench.sent) <= 12
    assert bench.moving() == []


def test_a_command_is_sent_at_once_and_repeated_until_it_expires():
    bench = Bench()
    bench.wait(0.23)
    bench.command(0.1, 0.5)
    assert bench.sent[-1] == (0.23, Velocity(forward=0.1, turn=0.5))
    bench.wait(1.0)
    driven = [moment for moment, _ in bench.moving()]
    assert driven[:5] == pytest.approx([0.23, 0.33, 0.43, 0.53, 0.63])
    assert driven[-1] <= 0.73
    after = [moment for moment, velocity in bench.sent if velocity == STANDSTILL and moment > 0.23]
    assert after[0] == pytest.approx(0.73, abs=0.001)


def test_every_new_command_is_sent_even_if_it_is_equal():
    bench = Bench()
    for _ in range(5):
        bench.command(0.1)
        bench.now += 0.02
    assert len(bench.moving()) == 5


def test_a_fast_commander_is_bounded_and_its_stop_is_not():
    bench = Bench()
    bench.wait(0.05)
    for number in range(500):
        bench.command(0.1 + number / 10_000)
        bench.wait(0.001)
    assert 53 <= len(bench.moving()) <= 59
    ages = [moment - 0.05 - (velocity.forward - 0.1) * 10 for moment, velocity in bench.moving()]
    assert max(ages) <= 0.002  # what is sent is the latest command, not one that waited
    bench.command(0.2)
    bench.wait(0.02)
    assert bench.sent[-1][1] == Velocity(forward=0.2)  # the last one is never left out
    for number in range(5):
        bench.command(0.1 + number / 10_000)
    assert bench.sent[-1][1] != Velocity(forward=0.1004)
    bench.command(0.0)
    assert bench.sent[-1] == (round(bench.now - 100.0, 3), STANDSTILL)


@pytest.mark.parametrize("rate", [50.0, 100.0, 100.05])
def test_jitter_at_100_hz_costs_nothing(rate):
    bench = Bench()
    jitter = random.Random(1)
    arrivals = [(number + jitter.random()) / rate for number in range(int(30 * rate))]
    for number, arrival in enumerate(arrivals):
        bench.wait(100.0 + arrival - bench.now)
        bench.command(0.1 + number / 100_000)
    assert [moment for moment, _ in bench.moving()] == pytest.approx(arrivals, abs=0.001)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e6])
def test_a_number_that_no_robot_can_drive_is_a_stop(bad):
    for components in ({"linear": bad}, {"linear": 0.1, "angular": bad}, {"linear": 0.1, "left": bad}):
        bench = Bench()
        bench.command(0.1)
        bench.command(**components)
        assert bench.sent[-1][1] == STANDSTILL
        assert bench.latest_report().values["refused commands"] == "1"


def test_strangers_move_nothing_and_are_named():
    bench = Bench()
    bench.command(0.1, node="/stranger")
    assert bench.moving() == []
    report = bench.latest_report()
    assert report.level is Level.WARN
    assert "refuses /stranger on host: not among its commanders joy, boss" in report.message


def test_the_higher_priority_drives_and_is_named():
    bench = Bench()
    bench.command(0.1, node="/joy")
    bench.command(0.2)
    assert {velocity.forward for _, velocity in bench.moving()} == {0.1}
    bench.gate._report_due = bench.now
    bench.gate.step()
    assert bench.reports[-1].values["commander"] == "joy (/joy)"


@pytest.mark.parametrize("way", [1, -1])
def test_a_command_that_is_too_fast_is_slowed_counted_and_reported(way):
    bench = Bench()
    bench.command(2.2 * way, left=0.1)
    assert bench.sent[-1][1] == pytest.approx(Velocity(forward=0.22 * way))
    bench.gate._report_due = bench.now
    bench.gate.step()
    report = bench.reports[-1]
    slowed, without_axis = "slowed commands", "commands on axes that the robot lacks"
    assert report.message == "driving, slowed to the robot's limits"
    assert (report.values[slowed], report.values[without_axis]) == ("1", "1")


def test_the_zero_that_follows_a_gate_has_the_time_of_now(monkeypatch):
    monkeypatch.setattr(time, "time_ns", lambda: 1_700_000_000_000_000_007)
    assert struct.unpack_from("<II", zero("geometry_msgs/TwistStamped"), 4) == (1_700_000_000, 7)


def test_a_new_subscriber_receives_the_velocity_at_once():
    bench = Bench()
    bench.command(0.1)
    bench.now += 0.03
    bench.gate.greet()
    bench.gate.step()
    assert [moment for moment, _ in bench.moving()] == [0.0, 0.03]


@pytest.mark.parametrize(
    ("wiring", "level", "text"),
    [
        (CONNECTED, Level.OK, "standing still: no accepted command yet"),
        (None, Level.OK, "standing still: no accepted command yet"),
        (Wiring(), Level.WARN, "no node subscribes to /tb/gate/cmd_vel: commands do not reach the driver"),
        (replace(CONNECTED, rivals=("/x",)), Level.ERROR, "/x publishes to the driver past the gate"),
        (
            replace(CONNECTED, bypassing=("/tb/core",)),
            Level.ERROR,
            "/tb/core takes commands past the gate: remap its command topic",
        ),
    ],
)
def test_the_report_says_how_the_gate_is_connected(wiring, level, text):
    report = Bench(wiring).latest_report()
    assert (report.level, text in report.message) == (level, True)


def test_the_wiring_comes_from_both_ends_of_the_topics():
    ends = {
        "/tb/gate/cmd_vel": (["/tb/gate", "/rival"], ["/tb/driver"]),
        "/tb/cmd_vel": (["/boss"], ["/tb/gate", "/tb/core", "/record"]),
    }
    found = wiring_of(ends, CONFIG)
    assert found == Wiring(receivers=("/tb/driver",), rivals=("/rival",), bypassing=("/tb/core",))


def test_a_rival_that_has_ended_is_none():
    listed = replace(CONNECTED, rivals=("/killed", "/rival"))
    assert without_ended(listed, lambda node: node == "/killed").rivals == ("/rival",)


@pytest.mark.parametrize("fault", [None, RuntimeError("broken")])
def test_however_the_loop_ends_a_zero_is_the_last_message(fault):
    bench = Bench()
    bench.command(0.1)

    def beat() -> None:
        if fault is not None:
            raise fault
        bench.commands.stop()

    with contextlib.suppress(RuntimeError):
        run(bench.gate, bench.commands, StopLatch("", bench.commands, ""), beat, 1.0)
    assert bench.sent[-1][1] == STANDSTILL
    assert bench.flushed


def test_a_held_robot_gets_zeros_whoever_commands():
    bench = Bench()
    bench.wait(0.5)
    bench.command(0.1)
    bench.commands.hold(held=True)
    bench.gate.step()
    assert bench.sent[-1][1] == STANDSTILL
    for _ in range(10):
        bench.command(0.1)
        bench.wait(0.1)
    assert bench.sent[-1][1] == STANDSTILL
    assert bench.moving() == bench.moving()[:1]
    motion = bench.gate.motion()
    assert motion["zero_at"] is not None
    assert not motion["measured"]
    bench.connected = 0
    assert bench.gate.motion()["zero_at"] is None
    bench.commands.hold(held=False)
    bench.wait(0.2)
    assert bench.sent[-1][1] == STANDSTILL
    bench.command(0.1)
    assert bench.sent[-1][1] != STANDSTILL


def test_odometry_proves_a_standstill_only_since_the_latest_zero() -> None:
    bench = Bench()
    watch = OdometryWatch("/tb/odom", lambda: bench.now)
    bench.gate = Gate(CONFIG, bench.commands, bench, odometry=watch, clock=lambda: bench.now)

    def stands(after: float) -> bool:
        bench.wait(after)
        watch.take(Reading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, bench.now))
        return bench.gate.motion()["still_since"] is not None

    bench.gate.motion()
    assert [stands(0.1) for _ in range(6)][-1]
    assert bench.gate.motion()["pose"] == [0.0, 0.0, 0.0]
    assert bench.gate.motion()["driven"] == [0.0, 0.0]
    bench.command(0.2)
    assert bench.gate.motion()["commanded"] == [0.2, 0.0]
    assert not stands(0.05)  # the robot has not begun to move
    assert not stands(0.5)  # the dead-man has just sent a zero
    assert stands(0.35)
    bench.connected = 0
    assert not stands(0.1)  # whose odometry is it?
