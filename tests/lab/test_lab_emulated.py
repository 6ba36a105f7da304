"""Which emulator a lab's robot gets: ours by its type, or the one that lies beside a type of one's own."""

from __future__ import annotations

from pathlib import Path

import pytest
from lab_values import plan_from

from swarmctl.checks.check import read
from swarmctl.lab import lab
from swarmctl.lab.emulated import emulator_of, own_emulators, robot_of
from swarmctl.lab.emulators import TYPES
from swarmctl.lab.emulators.own import OwnRobotError
from swarmctl.lab.errors import LabError
from swarmctl.lab.plan import plan_of

ROOT = Path(__file__).parents[2]
BEETLE = """
from swarmctl.lab.emulators import Chassis, LineRobot

class Beetle(LineRobot):
    def __init__(self):
        super().__init__(Chassis(wheel_separation=0.1, metres_per_count=0.001, counter_bits=16))

    def answer(self, line):
        return b"ok"
"""


def test_every_type_of_the_catalog_has_an_emulator() -> None:
    types = [file.stem for file in (ROOT / "templates/robots").glob("*.yaml")]
    assert types
    assert all(emulator_of(name, {}) in TYPES for name in types)


def test_a_type_that_is_another_way_to_speak_has_the_same_robot() -> None:
    assert emulator_of("epuck-binary", {}) == "epuck"
    assert emulator_of("nobody-knows", {}) == ""


def test_the_rover_of_the_example_is_emulated() -> None:
    swarm, _ = read(ROOT / "examples/arduino-rover/swarm.yaml")
    assert swarm is not None
    assert [robot.emulator for robot in plan_of(swarm).robots] == ["arduino-rover"]


def test_an_emulator_beside_a_type_of_ones_own_stands_for_it(tmp_path: Path) -> None:
    (tmp_path / "beetle.emulator.py").write_text(BEETLE)
    (tmp_path / "beetle.yaml").write_text("")
    own = own_emulators(tmp_path)
    assert emulator_of("beetle", own) == str(tmp_path / "beetle.emulator.py")
    robot = robot_of(emulator_of("beetle", own))
    assert (robot.type_name, robot.receive(b"x\r")) == ("beetle", b"ok")


def test_without_such_a_folder_there_are_none(tmp_path: Path) -> None:
    assert own_emulators(tmp_path / "robots") == {}


def test_a_wrong_emulator_is_told_before_anything_boots(tmp_path: Path) -> None:
    wrong = tmp_path / "khepera3.emulator.py"
    wrong.write_text("1 / 0\n")
    with pytest.raises(OwnRobotError):
        robot_of(str(wrong))
    plan = plan_from(tmp_path)
    assert plan.robots[0].emulator == "khepera3"
    swarm, _ = read(tmp_path / "spec.yaml")
    assert swarm is not None
    with pytest.raises(LabError, match=r"robot rover has no emulator: .*khepera3\.emulator\.py:1: Zero"):
        lab.up(plan_of(swarm, own=own_emulators(tmp_path)), lambda _: None)
