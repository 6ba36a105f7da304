"""Commands, stops and odometry of a robot whose board speaks rosserial."""

from __future__ import annotations

import math
import struct
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import pytest
from swarm_onboard.command.report import Level
from swarm_onboard.driver.board_relay import BoardRelay
from swarm_onboard.driver.driver import Phase
from swarm_onboard.driver.relay import Mailbox

from tests.onboard.driver.board_bench import STILL, BoardBench, ready
from tests.onboard.rosserial.fakes import (
    CMD_VEL,
    announcement,
    framed,
)
from tests.timing import wait_for


def test_the_first_command_to_a_board_is_a_stop():
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
    assert (bench.report.level, bench.report.message) == (Level.OK, "standing still: no accepted command yet")


def test_a_command_is_sent_at_once_and_repeated():
    bench = ready()
    given = bench.clock.now
    bench.command(0.2, -0.5)
    bench.run(0.4)
    moves = [at for at, *command in bench.robot.commands if command == [0.2, -0.5]]
    assert moves[0] - given < 0.04
    assert max(later - before for before, later in pairwise(moves)) <= 0.21


def test_a_command_too_fast_is_slowed_along_its_curve():
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
def test_a_senseless_command_stops_the_robot_at_once(senseless):
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


def test_a_parameter_that_nobody_has_set_is_an_error_in_the_log():
    lines, relay = [], BoardRelay(Mailbox(lambda: None))
    relay.join(SimpleNamespace(parameter={}.__getitem__, log=lambda *line: lines.append(line)))
    relay.ask("/gain")
    error = 3  # rosserial_msgs/Log
    assert wait_for(lambda: lines)[0][0] == error
