"""A running driver takes other rates, limits and timeouts, and no other change of its parameter file."""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
import yaml
from swarm_onboard.agent import robot_motion
from swarm_onboard.driver.config import load
from swarm_onboard.driver.driver import Phase
from swarm_onboard.driver.live_parameters import LiveParameters
from swarm_onboard.driver.live_values import differing, fixed

from tests.onboard.driver.board_bench import ready as ready_board
from tests.onboard.driver.driver_process import running, wired
from tests.onboard.driver.fakes import Bench, config_for, params_for
from tests.timing import PATIENCE, wait_for

LIVE = {"command_timeout": 0.3, "limits": {"linear": 0.1, "angular": 0.5}, "rates": {"odom": 5.0}}


@pytest.mark.parametrize(
    ("settings", "names"),
    [
        (LIVE, []),
        ({"rates": {"diagnostics": 2.0, "battery": 1.5}}, []),
        ({"rates": {"odom": 0.0}}, ["sensors.odom.rate"]),
        ({"calibration": {"wheel_separation": 0.3}}, ["kinematics.wheel_separation"]),
    ],
)
def test_what_a_driver_takes_only_when_it_starts(settings: dict[str, Any], names: list[str]) -> None:
    before, after = params_for("koala"), params_for("koala", **settings)
    assert before != after
    assert list(differing(fixed(before), fixed(after))) == names


def driving(bench: Bench, seconds: float, speed: float = 0.2) -> None:
    for _ in range(round(seconds / 0.1)):
        bench.command(speed)
        bench.run(0.1)


def test_a_lower_limit_holds_from_the_next_exchange_on() -> None:
    bench = Bench()
    driving(bench, 2.0)
    assert bench.robot.speed == (44, 44)

    bench.driver.take(config_for("koala", limits={"linear": 0.1}))
    bench.driver.step()

    assert bench.robot.requests[-1][1] == "D,22,22"
    driving(bench, 1.0)
    assert bench.robot.speed == (22, 22)
    assert bench.robot.opened == 1
    assert "D,0,0" not in bench.robot.speed_requests()[-5:]


@pytest.mark.parametrize(("before", "after"), [(0.5, 0.3), (0.3, 0.5)])
def test_the_dead_man_has_the_new_timeout_at_once(before: float, after: float) -> None:
    bench = Bench(config_for("koala", command_timeout=before))
    driving(bench, 2.0)
    bench.command(0.2)
    given = bench.clock.now

    bench.driver.take(config_for("koala", command_timeout=after))
    bench.run(2.0)

    stopped = next(at for at, one in bench.robot.requests if at > given and one == "D,0,0")
    assert stopped - given == pytest.approx(after, abs=0.05)


def test_a_sensor_is_read_at_its_new_rate_and_not_called_slow() -> None:
    bench = Bench(config_for("koala", rates={"odom": 2.0}))
    bench.run(10.0)

    bench.driver.take(config_for("koala", rates={"odom": 20.0}))
    reports = len(bench.sink.reports)
    bench.run(10.0)

    assert {one.message for one in bench.sink.reports[reports:]} == {
        "standing still: no accepted command yet"
    }
    assert float(bench.sink.reports[-1].values["odom rate"].split()[0]) == pytest.approx(20.0, rel=0.1)


def test_a_robot_that_is_being_met_begins_with_the_new_values() -> None:
    bench = Bench()
    while not bench.robot.requests:
        bench.clock.now += bench.driver.step()
    assert bench.driver.phase is Phase.IDENTIFYING
    bench.driver.take(config_for("koala", limits={"linear": 0.1}))
    driving(bench, 2.0)
    assert bench.robot.speed == (22, 22)


def test_a_board_has_its_new_limit_and_timeout_at_once() -> None:
    bench = ready_board(command_timeout=1.0)
    bench.keep_commanding(0.5, 0.4)
    new = config_for("arduino-rover", command_timeout=0.3, limits={"linear": 0.1})
    bench.driver.take(new)
    bench.command(0.4)
    given = bench.clock.now
    bench.run(1.0)
    assert (0.1, 0.0) in bench.sent
    stopped = next(at for at, *one in bench.robot.commands if at > given + 0.05 and one == [0.0, 0.0])
    assert stopped - given == pytest.approx(0.3, abs=0.05)


