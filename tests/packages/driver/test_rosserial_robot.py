"""A driver and a board that speaks rosserial, on a clock that only moves when both have nothing to do."""

from __future__ import annotations

import math
import struct
from dataclasses import replace
from itertools import pairwise

import pytest
from swarm_driver.driver import Phase
from swarm_driver.port import PortError
from swarm_driver.relay import Outgoing, Parameter
from swarm_driver.report import Level, Report

from tests.packages.driver.fakes import Bench, Clock, config_for
from tests.packages.rosserial.compiled_sketch import Sketch
from tests.packages.rosserial.fakes import (
    CMD_VEL,
    LWHEEL,
    RWHEEL,
    TWIST,
    TWIST_MD5,
    announcement,
    framed,
)

STILL = (0.0, 0.0)


class BoardBench(Bench):
    """The board speaks when it likes, and wakes the driver by that."""

    def __init__(self, **settings) -> None:
        config = config_for("arduino-rover", **settings)
        config = replace(config, protocol=replace(config.protocol, firmware="0123456789ab"))
        super().__init__(config, robot=plugged_sketch)

    def run(self, seconds: float, *, at_most: int = 5_000) -> None:
        end = self.clock.now + seconds
        for _ in range(at_most):
            self.robot.live()
            due = self.clock.now + self.driver.step()
            if self.driver.listens_to() and self.robot.waiting:
                continue
            due = min(due, self.robot.due())
            if due >= end:
                self.clock.now = end
                return
            self.clock.now = max(self.clock.now, due) + 1e-6
        raise AssertionError(f"{at_most} steps in {seconds} s: the driver is spinning")

    def keep_commanding(self, seconds: float, linear: float = 0.2, angular: float = 0.0) -> None:
        for _ in range(round(seconds / 0.1)):
            self.command(linear, angular)
            self.run(0.1)

    @property
    def sent(self) -> list[tuple[float, float]]:
        return [(linear, angular) for _, linear, angular in self.robot.commands]

    @property
    def report(self) -> Report:
        return self.sink.reports[-1]


def plugged_sketch(clock: Clock) -> Sketch:
    return Sketch(clock, PortError)


def ready(**settings) -> BoardBench:
    bench = BoardBench(**settings)
    bench.run(4.0)
    assert bench.driver.phase is Phase.READY, bench.sink.events
    return bench


def test_the_first_order_to_a_board_is_a_stop():
    bench = ready()
    assert bench.sent[0] == STILL
    assert bench.sink.events[-1][1] == (
        "connected to /dev/robot: publishes lwheel, publishes rwheel, subscribes to cmd_vel"
    )


def test_an_uno_is_given_time_to_start():
    bench = BoardBench()
    bench.run(1.9)
    assert bench.robot.received == []
    bench.run(0.5)
    assert bench.driver.phase is Phase.READY


def test_a_board_without_commands_is_sent_only_stops():
    bench = ready()
    bench.run(10.0)
    assert set(bench.sent) == {STILL}
    assert (bench.report.level, bench.report.message) == (Level.OK, "standing still: no command yet")


def test_a_command_is_sent_at_once_and_repeated():
    bench = ready()
    given = bench.clock.now
    bench.command(0.2, -0.5)
    bench.run(0.4)
    moves = [at for at, *command in bench.robot.commands if command == [0.2, -0.5]]
    assert moves[0] - given < 0.04
    assert max(later - before for before, later in pairwise(moves)) <= 0.21


def test_an_order_too_fast_is_slowed_along_its_curve():
    bench = ready()
    bench.command(2.0, 4.0)
    bench.run(0.1)
    linear, angular = bench.sent[-1]
    assert linear / angular == pytest.approx(0.5)
    assert abs(linear) + abs(angular) * 0.13 / 2 == pytest.approx(0.5)


def test_the_limits_of_the_robots_settings_hold():
    bench = ready(limits={"linear": 0.1})
    bench.command(0.4)
    bench.run(0.1)
    assert bench.sent[-1] == (0.1, 0.0)


