"""Odometry of a sketch's counts: pairs of one turn, whatever frame is lost."""

from __future__ import annotations

import struct

import pytest
from swarm_onboard.driver.kinematics import Odometry, Wheels
from swarm_onboard.driver.protocols import RosserialProtocol
from swarm_onboard.rosserial.topics import Topic

from tests.onboard.driver.fakes import config_for

LEFT, RIGHT = "lwheel", "rwheel"
TOPICS = {
    name: Topic(104 + number, name, "std_msgs/Int32", md5sum="", capacity=128, published=True)
    for number, name in enumerate((LEFT, RIGHT))
}
PERIOD, APART = 0.1, 0.002  # s: between two turns, and between the two frames of one


@pytest.mark.parametrize("lost", [LEFT, RIGHT])
@pytest.mark.parametrize("period", [PERIOD, PERIOD / 2])
def test_a_lost_frame_costs_one_turn_and_bends_no_way(lost: str, period: float) -> None:
    config = config_for("arduino-rover")
    assert isinstance(config.protocol, RosserialProtocol)
    wheels = Wheels(config.protocol, config.kinematics, Odometry())
    poses = []
    for turn in range(20):
        for side, moment in ((LEFT, turn * period), (RIGHT, turn * period + APART)):
            if (turn, side) != (10, lost):
                poses.append(wheels.take(TOPICS[side], struct.pack("<i", turn), 100.0 + moment))
    taken = [pose for pose in poses if pose is not None]
    assert len(taken) == 19
    assert taken[-1].driven == pytest.approx(19 * taken[1].driven)
    assert all(pose.yaw == 0.0 for pose in taken)


def test_turns_read_in_one_go_cause_no_jump_and_no_sudden_speed() -> None:
    config = config_for("arduino-rover")
    assert isinstance(config.protocol, RosserialProtocol)
    wheels = Wheels(config.protocol, config.kinematics, Odometry())
    speed = config.kinematics.wheel_speed_max
    step = round(speed * PERIOD / wheels.scale.metres_per_count)
    moments = [0.0, 0.1, 0.2, *[0.8] * 6, 0.9, 1.0]  # s; nothing was read from 0.2 s on
    poses = []
    for turn, moment in enumerate(moments):
        wheels.take(TOPICS[LEFT], struct.pack("<i", turn * step), 100.0 + moment)
        poses.append(wheels.take(TOPICS[RIGHT], struct.pack("<i", turn * step), 100.0 + moment + APART))
    last = poses[-1]
    assert last is not None
    assert wheels.odometry.jumps == 0
    assert last.driven == pytest.approx((len(moments) - 1) * step * wheels.scale.metres_per_count)
    assert max(pose.linear for pose in poses if pose) <= 1.01 * speed


def test_a_late_pair_before_a_lost_one_causes_no_false_speed() -> None:
    """Measured once: 0.817 m/s in `odom` while no wheel went faster than 0.275 m/s."""
    config = config_for("arduino-rover")
    assert isinstance(config.protocol, RosserialProtocol)
    wheels = Wheels(config.protocol, config.kinematics, Odometry())
    step = 3  # counts a turn
    speed = step * wheels.scale.metres_per_count / PERIOD
    arrivals = {0: 0.0, 1: 0.1, 2: 0.333, 4: 0.4, 5: 0.5}  # one is 0.133 s late, the next lost
    poses = []
    for turn, moment in arrivals.items():
        wheels.take(TOPICS[LEFT], struct.pack("<i", turn * step), 100.0 + moment)
        poses.append(wheels.take(TOPICS[RIGHT], struct.pack("<i", turn * step), 100.0 + moment + APART))
    speeds = [pose.linear for pose in poses if pose]
    assert speeds[2:] == pytest.approx([speed * 0.1 / 0.233, speed, speed])
    assert max(speeds) <= 1.01 * speed
