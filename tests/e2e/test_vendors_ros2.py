"""Robots of the catalog that packages of ROS 2 drive, deployed: stand-ins of the packages, behind gates."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests import ROOT
from tests.e2e.dead_man import commanding
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import SWARM, LabSwarm, lab_of, until
from tests.timing import Promise

DESK, PILOT = "desk", "pilot"
ROBOTS = ("tb3", "tb4", "roomba", "jackal", "puck", "uav")
SPEED = 0.1  # m/s
STOPPED = 1.0  # s: 0.5 s; the true state is 0.1 s old, and ssh takes its time


def spec() -> Mapping[str, Any]:
    """The spec of the golden files; a node of these tests commands the robots that have gates."""
    found = yaml.safe_load((ROOT / "tests/render/ros2/vendors.yaml").read_text("utf-8"))
    pilot = {"host": DESK, "package": "piloting", "executable": PILOT}
    found |= {
        "name": SWARM,
        "robots": {name: found["robots"][name] for name in ROBOTS},
        "links": [one for one in found["links"] if one.get("robot", ROBOTS[0]) in ROBOTS],
        "programs": {PILOT: {**pilot, "lifecycle": "interactive", "optional": True}},
        "control": [{"by": PILOT, "of": [*ROBOTS]}],
    }
    return found


@pytest.fixture(scope="module")
def fleet(workplace: Path) -> Iterator[LabSwarm]:
    file = workplace / "vendors-2.yaml"
    file.write_text(yaml.safe_dump(spec()))
    skip_without_wheels(file)
    with lab_of(f"vendors2-{os.getpid()}", file, workplace) as found:
        run = found.deploy()
        assert run.status == 0, run.out + run.err
        yield found


def test_all_is_healthy_but_the_topic_whose_type_a_lab_lacks(fleet: LabSwarm) -> None:
    shown = [""]

    def settled() -> bool:
        shown[0] = fleet.swarmctl("status").out
        lacking = "topic /uav/mavros/state of uav: is not published"
        return "1 cause, 0 symptoms;" in shown[0] and lacking in shown[0]

    until(settled, lambda: shown[0])


def test_each_drives_by_its_gate_until_its_commander_dies(fleet: LabSwarm, promise: Promise) -> None:
    with commanding(fleet, DESK, dict.fromkeys(ROBOTS, SPEED), PILOT) as commander:
        commander.command(1.0)
        until(lambda: {one["v"] for one in fleet.robots().values()} == {SPEED}, "not all drive")
        began = commander.send(signal.SIGKILL)
        for robot in ROBOTS:
            fleet.seconds_to_standstill(robot)
        took = time.monotonic() - began
    promise("six robots of vendors, ROS 2: commander killed, until all stand", took, STOPPED)


def test_a_stranger_moves_none(fleet: LabSwarm) -> None:
    before = {name: one["distance"] for name, one in fleet.robots().items()}
    with commanding(fleet, "puck-pi", dict.fromkeys(ROBOTS, SPEED), "stranger") as stranger:
        stranger.command(1.0)
        shown = [""]

        def rejected() -> bool:
            shown[0] = fleet.swarmctl("status").out
            return "the gate rejected /stranger" in shown[0]

        until(rejected, lambda: shown[0])
    assert {name: one["distance"] for name, one in fleet.robots().items()} == before
