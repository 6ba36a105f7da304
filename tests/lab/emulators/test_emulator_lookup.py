"""Which emulator a lab's robot gets: ours by its type, or the one that lies beside a type of one's own."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.lab import lab
from swarmctl.lab.emulators import TYPES
from swarmctl.lab.emulators.emulator_lookup import Measured, build_robot, emulator_for, user_emulators
from swarmctl.lab.emulators.user_robot import UserRobotError
from swarmctl.lab.errors import LabError
from swarmctl.lab.lab_plan import plan_of
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.driver_params import params_of
from swarmctl.robot_types.settings import Calibration, RobotSettings
from swarmctl.spec.catalog import load_catalog
from tests import ROOT
from tests.lab.lab_values import plan_from
from tests.loading import load_swarm

BEETLE = """
from swarmctl.lab.emulators import Chassis, LineRobot

class Beetle(LineRobot):
    def __init__(self):
        super().__init__(Chassis(wheel_separation=0.1, metres_per_count=0.001, counter_bits=16))

    def answer(self, line):
        return b"ok"
"""


def test_every_type_of_the_catalog_has_an_emulator() -> None:
    types = with_protocol(load_catalog().types)
    assert types
    assert all(emulator_for(name, {}) in TYPES for name in types)


def test_a_second_protocol_uses_the_same_emulator() -> None:
    assert emulator_for("epuck-binary", {}) == "epuck"
    assert emulator_for("nobody-knows", {}) == ""


def test_the_rover_of_the_example_is_emulated() -> None:
    swarm, _ = load_swarm(ROOT / "examples/arduino-rover/swarm.yaml")
    assert swarm is not None
    assert [robot.emulator for robot in plan_of(swarm).robots] == ["arduino-rover"]


def test_a_user_type_uses_the_emulator_beside_it(tmp_path: Path) -> None:
    (tmp_path / "beetle.emulator.py").write_text(BEETLE)
    (tmp_path / "beetle.yaml").write_text("")
    own = user_emulators(tmp_path)
    assert emulator_for("beetle", own) == str(tmp_path / "beetle.emulator.py")
    robot = build_robot(emulator_for("beetle", own))
    assert (robot.type_name, robot.receive(b"x\r")) == ("beetle", b"ok")


@pytest.mark.parametrize("type_name", ["koala", "epuck-binary", "koala-2.5"])
def test_odometry_of_a_calibrated_robot_is_right(type_name: str) -> None:
    """Its driver multiplies what the wheels count by what was measured; in the lab the robot is so."""
    measured = {"distance_scale": 1.25, "wheel_separation": 0.4}
    robot_type = with_protocol(load_catalog().types)[type_name]
    params = params_of(
        robot_type,
        robot="r",
        namespace="/r",
        port="",
        settings=RobotSettings(calibration=Calibration(**measured)),
    )
    robot = build_robot(emulator_for(type_name, {}), Measured(**measured))
    wheels = robot.chassis.wheels
    robot.chassis.drive(0.05, 0.1)
    robot.advance(2.0)
    [scale] = params["kinematics"]["scales"]
    left, right = (wheel.count * scale["metres_per_count"] for wheel in wheels)
    state = robot.state
    assert (left + right) / 2 == pytest.approx(state.distance, rel=0.02)
    assert (right - left) / params["kinematics"]["wheel_separation"] == pytest.approx(state.theta, rel=0.02)
    assert (state.left, state.right) == pytest.approx((0.0625, 0.125))


def test_a_missing_folder_has_no_emulators(tmp_path: Path) -> None:
    assert user_emulators(tmp_path / "robots") == {}


def test_a_wrong_emulator_is_reported_before_anything_boots(tmp_path: Path) -> None:
    wrong = tmp_path / "khepera3.emulator.py"
    wrong.write_text("1 / 0\n")
    with pytest.raises(UserRobotError):
        build_robot(str(wrong))
    plan = plan_from(tmp_path)
    assert plan.robots[0].emulator == "khepera3"
    swarm, _ = load_swarm(tmp_path / "spec.yaml")
    assert swarm is not None
    with pytest.raises(LabError, match=r"robot rover has no emulator: .*khepera3\.emulator\.py:1: Zero"):
        lab.up(plan_of(swarm, own=user_emulators(tmp_path)), lambda _: None)