@pytest.mark.parametrize("timeout", [0.3, 0.5, 2.0])
def test_silence_stops_the_robot_in_time(timeout):
    bench = ready(command_timeout=timeout)
    bench.command(0.2)
    given = bench.clock.now
    bench.run(timeout + 1.0)
    stopped = next(at for at, *command in bench.robot.commands if at > given + 0.05 and command == [0.0, 0.0])
    assert 0 <= round(stopped - given - timeout, 4) <= 0.01
    assert bench.report.values["dead-man trips"] == "1"


@pytest.mark.parametrize("senseless", [math.nan, math.inf, 1e308])
def test_a_senseless_order_stops_the_robot_at_once(senseless):
    bench = ready()
    bench.keep_commanding(0.5)
    bench.command(senseless)
    bench.run(0.05)
    assert bench.sent[-1] == STILL


def test_fast_commands_leave_time_on_the_line():
    bench = ready()
    start = len(bench.robot.commands)
    for number in range(500):
        bench.command(0.1 + 0.001 * (number % 2))
        bench.run(0.01)
    per_second = (len(bench.robot.commands) - start) / 5.0
    assert 20 < per_second * 56 * 10 / 57600 * 100 < 40  # percent of the line


def test_the_end_is_a_stop_and_the_end_of_the_sending():
    bench = ready()
    bench.keep_commanding(0.5)
    bench.driver.close()
    assert bench.sent[-1] == STILL
    assert not bench.robot.configured


def test_ticks_become_odometry():
    bench = ready()
    bench.run(0.5)
    for _ in range(10):
        bench.robot.ticks = [bench.robot.ticks[0] + 2, bench.robot.ticks[1] + 2]
        bench.run(0.1)
    bench.run(0.2)
    pose = bench.sink.poses[-1]
    assert pose.x == pytest.approx(20 / 20 * math.pi * 0.065, rel=1e-6)  # one turn of the wheel
    assert (pose.y, pose.yaw) == (0.0, 0.0)


def test_counters_that_wrap_are_followed():
    bench = BoardBench()
    int16 = bench.relay.types["std_msgs/Int16"] = replace(
        bench.relay.types["std_msgs/Int32"], md5sum="8524586e34fbd7cb1c08c5f5f1ca0e57"
    )
    bench.robot.announces = [
        *(
            announcement(0, 125 + n, name, "std_msgs/Int16", md5=int16.md5sum)
            for n, name in enumerate(("lwheel", "rwheel"))
        ),
        CMD_VEL,
    ]
    bench.run(4.0)
    for ticks in (32767, -32768):
        for topic_id in (125, 126):
            bench.robot.send(framed(topic_id, struct.pack("<h", ticks)))
        bench.run(0.1)
    assert bench.sink.poses[-1].x == pytest.approx(math.pi * 0.065 / 20)


def test_a_boards_reset_moves_no_robot_on_the_map():
    bench = ready()
    bench.robot.ticks = [2, 2]
    bench.run(0.5)
    before = bench.sink.poses[-1]
    bench.robot.reset()
    bench.run(10.0)
    assert bench.driver.phase is Phase.READY
    after = bench.sink.poses[-1]
    assert (after.x, after.yaw) == (before.x, before.yaw)


def test_other_topics_pass_as_they_are_and_orders_do_not():
    bench = BoardBench()
    bench.relay.types["std_msgs/String"] = replace(bench.relay.types["std_msgs/Int32"], md5sum="5" * 32)
    bench.robot.announces = [
        LWHEEL,
        RWHEEL,
        announcement(0, 127, "words", "std_msgs/String", md5="5" * 32),
        CMD_VEL,
        announcement(1, 101, "lamp", "std_msgs/String", md5="5" * 32),
    ]
    bench.run(4.0)
    assert [one.name for one in bench.relay.served] == ["lwheel", "rwheel", "words", "lamp"]
    bench.robot.send(framed(127, b"\x02\0\0\0hi"))
    bench.run(0.01)
    assert ("words", b"\x02\0\0\0hi") in bench.relay.published
    bench.relay.mail.append(Outgoing("lamp", b"\x02\0\0\0on"))
    bench.run(0.3)
    assert (101, b"\x02\0\0\0on") in [(topic_id, message) for _, topic_id, message in bench.robot.received]


