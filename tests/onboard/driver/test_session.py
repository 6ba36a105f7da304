"""The driver's states and what may befall it in each, on a clock that only moves when the driver waits."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from swarm_onboard.command.report import Level
from swarm_onboard.command.stop_latch import StopLatch
from swarm_onboard.driver.driver import Phase, run
from swarm_onboard.driver.protocols import LineQuery

from tests.onboard.driver.fakes import Bench, config_for

STOP, AHEAD = "D,0,0", "D,44,44"


def ready(**settings) -> Bench:
    bench = Bench(config_for("koala", **settings))
    bench.run(1.0)
    assert bench.driver.phase is Phase.READY
    return bench


def driving(seconds: float = 1.0, **settings) -> Bench:
    bench = ready(**settings)
    keep_commanding(bench, seconds)
    assert bench.robot.speed == (44, 44)
    return bench


def keep_commanding(bench: Bench, seconds: float) -> None:
    for _ in range(round(seconds / 0.1)):
        bench.command(0.2)
        bench.run(0.1)


def test_the_first_word_to_a_robot_is_stop():
    assert ready().robot.requests[0][1] == STOP


def test_a_robot_without_commands_is_sent_only_stops():
    bench = ready()
    bench.run(10.0)
    assert set(bench.robot.speed_requests()) == {STOP}
    assert bench.sink.reports[-1].message == "standing still: no accepted command yet"


def test_a_command_is_sent_at_once_and_repeated():
    bench = ready()
    start = bench.clock.now
    keep_commanding(bench, 2.0)
    moves = [at for at, request in bench.robot.requests if request == AHEAD]
    assert moves[0] - start <= 0.02
    assert max(later - before for before, later in pairwise(moves)) <= 0.25


@pytest.mark.parametrize("timeout", [0.05, 0.5, 2.0])
def test_silence_stops_the_robot_in_time(timeout):
    bench = driving(command_timeout=timeout) if timeout >= 0.5 else ready(command_timeout=timeout)
    bench.command(0.2)
    given = bench.clock.now
    bench.run(timeout + 1.0)
    stopped = next(at for at, request in bench.robot.requests if at > given and request == STOP)
    assert 0 <= round(stopped - given - timeout, 6) <= 0.1
    assert bench.robot.speed == (0, 0)
    assert bench.sink.reports[-1].values["dead-man trips"] == "1"


def test_a_silent_sensor_does_not_hold_up_the_dead_man():
    bench = ready()
    bench.robot.silent_to = "HN"
    for number in range(40):
        bench.command(0.2)
        given = bench.clock.now
        bench.run(0.7 + 0.037 * number)
        stopped = next(at for at, request in bench.robot.requests if at > given and request == STOP)
        assert stopped - given <= 0.5 + 0.01


@pytest.mark.parametrize("senseless", [math.nan, math.inf, 1e308])
def test_a_senseless_command_stops_the_robot_at_once(senseless):
    bench = driving()
    bench.command(senseless)
    bench.run(0.05)
    assert bench.robot.speed == (0, 0)
    bench.commands.put((0.2, 0.0, 0.0), (senseless, 0.0, 0.0))
    bench.run(0.05)
    assert bench.robot.speed == (0, 0)


def test_a_command_to_stop_does_not_wait_for_its_turn():
    bench = driving()
    bench.command(0.1)
    bench.driver.step()
    bench.command(0.0)
    bench.driver.step()
    assert bench.robot.requests[-1][1] == STOP


def test_fast_commands_leave_the_sensors_their_rate():
    bench = ready()
    bench.robot.takes = 0.015
    for number in range(600):
        bench.command(0.1 + 0.1 * (number % 2))
        bench.run(0.01)
    assert bench.sink.reports[-1].level is Level.OK
    assert float(bench.sink.reports[-1].values["odom rate"].split()[0]) >= 9.5


def test_a_late_reply_is_not_taken_for_the_next_one():
    bench = ready()
    places = len(bench.sink.poses)
    for _ in range(40):
        bench.robot.waiting = b"h,2000,2000\r\n"
        bench.run(0.033)
    assert len(bench.sink.poses) > places
    assert {pose.x for pose in bench.sink.poses} == {0.0}


def test_a_reply_that_breaks_off_spoils_only_itself():
    bench = ready()
    bench.robot.cuts_short = "H"
    bench.run(0.9)
    bench.robot.cuts_short = ""
    bench.run(3.0)
    assert bench.sink.reports[-1].values["failed exchanges"] == "1"


def test_a_robot_switched_off_and_on_does_not_jump():
    bench = ready()
    bench.robot.counters = (2000, 2000)
    bench.run(1.0)
    place = bench.sink.poses[-1].x
    assert place == pytest.approx(0.09)
    bench.robot.plugged = False
    bench.run(20.0)
    bench.robot.plugged, bench.robot.counters = True, (0, 0)
    bench.run(10.0)
    assert bench.sink.poses[-1].x == place
    assert bench.driver.phase is Phase.READY


def test_one_lost_reply_is_forgiven():
    bench = driving()
    bench.robot.silent_to = "D"
    bench.command(0.1)
    bench.driver.step()
    bench.robot.silent_to = ""
    bench.command(0.1)
    bench.run(0.1)
    assert (bench.robot.opened, bench.driver.phase) == (1, Phase.READY)
    assert bench.robot.speed == (22, 22)


@pytest.mark.parametrize(
    "befall",
    [
        pytest.param(lambda robot: setattr(robot, "silent_to", "D"), id="no reply"),
        pytest.param(lambda robot: setattr(robot, "refuses", "D"), id="refused"),
        pytest.param(lambda robot: setattr(robot, "garble", b"\xff\x00d!\r\nx"), id="garbage"),
        pytest.param(lambda robot: setattr(robot, "plugged", False), id="unplugged"),
    ],
)
@pytest.mark.parametrize("state", ["disconnected", "identifying", "ready", "driving"])
def test_every_fault_in_every_state_ends_standing_still_and_recovers(state, befall):
    bench = {"ready": ready, "driving": driving}.get(state, Bench)()
    if state == "identifying":
        bench.driver.step()
        assert bench.driver.phase is Phase.IDENTIFYING
    if state == "driving":
        bench.command(0.2)
    healthy = dict(vars(bench.robot))
    befall(bench.robot)
    keep_commanding(bench, 3.0)
    assert bench.driver.phase is not Phase.READY
    assert bench.sink.reports[-1].level is not Level.OK
    for name in ("silent_to", "refuses", "garble", "plugged"):
        setattr(bench.robot, name, healthy[name])
    before = len(bench.robot.requests)
    bench.run(8.0)
    assert bench.driver.phase is Phase.READY
    assert {request for _, request in bench.robot.requests[before:] if request.startswith("D")} == {STOP}
    keep_commanding(bench, 0.3)
    assert bench.robot.speed == (44, 44)


def test_a_command_from_before_the_line_came_back_is_not_executed():
    bench = ready()
    bench.robot.plugged = False
    bench.run(0.5)
    bench.command(0.2)
    bench.robot.plugged = True
    bench.run(0.45)
    assert bench.driver.phase is Phase.READY
    bench.run(3.0)
    assert set(bench.robot.speed_requests()) == {STOP}


def test_a_missing_port_is_retried_and_reported_once():
    """A robot that is plugged in again may be driving."""
    bench = Bench()
    bench.robot.plugged = False
    bench.run(60.0)
    pauses = [later - before for before, later in pairwise(bench.robot.tried)]
    assert pauses == [pytest.approx(0.2)] * len(pauses)
    assert len(pauses) > 290
    assert len(bench.sink.events) == 1
    assert bench.sink.reports[-1].message == "/dev/robot is missing"
    assert len(bench.sink.reports) == 60


@pytest.mark.parametrize("silent_to", ["", "D", "BL", "L", "HN"])
def test_the_driver_shows_that_it_is_alive_without_answers(silent_to):
    """What systemd waits for, `watchdog_of`, is four exchanges long: a step is no longer than two of them."""
    config = config_for("koala")
    lights = (LineQuery(send="L,0,0", reply="l"), LineQuery(send="L,1,0", reply="l"))
    bench = Bench(replace(config, protocol=replace(config.protocol, setup=lights)))
    bench.robot.silent_to = silent_to
    timeout = config.protocol.reply_timeout
    for _ in range(200):
        before = bench.clock.now
        wait = bench.driver.step()
        assert bench.clock.now - before <= 2 * timeout + 1e-9
        bench.clock.now += min(wait, 0.3)


def test_a_robot_that_does_not_answer_is_polled_ever_more_rarely():
    bench = Bench()
    bench.robot.silent_to = "D"
    bench.run(90.0)
    pauses = [round(later - before, 6) for before, later in pairwise(bench.robot.tried)]
    assert pauses == sorted(pauses)
    assert pauses[0] < 1.0
    assert 5.0 <= pauses[-1] <= 6.0


@pytest.mark.parametrize(("fault", "moves"), [("", True), ("B", False)])
def test_a_robot_moves_only_when_the_unit_of_its_speed_is_known(fault, moves):
    config = config_for("koala")
    (scale,) = config.kinematics.scales
    old, new = replace(scale, firmware_below=5.0, speed_units_per_mps=1.0), scale
    bench = Bench(replace(config, kinematics=replace(config.kinematics, scales=(old, new))))
    bench.robot.silent_to = fault
    keep_commanding(bench, 5.0)
    assert (AHEAD in bench.robot.speed_requests()) is moves
    assert moves or "speeds have no unit" in bench.sink.reports[-1].message


def test_a_robot_that_does_not_answer_comes_with_advice():
    bench = Bench()
    bench.robot.silent_to = "D"
    bench.run(3.0)
    assert "115200 baud; check the mode selector" in bench.sink.reports[-1].message


def test_a_silent_sensor_is_reported_and_left_alone_for_a_while():
    bench = ready()
    bench.robot.silent_to = "N"
    bench.run(10.0)
    report = bench.sink.reports[-1]
    assert report.level is Level.WARN
    assert "proximity comes at 0.0 instead of 5 Hz" in report.message
    assert bench.driver.phase is Phase.READY
    assert float(report.values["odom rate"].split()[0]) >= 9.5
    sent = [at for at, request in bench.robot.requests if request == "N" and at > bench.clock.now - 5.0]
    assert len(sent) <= 5


def test_rates_of_zero_leave_the_sensors_alone():
    bench = ready(rates={"odom": 0.0, "proximity": 0.0, "battery": 0.0})
    bench.run(5.0)
    assert {request[0] for _, request in bench.robot.requests} == {"D", "B"}
    assert bench.sink.reports[-1].level is Level.OK


@pytest.mark.parametrize("ending", ["stopped", "exception"])
def test_every_end_of_the_loop_is_a_stop(ending, monkeypatch):
    bench = driving()
    bench.command(0.2)

    def last_step():
        if ending == "exception":
            raise RuntimeError("a bug")
        bench.commands.stop()
        return 0.0

    monkeypatch.setattr(bench.driver, "step", last_step)
    latch = StopLatch("", bench.commands, "")
    if ending == "exception":
        with pytest.raises(RuntimeError):
            run(bench.driver, bench.commands, latch, lambda: None, 1.0, live=bench.live)
    else:
        run(bench.driver, bench.commands, latch, lambda: None, 1.0, live=bench.live)
    assert bench.robot.requests[-1][1] == STOP
    assert bench.driver.phase is Phase.DISCONNECTED


def test_an_unconfirmed_stop_at_the_end_is_reported():
    bench = driving()
    bench.robot.silent_to = "D"
    bench.driver.close()
    assert bench.robot.speed == (0, 0)
    assert bench.sink.events[-1][0] is Level.ERROR
    assert "did not confirm" in bench.sink.events[-1][1]


def test_a_loss_after_a_long_good_time_is_retried_fast():
    bench = Bench()
    bench.robot.plugged = False
    bench.run(60.0)
    bench.robot.plugged = True
    bench.run(15.0)
    bench.robot.plugged = False
    bench.run(0.3)
    bench.robot.plugged = True
    bench.run(0.6)
    assert bench.driver.phase is Phase.READY
