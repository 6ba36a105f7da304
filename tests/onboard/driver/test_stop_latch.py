"""A robot whose latch is closed stands, whatever is commanded, and answers from its counters that it does."""

from __future__ import annotations

import json
import math
import socket
from pathlib import Path

import pytest
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.stop_latch import SOCKET, StopLatch
from swarm_onboard.driver.driver import run
from swarm_onboard.driver.kinematics import Counters
from swarm_onboard.driver.stillness import SLOWEST, Stillness

from tests.onboard.driver.fakes import Bench

pytestmark = pytest.mark.usefixtures("ros")

STOP = "D,0,0"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "koala"


def driving() -> Bench:
    bench = Bench()
    bench.run(1.0)
    bench.command(0.2)
    bench.run(0.1)
    assert bench.robot.speed != (0, 0)
    return bench


def test_a_latch_stops_a_robot_that_drives_and_no_command_moves_it(file: Path) -> None:
    bench = driving()
    latch = StopLatch(str(file), bench.commands, "")
    file.write_text("")
    latch.look()
    bench.driver.step()
    assert bench.robot.requests[-1][1] == STOP
    for _ in range(20):
        bench.command(0.2)
        latch.look()
        bench.run(0.1)
        assert bench.robot.speed == (0, 0)
    assert "stopped by `swarmctl stop`" in bench.sink.reports[-1].message
    assert bench.sink.reports[-1].values["dead-man trips"] == "0"


def test_a_released_robot_stands_until_the_next_command(file: Path) -> None:
    bench = driving()
    latch = StopLatch(str(file), bench.commands, "")
    file.write_text("")
    latch.look()
    bench.run(0.1)
    bench.command(0.2)
    file.unlink()
    latch.look()
    bench.run(0.2)
    assert bench.robot.speed == (0, 0)
    bench.command(0.2)
    bench.run(0.1)
    assert bench.robot.speed != (0, 0)


def test_a_latch_is_read_before_the_first_step_of_a_driver(file: Path) -> None:
    bench = Bench()
    bench.command(0.2)
    file.write_text("")

    def beat() -> None:
        bench.command(0.2)
        bench.clock.now += 0.05
        if bench.clock.now > 103.0:
            bench.commands.stop()

    bench.commands.wait = lambda *_: None
    run(bench.driver, bench.commands, StopLatch(str(file), bench.commands, ""), beat, 1.0, live=bench.live)
    assert set(bench.robot.speed_requests()) == {STOP}


def test_a_latch_that_cannot_be_read_counts_as_closed(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    commands = CommandMailbox()
    StopLatch(str(tmp_path / "loop" / "koala"), commands, "").look()
    assert commands.held


def test_the_proof_comes_from_counters_read_after_the_zero() -> None:
    bench = driving()
    bench.commands.hold(held=True)
    bench.driver.step()
    bench.robot.counters = (500, 500)
    before = bench.driver.motion()
    assert before["held"]
    assert before["zero_at"] == pytest.approx(bench.clock.now, abs=0.05)
    assert before["still_since"] is None
    bench.run(0.3)
    still = bench.driver.motion()["still_since"]
    assert still is not None
    assert before["zero_at"] <= still <= bench.clock.now


def test_wheels_that_go_on_turning_are_no_standstill() -> None:
    bench = driving()
    bench.commands.hold(held=True)
    for turned in range(40):
        bench.robot.counters = (turned * 100, turned * 100)
        bench.run(0.05)
        assert bench.driver.motion()["still_since"] is None


def test_a_robot_that_was_lost_proves_nothing() -> None:
    bench = driving()
    bench.commands.hold(held=True)
    bench.run(1.0)
    bench.robot.plugged = False
    bench.run(1.0)
    motion = bench.driver.motion()
    assert (motion["zero_at"], motion["still_since"]) == (None, None)
    assert "missing" in motion["trouble"]


@pytest.mark.parametrize(("step", "seconds"), [(0.00005, 0.1), (0.01, 1.1)])
def test_coarse_counters_need_longer_to_show_a_standstill(step: float, seconds: float) -> None:
    still, now = Stillness(), 10.0
    while now < 10.0 + seconds - 0.06:
        still.take(Counters(7, 7, now))
        if 2 * step / max(now - 10.0, 1e-9) > SLOWEST:
            assert still.since(step, 10.0) is None
        now += 0.05
    still.take(Counters(8, 7, 10.0 + seconds))  # an edge on which the wheel stands
    assert still.since(step, 10.0) == 10.0
    still.take(Counters(9, 7, 10.0 + seconds + 0.05))
    assert still.since(step, 10.0) is None


def test_no_counters_are_no_standstill() -> None:
    still = Stillness()
    still.take(None)
    assert still.since(0.001, 0.0) is None
    assert math.isinf(still.slower_than(0.001))


def test_a_question_wakes_the_loop_and_is_answered(file: Path, tmp_path: Path) -> None:
    commands = CommandMailbox()
    latch = StopLatch(str(file), commands, str(tmp_path))
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asking:
        asking.bind(str(tmp_path / "asking"))
        asking.settimeout(5)
        asking.sendto(b"?", str(tmp_path / SOCKET))
        commands.wait(30.0, latch.listens_to())
        latch.answer(lambda: {"held": True})
        assert json.loads(asking.recv(1000))["held"] is True
    latch.answer(lambda: {"held": True})  # nobody asks any more


def test_a_driver_says_since_when_its_robot_is_idle() -> None:
    bench = Bench()
    bench.run(1.0)
    assert bench.driver.motion()["idle_since"] <= bench.clock.now - 0.5
    bench.command(0.0)  # a commander that holds the robot is a use, too
    commanded = bench.clock.now
    bench.run(1.0)
    assert bench.driver.motion()["idle_since"] == pytest.approx(commanded, abs=0.01)
    bench.robot.counters = (90, 90)  # pushed
    pushed = bench.clock.now
    bench.run(1.0)
    assert pushed <= bench.driver.motion()["idle_since"] <= pushed + 0.2


def test_a_driver_says_how_its_robot_moves() -> None:
    bench = Bench()
    bench.run(1.0)
    assert bench.driver.motion()["pose"] == [0.0, 0.0, 0.0]
    for turned in range(1, 11):
        bench.command(0.2)
        bench.robot.counters = (turned * 200, turned * 200)
        bench.run(0.1)
    motion = bench.driver.motion()
    assert motion["commanded"] == [0.2, 0.0]
    assert motion["pose"] == [bench.sink.poses[-1].x, 0.0, 0.0]
    assert motion["driven"] == [bench.sink.poses[-1].linear, 0.0]
    assert motion["driven"][0] > 0
    bench.run(1.0)
    assert bench.driver.motion()["commanded"] == [0.0, 0.0]
    bench.robot.plugged = False
    bench.run(1.0)
    motion = bench.driver.motion()
    assert (motion["pose"], motion["driven"]) == (None, None)


def test_a_driver_says_how_full_the_battery_is_as_long_as_it_is_read() -> None:
    bench = Bench()
    assert bench.driver.motion()["battery"] is None
    bench.run(3.0)
    assert bench.driver.motion()["battery"] == pytest.approx(0.5)  # 12 V, from 11 V to 13 V
    bench.robot.refuses = "M"
    bench.run(8.0)
    assert bench.driver.motion()["battery"] is None