class Kept:
    """A parameter file, and a driver's loop that takes it."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "koala.yaml"
        self.write()
        self.taken: list[float] = []
        self.shown: list[float] = []
        self.rings = 0
        self.live = LiveParameters(load(self.file), self._take, self._show, self._ring)

    def write(self, **changes: Any) -> None:
        self.file.write_text(yaml.safe_dump({**params_for("koala"), **changes}))

    def answer(self, request: str) -> dict[str, Any]:
        """What the loop answers once the file has been read."""
        before = self.rings
        self.live.requested(request)
        wait_for(lambda: self.rings > before)
        self.live.look()
        return dict(self.live.state())

    def _take(self, config: Any) -> None:
        self.taken.append(config.command_timeout)

    def _show(self) -> None:
        self.shown.append(self.live.config.command_timeout)

    def _ring(self) -> None:
        self.rings += 1


@pytest.fixture
def kept(tmp_path: Path) -> Kept:
    return Kept(tmp_path)


def test_a_changed_file_is_taken_shown_and_named_by_its_digest(kept: Kept) -> None:
    kept.write(command_timeout=0.25)
    answer = kept.answer("reload 1")
    digest = sha256(kept.file.read_bytes()).hexdigest()
    assert answer == {"params": digest, "reloaded": "reload 1", "refusal": ""}
    assert kept.taken == [0.25]
    wait_for(lambda: kept.shown == [0.25])


@pytest.mark.parametrize(
    ("spoil", "refusal"),
    [
        (lambda kept: kept.write(port="/dev/other"), "it takes port only when it starts"),
        (lambda kept: kept.write(command_timeout=99), "`command_timeout` must be from 0.05 to 2.0, not 99"),
        (lambda kept: kept.file.write_bytes(b"\xff"), "cannot read"),
        (lambda kept: kept.file.unlink(), "No such file"),
    ],
    ids=["port", "out of range", "no text", "no file"],
)
def test_a_driver_keeps_its_values_if_it_refuses_the_file(
    kept: Kept, spoil: Callable[[Kept], None], refusal: str
) -> None:
    before = kept.live.state()["params"]
    spoil(kept)
    answer = kept.answer("reload 1")
    assert (answer["params"], answer["reloaded"]) == (before, "reload 1")
    assert refusal in answer["refusal"]
    assert kept.taken == []
    kept.write(command_timeout=0.25)
    assert kept.answer("reload 2")["refusal"] == ""
    assert kept.taken == [0.25]


def test_a_file_that_was_read_for_an_older_request_is_not_taken(kept: Kept) -> None:
    kept.write(command_timeout=0.25)
    kept.live.requested("reload 1")
    wait_for(lambda: kept.rings == 1)
    kept.write()
    assert kept.answer("reload 2")["reloaded"] == "reload 2"
    assert kept.taken == [0.5]


def test_a_repeated_request_and_a_question_read_nothing(kept: Kept) -> None:
    kept.answer("reload 1")
    kept.live.requested("reload 1")
    kept.live.requested("?")
    assert kept.answer("reload 2")["reloaded"] == "reload 2"
    assert kept.rings == 2


@pytest.mark.usefixtures("ros")
def test_a_driver_that_drives_takes_its_file_and_shows_it(tmp_path: Path) -> None:
    with (
        wired("koala", tmp_path) as wiring,
        running(wiring.config, RUNTIME_DIRECTORY=str(tmp_path)) as node,
    ):
        node.wait_until_ready()
        node.drive_until(lambda: wiring.pty.snapshot().v == pytest.approx(0.2, rel=0.02), 0.2)
        way = wiring.pty.snapshot().distance
        params = params_for("koala", str(wiring.device), limits={"linear": 0.1})
        wiring.config.write_text(yaml.safe_dump(params))
        digest = sha256(wiring.config.read_bytes()).hexdigest()

        answers = robot_motion.ask(
            {"koala": f"{tmp_path}/motion"},
            PATIENCE,
            lambda found: found.get("koala", {}).get("params") == digest,
            "reload 1",
        )

        assert answers["koala"]["refusal"] == ""
        node.drive_until(lambda: wiring.pty.snapshot().v == pytest.approx(0.1, rel=0.02), 0.2)
        assert wiring.pty.snapshot().distance > way
        wait_for(lambda: shown_limit(node.published) == 0.1)
        assert node.process.poll() is None
        assert len([one for one in node.published if one["topic"] == "listening"]) == 1


def shown_limit(published: list[dict[str, Any]]) -> float:
    """The limit that the node shows last: one parameter in ROS 2, part of a mapping in ROS 1."""
    shown = [one for one in list(published) if one["topic"] == "parameter"]
    values = [
        one["value"]["limits"]["linear"] if isinstance(one["value"], dict) else one["value"]
        for one in shown
        if isinstance(one["value"], dict) or one["name"] == "limits.linear"
    ]
    return float(values[-1])
