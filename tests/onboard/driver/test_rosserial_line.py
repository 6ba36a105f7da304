"""Topics, sketches and faults on the line of a board that speaks rosserial."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest
from swarm_onboard.command.report import Level
from swarm_onboard.driver.driver import Phase
from swarm_onboard.driver.relay import Outgoing, Parameter

from tests.onboard.driver.board_bench import STILL, BoardBench, ready
from tests.onboard.rosserial.fakes import (
    CMD_VEL,
    LWHEEL,
    RWHEEL,
    TWIST,
    TWIST_MD5,
    announcement,
    framed,
)


def test_other_topics_pass_as_they_are_and_commands_do_not():
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


def test_the_firmware_of_a_board_that_was_silent_is_unknown():
    bench = ready()
    assert bench.driver.motion()["firmware"] == "0123456789ab"
    bench.robot.silent = True
    bench.run(20.0)
    assert bench.driver.motion()["firmware"] == ""
    bench.robot.silent, bench.robot.firmware = False, ""
    bench.run(20.0)
    assert bench.driver.phase is Phase.READY
    assert bench.driver.motion()["firmware"] == ""


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


def test_commands_from_before_a_loss_move_nothing_after_it():
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
