"""Which emulator a lab's robot gets: ours by its type, or the one that lies beside a type of one's own."""

from __future__ import annotations

from pathlib import Path

import pytest
from lab_values import plan_from

from swarmctl.checks.check import read
from swarmctl.lab import lab
from swarmctl.lab.emulated import Measured, emulator_of, own_emulators, robot_of
from swarmctl.lab.emulators import TYPES
from swarmctl.lab.emulators.own import OwnRobotError
from swarmctl.lab.errors import LabError
from swarmctl.lab.plan import plan_of
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.params import params_of
from swarmctl.spec.settings import Calibration, RobotSettings

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


@pytest.mark.parametrize("type_name", ["koala", "epuck-binary", "koala-2.5"])
def test_odometry_of_a_calibrated_robot_agrees_with_its_way(type_name: str) -> None:
    """Its driver multiplies what the wheels count by what was measured; in the lab the robot is so."""
    measured = {"distance_scale": 1.25, "wheel_separation": 0.4}
    robot_type = load_catalog().types[type_name]
    params = params_of(
        robot_type,
        robot="r",
        namespace="/r",
        port="",
        settings=RobotSettings(calibration=Calibration(**measured)),
    )
    robot = robot_of(emulator_of(type_name, {}), Measured(**measured))
    wheels = robot.chassis.wheels
    robot.chassis.drive(0.05, 0.1)
    robot.advance(2.0)
    [scale] = params["kinematics"]["scales"]
    left, right = (wheel.count * scale["metres_per_count"] for wheel in wheels)
    state = robot.state
    assert (left + right) / 2 == pytest.approx(state.distance, rel=0.02)
    assert (right - left) / params["kinematics"]["wheel_separation"] == pytest.approx(state.theta, rel=0.02)
    assert (state.left, state.right) == pytest.approx((0.0625, 0.125))


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