def test_a_message_too_large_for_the_board_is_reported_not_sent():
    bench = BoardBench()
    bench.relay.types["std_msgs/String"] = replace(bench.relay.types["std_msgs/Int32"], md5sum="5" * 32)
    bench.robot.announces.append(announcement(1, 101, "lamp", "std_msgs/String", md5="5" * 32, size=100))
    bench.run(4.0)
    bench.relay.mail.append(Outgoing("lamp", bytes(101)))
    bench.run(1.1)
    assert 101 not in [topic_id for _, topic_id, _ in bench.robot.received]
    warnings = [report for report in bench.sink.reports if "did not pass" in report.message]
    assert "`lamp` has 101 bytes; the board's buffer holds 100" in warnings[0].message
    assert warnings[0].level is Level.WARN


def test_parameters_and_logs_go_their_way():
    bench = ready()
    bench.robot.send(framed(6, b"\x03\0\0\0~kp"))
    bench.robot.log(2, "low battery")
    bench.run(0.01)
    assert bench.relay.requested == ["~kp"]
    assert (2, "low battery") in bench.relay.logged
    bench.relay.mail.append(Parameter("~kp", 7))
    bench.run(0.3)
    assert 6 in [topic_id for _, topic_id, _ in bench.robot.received]


def test_a_sketch_that_is_not_the_specs_is_reported():
    bench = BoardBench()
    bench.robot.firmware = "ffffffffffff"
    bench.run(5.0)
    assert bench.report.level is Level.WARN
    assert (
        "the sketch is ffffffffffff, the spec makes 0123456789ab: `swarmctl firmware flash`"
        in bench.report.message
    )
    assert ready().report.values["firmware"] == "0123456789ab"


@pytest.mark.parametrize(
    ("announces", "complaint"),
    [
        ([LWHEEL, CMD_VEL], "the sketch does not publish `rwheel`, as its type declares"),
        (
            [LWHEEL, RWHEEL, CMD_VEL, announcement(0, 127, "extra")],
            "publish `extra`, which its type",
        ),
        (
            [LWHEEL, RWHEEL, CMD_VEL, announcement(1, 101, "lamp")],
            "subscribe to `lamp`, which its type",
        ),
        ([LWHEEL, announcement(0, 126, "rwheel", "my_msgs/Odd"), CMD_VEL], "install my_msgs"),
        (
            [LWHEEL, announcement(0, 126, "rwheel", TWIST, md5=TWIST_MD5), CMD_VEL],
            "`rwheel` is geom",
        ),
    ],
)
def test_a_sketch_that_differs_from_its_type_is_reported(announces, complaint):
    bench = BoardBench()
    bench.robot.announces = announces
    bench.run(5.0)
    assert bench.driver.phase is Phase.READY
    assert bench.report.level is Level.WARN
    assert complaint in bench.report.message


def test_a_sketch_that_subscribes_to_no_commands_is_no_robot():
    bench = BoardBench()
    bench.robot.announces = [LWHEEL, announcement(1, 100, "cmd_vel", TWIST, md5=TWIST_MD5, size=40)]
    bench.run(4.0)
    assert bench.driver.phase is not Phase.READY
    assert "its buffer holds 40" in bench.report.message


def test_a_silent_board_is_reported_and_its_line_reopened():
    bench = BoardBench()
    bench.robot.silent = True
    bench.run(60.0)
    assert 3 <= len(bench.robot.opened) <= 5
    assert Level.ERROR in {report.level for report in bench.sink.reports}
    assert "the board has sent nothing for 15 s (at 57600 baud); check the USB cable" in bench.report.message


def test_a_board_that_falls_silent_is_only_requested_for_topics():
    bench = ready()
    bench.keep_commanding(1.0)
    bench.robot.silent = True
    bench.keep_commanding(17.0)
    assert bench.driver.phase is not Phase.READY
    assert bench.report.level is Level.ERROR
    assert bench.report.message == "no sync with the board: it has not requested the time for 15 s"
    since = len(bench.robot.commands)
    bench.keep_commanding(5.0)
    assert len(bench.robot.commands) == since
    bench.robot.silent = False
    bench.run(25.0)
    assert bench.driver.phase is Phase.READY


