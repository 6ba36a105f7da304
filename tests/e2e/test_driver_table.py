"""A robot of each type that has a protocol, on both ROS: topics, motion, lights, diagnostics."""

from __future__ import annotations

import json
import math
import os
import select
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from tests.child_process import child_process
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import SOURCE, LabSwarm, lab_of, quoted
from tests.e2e.pose import Pose, wrapped
from tests.loading import load_swarm
from tests.timing import PATIENCE, Promise, withheld

SPEC = Path(__file__).with_name("all-types.yaml")
USER = Path(__file__).with_name("user_of_robots.py")
HOST = "pi"
STRETCH = 3.0  # s of driving
SEPARATION = 0.13  # m between the wheels of the rover, whose odometry has pulses
STANDS = 0.7  # s after the last command, as for every robot on a line
BASE = ("sensor_msgs/LaserScan", "sensor_msgs/Imu", "sensor_msgs/MagneticField", "sensor_msgs/BatteryState")


@dataclass(frozen=True)
class Row:
    """What the robot of a type receives, and what its emulator then shows.

    ``command``: m/s, rad/s. ``settings``: by actuator. ``pulse``: m that one count of its odometry is,
    where that is more than a few hundredths of a millimetre.
    """

    robot: str
    command: tuple[float, float]
    settings: Mapping[str, list[int]] = field(default_factory=dict)
    lights: Mapping[str, int] = field(default_factory=dict)
    sound: int = 0
    pulse: float = 0.0


TWO, RING = [0, 1], [1, 0, 1, 1, 0, 0, 1, 0]
RING_SHOWN = {f"led{number}": value for number, value in enumerate(RING)}
LAMPS = {"body_light": [1], "front_light": [1]}
LAMPS_SHOWN = {"body": 1, "front": 1}
COLOURS = [10, 20, 30, *[0] * 9]  # without `leds`, which sets the same lights: the one that comes last counts
TABLE = (
    Row("koala", (0.2, -0.3), {"leds": TWO}, {"led0": 0, "led1": 1}),
    Row("koala25", (0.2, 0.3)),
    Row("khepera3", (0.1, 0.5), {"leds": TWO}, {"led0": 0, "led1": 1}),
    Row("epuck", (0.05, 0.4), {"leds": RING, **LAMPS, "sound": [3]}, {**RING_SHOWN, **LAMPS_SHOWN}, 3),
    Row("binary", (0.05, -0.4), {"leds": RING, **LAMPS}, {**RING_SHOWN, **LAMPS_SHOWN}),
    Row(
        "epuck2",
        (0.06, 0.4),
        {**LAMPS, "colours": COLOURS},
        {"led1_red": 10, "led1_green": 20, "led1_blue": 30, "led3_red": 0, **LAMPS_SHOWN},
    ),
    Row("rover", (0.2, 0.5), pulse=math.tau * 0.0325 / 20),
)


@dataclass(frozen=True)
class Used:
    """What a user saw of one robot, and what it truly did.

    ``verdicts``: of `status`, state and message by topic. ``came``: frame and child by topic, of its first
    message. ``driving``: the state of the emulator then. ``standstill``: s after the last command.
    """

    topics: Mapping[str, str]
    verdicts: Mapping[str, tuple[str, str]]
    came: Mapping[str, list[str]]
    statuses: list[str]
    driving: Mapping[str, Any]
    way: Pose
    length: float
    odometry: Pose
    standstill: float


