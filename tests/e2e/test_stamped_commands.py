"""Commanders of Jazzy that publish TwistStamped, as Nav2 and the teleop of TurtleBots do: stand-ins."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import SWARM, LabSwarm, Publisher, lab_of, quoted, until
from tests.timing import Promise

DESK, ROBOTS, SPEED = "desk", ("tb-1", "tb-2"), 0.1
NAV, TELEOP = "nav", "keys"
STOPPED = 1.0  # s: 0.5 s; the true state is 0.1 s old, and ssh takes its time
TOPICS = ", ".join(
    f"{{topic: /{one.replace('-', '_')}/cmd_vel, type: geometry_msgs/TwistStamped}}" for one in ROBOTS
)
SPEC = f"""\
version: 1
name: {SWARM}
mode: central
hub: {DESK}
ros: {{distro: jazzy}}
hosts:
  {DESK}: {{address: 192.168.77.10, user: robot}}
  tb-[1-2]: {{address: "192.168.77.2[1-2]", user: robot}}
robots:
  tb-[1-2]: {{type: turtlebot3-burger, host: "tb-[1-2]"}}
links:
  - {{kind: wlan, name: air, hosts: [{DESK}, tb-1, tb-2]}}
programs:
  {NAV}:
    host: {DESK}
    package: nav2_controller
    executable: controller_server
    lifecycle: interactive
    optional: true
    publishes: [{TOPICS}]
  {TELEOP}:
    host: {DESK}
    package: turtlebot3_teleop
    executable: teleop_keyboard
    lifecycle: interactive
    optional: true
    publishes: [{TOPICS}]
control:
  - {{by: {NAV}, of: ["tb-*"]}}
  - {{by: {TELEOP}, of: ["tb-*"], priority: 1}}
"""
#: It sends both robots forward; its stamps are of some seconds ago.
_COMMANDER = f"""\
import sys, time, rclpy
from geometry_msgs.msg import TwistStamped
from rclpy.duration import Duration
name, rate, frame, age = sys.argv[1:]
rclpy.init()
node = rclpy.create_node(name)
publishers = [node.create_publisher(TwistStamped, f"/tb_{{one}}/cmd_vel", 1) for one in (1, 2)]
command = TwistStamped()
command.header.frame_id, command.twist.linear.x = frame, {SPEED}
while True:
    command.header.stamp = (node.get_clock().now() - Duration(seconds=float(age))).to_msg()
    for one in publishers:
        one.publish(command)
    time.sleep(1 / float(rate))
"""


@pytest.fixture(scope="module")
def fleet(workplace: Path) -> Iterator[LabSwarm]:
    spec = workplace / "stamped.yaml"
    spec.write_text(SPEC)
    skip_without_wheels(spec)
    with lab_of(f"stamped-{os.getpid()}", spec, workplace) as found:
        run = found.deploy()
        assert run.status == 0, run.out + run.err
        yield found


def commanding(
    fleet: LabSwarm, name: str, rate: int, frame: str, age: float
) -> AbstractContextManager[Publisher]:
    words = (_COMMANDER, name, str(rate), frame, str(age))
    return fleet.running(DESK, f"python3 -uc {' '.join(map(quoted, words))}")


@pytest.mark.parametrize(("name", "rate", "frame"), [(NAV, 20, "base_link"), (TELEOP, 10, "")])
def test_robots_drive_by_stamped_commands_until_their_commander_dies(
    fleet: LabSwarm, promise: Promise, name: str, rate: int, frame: str
) -> None:
    with commanding(fleet, name, rate, frame, 0.0) as commander:
        until(lambda: {one["v"] for one in fleet.robots().values()} == {SPEED}, "not all drive")
        began = time.monotonic()
        commander.kill()
        for robot in ROBOTS:
            fleet.seconds_to_standstill(robot)
        took = time.monotonic() - began
    promise(f"two TurtleBots, stamped commands: {name} killed, until both stand", took, STOPPED)


@pytest.mark.parametrize(("age", "off"), [(5.0, "5.0 s old"), (-5.0, "5.0 s ahead of time")])
def test_old_stamps_move_none_and_status_names_their_sender(fleet: LabSwarm, age: float, off: str) -> None:
    before = {name: one["distance"] for name, one in fleet.robots().items()}
    shown = [""]

    def named() -> bool:
        shown[0] = fleet.swarmctl("status").out
        return shown[0].count(f"refuses /{NAV}: its command was {off} by its stamp") >= len(ROBOTS)

    with commanding(fleet, NAV, 20, "base_link", age):
        until(named, lambda: shown[0])
    assert {name: one["distance"] for name, one in fleet.robots().items()} == before