def test_orders_from_before_a_loss_move_nothing_after_it():
    bench = ready()
    bench.keep_commanding(1.0)
    bench.robot.plugged = False
    bench.command(0.3)
    bench.run(0.2)
    assert bench.driver.phase is Phase.DISCONNECTED
    bench.robot.plugged = True
    bench.robot.resets_on_open = False
    count = len(bench.robot.commands)
    bench.run(10.0)
    assert bench.driver.phase is Phase.READY
    assert set(bench.sent[count:]) == {STILL}


def test_a_lost_line_is_opened_again_with_growing_pauses():
    bench = ready()
    bench.robot.plugged = False
    bench.robot.opened.clear()
    bench.run(30.0)
    pauses = [later - before for before, later in pairwise(bench.robot.opened)]
    assert pauses[0] < 0.5
    assert pauses[-1] == pytest.approx(5.0, rel=0.01)
    bench.robot.plugged = True
    bench.run(10.0)
    assert bench.driver.phase is Phase.READY


def test_topics_that_come_too_slowly_are_reported():
    bench = ready()
    bench.robot.due = lambda: bench.clock.now + 0.5
    bench.run(10.0)
    assert "lwheel comes at" in bench.report.message
    assert bench.report.values["lwheel rate"].endswith("of 10 Hz")


def test_what_ros_sends_in_floods_leaves_the_stop_the_line():
    """A serial port takes 4 KB at once: a stop behind that would come a second late."""
    bench = BoardBench()
    bench.relay.types["std_msgs/String"] = replace(bench.relay.types["std_msgs/Int32"], md5sum="5" * 32)
    bench.robot.announces.append(announcement(1, 101, "words", "std_msgs/String", md5="5" * 32))
    bench.run(4.0)
    since = len(bench.robot.received)
    for number in range(200):
        bench.relay.mail += [Outgoing("words", bytes(200))] * 10
        bench.command(0.1 + 0.001 * (number % 2))
        bench.run(0.01)
    sent = sum(len(message) + 8 for _, _, message in bench.robot.received[since:])
    assert 101 in [topic_id for _, topic_id, _ in bench.robot.received]
    assert sent < 2.0 * 57600 / 10


@pytest.mark.parametrize(
    ("subscribed", "expected"),
    [
        (
            [("cmd_vel", "std_msgs/String", "5" * 32)],
            "subscribes to `cmd_vel` as std_msgs/String, not once as geometry",
        ),
        (
            [("cmd_vel", TWIST, TWIST_MD5)] * 2,
            "subscribes to `cmd_vel` as geometry_msgs/Twist and geometry_msgs/Twist",
        ),
    ],
    ids=["another-type", "twice"],
)
def test_commands_are_sent_only_as_the_type_the_sketch_uses(subscribed, expected):
    bench = BoardBench()
    bench.relay.types["std_msgs/String"] = replace(bench.relay.types["std_msgs/Int32"], md5sum="5" * 32)
    bench.robot.announces = [
        announcement(1, 100 + n, name, kind, md5=md5) for n, (name, kind, md5) in enumerate(subscribed)
    ]
    bench.run(4.0)
    assert bench.driver.phase is not Phase.READY
    assert expected in bench.report.message
    assert bench.sent == []


def test_a_sketch_cannot_go_round_the_gate():
    """Commands reach it, and come from it, on no topic but the driver's own; none leaves its namespace."""
    bench = BoardBench()
    bench.robot.announces = [
        CMD_VEL,
        announcement(0, 130, "cmd_vel", TWIST, md5=TWIST_MD5),
        *(
            announcement(1, 101 + n, name, TWIST, md5=TWIST_MD5)
            for n, name in enumerate(["/cmd_vel", "~cmd_vel"])
        ),
        announcement(0, 131, "/other/cmd_vel", TWIST, md5=TWIST_MD5),
    ]
    bench.run(4.0)
    assert bench.driver.phase is Phase.READY
    assert bench.relay.served == []
    assert "not within the robot's namespace: write the name without `/`" in bench.report.message