class User:
    """The node of user_of_robots.py on the host."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def line(self) -> str | None:
        """Its next line; None if none comes."""
        assert self._process.stdout is not None
        readable, _, _ = select.select([self._process.stdout], [], [], PATIENCE)
        return self._process.stdout.readline() if readable else None

    def next(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()


@contextmanager
def using(swarm: LabSwarm, robots: Mapping[str, Any]) -> Iterator[User]:
    script, pipe = USER.read_text("utf-8"), subprocess.PIPE
    command = f"{SOURCE}; exec python3 -uc {quoted(script)} {quoted(json.dumps(robots))}"
    argv = swarm.shell_argv(HOST, command)
    with child_process(argv, stdin=pipe, stdout=pipe) as process:
        yield User(process)


@pytest.fixture(scope="module", params=["noetic", "jazzy"])
def table(request: pytest.FixtureRequest, workplace: Path) -> Mapping[str, Used]:
    """All robots of a lab, used at once by one node."""
    spec = workplace / f"all-types-{request.param}.yaml"
    spec.write_text(SPEC.read_text("utf-8").replace("noetic", request.param))
    if request.param != "noetic":
        skip_without_wheels(spec)
    folder = workplace / f"all-{request.param}"
    folder.mkdir()
    with lab_of(f"all-{request.param}-{os.getpid()}", spec, folder) as swarm:
        deploy = swarm.deploy()
        assert deploy.status == 0, deploy.out + deploy.err
        return used(swarm)


def used(swarm: LabSwarm) -> Mapping[str, Used]:
    found, _ = load_swarm(swarm.spec)
    assert found is not None
    topics = {name: {one.name: one.type for one in robot.topics} for name, robot in found.robots.items()}
    status = swarm.swarmctl("status", "--json").json()
    robots = {
        row.robot: {"topics": topics[row.robot], "command": row.command, "settings": row.settings}
        for row in TABLE
    }
    before = {row.robot: swarm.truth(row.robot) for row in TABLE}  # the user commands as soon as it can
    with using(swarm, robots) as user:
        if user.line() is None:
            user.next()
            user.line()
        time.sleep(STRETCH)
        driving, lost = swarm.robots(), withheld()
        user.next()
        silent = float(user.line() or "nan")
        ahead = time.monotonic() - silent
        stood = swarm.seconds_to_standstill(*robots)
        lost = withheld() - lost
        user.next()
        seen = json.loads(user.line() or "{}")
    after = swarm.robots()
    return {
        name: Used(
            topics=topics[name],
            verdicts={
                one["subject"].split()[0].removeprefix(f"/{name}/"): (one["state"], one["message"])
                for one in status["findings"]
                if one["check"] == "topic" and one["robot"] == name
            },
            came=seen[name]["frames"],
            statuses=seen[name]["statuses"],
            driving=driving[name],
            way=swarm.truth(name).seen_from(before[name]),
            length=after[name]["distance"],
            odometry=Pose(*seen[name]["poses"][-1]).seen_from(Pose(*seen[name]["poses"][0])),
            standstill=ahead + stood[name] - lost,
        )
        for name in robots
    }


def frame_of(robot: str, topic: str, kind: str) -> list[str]:
    """The frame of the messages of a topic, and the child that odometry has."""
    if kind == "nav_msgs/Odometry":
        return [f"{robot}/odom", f"{robot}/base_link"]
    if kind == "sensor_msgs/Range":
        return [f"{robot}/{topic.replace('/', '_')}", ""]
    return [f"{robot}/base_link" if kind in BASE else "", ""]


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.robot)
class TestARobotOfEachType:
    def test_publishes_what_its_type_declares(self, row: Row, table: Mapping[str, Used]) -> None:
        got = table[row.robot]
        assert got.came == {topic: frame_of(row.robot, topic, kind) for topic, kind in got.topics.items()}

    def test_publishes_at_the_rates_of_its_type(self, row: Row, table: Mapping[str, Used]) -> None:
        """A low rate is a warning where the machine is busy."""
        verdicts = table[row.robot].verdicts
        assert "odom" in verdicts
        assert {topic: one for topic, one in verdicts.items() if one[0] not in ("ok", "warning")} == {}

    def test_drives_as_commanded(self, row: Row, table: Mapping[str, Used]) -> None:
        driving = table[row.robot].driving
        assert (driving["v"], driving["omega"]) == pytest.approx(row.command, rel=0.05)

    def test_odometry_agrees(self, row: Row, table: Mapping[str, Used]) -> None:
        got = table[row.robot]
        astray = math.dist((got.odometry.x, got.odometry.y), (got.way.x, got.way.y))
        assert got.length > 0
        assert astray <= 0.02 * got.length + row.pulse
        turned = wrapped(got.odometry.theta - got.way.theta)
        assert turned == pytest.approx(0, abs=0.05 + row.pulse / SEPARATION)

    def test_stands_when_nobody_commands(
        self, row: Row, table: Mapping[str, Used], promise: Promise, request: pytest.FixtureRequest
    ) -> None:
        ros = request.node.callspec.params["table"]
        promise(
            f"{ros}: standstill of {row.robot} after the last command", table[row.robot].standstill, STANDS
        )

    def test_shows_what_it_is_set_to(self, row: Row, table: Mapping[str, Used]) -> None:
        driving = table[row.robot].driving
        assert {name: driving["lights"][name] for name in row.lights} == row.lights
        assert driving["sound"] == row.sound

    def test_reports(self, row: Row, table: Mapping[str, Used]) -> None:
        assert table[row.robot].statuses == [f"{row.robot}: driver"]
