"""Drivers of vendors behind their gates on ROS 2, deployed: by an executable, and by launch files."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.e2e.dead_man import commanding
from tests.e2e.gated import CART, DESK, EXECUTED, PI, SPEED, STOPPED, Gated, recovers
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import SOURCE, SWARM, LabSwarm, Publisher, lab_of, moves, until
from tests.timing import Promise

pytestmark = pytest.mark.slow

LAUNCHED, STAMPED = "burger", "stamped"
ROBOTS = (EXECUTED, LAUNCHED, STAMPED)
TOP = 0.15  # m/s of the burger, as its settings have it
PILOT = "ros2-topic-pub"  # whose node is the one by which these tests publish
SPEC = f"""\
version: 1
name: {SWARM}
mode: central
hub: {DESK}
ros: {{distro: kilted}}
hosts:
  {DESK}: {{address: 192.168.77.10, user: robot}}
  {PI}: {{address: 192.168.77.11, user: robot}}
types:
{CART}robots:
  {EXECUTED}: {{type: cart, host: {PI}}}
  {LAUNCHED}:
    type: cart
    host: {PI}
    settings: {{limits: {{linear: {TOP}}}}}
    driver:
      package: burger_bringup
      launch: robot.launch.py
      args: {{frame: "{{frame}}"}}
      environment: {{BURGER_MODEL: waffle}}
      publishes:
        - {{topic: odom, type: nav_msgs/Odometry, rate: 20.0}}
        - {{topic: scan, type: sensor_msgs/LaserScan, rate: 5.0}}
  {STAMPED}:
    type: cart
    host: {PI}
    driver:
      package: stamped_bringup
      launch: robot.launch.xml
      command: base/cmd_vel
      command_type: geometry_msgs/TwistStamped
      publishes: [{{topic: odom, type: nav_msgs/Odometry, rate: 10.0}}]
      subscribes: [{{topic: servo, type: vendor_msgs/Servo}}]
links:
  - {{kind: wlan, name: air, hosts: [{DESK}, {PI}]}}
programs:
  {PILOT}:
    host: {DESK}
    package: piloting
    executable: pilot
    lifecycle: interactive
    optional: true
control:
  - {{by: {PILOT}, of: ["*"]}}
"""


@pytest.fixture(scope="module")
def fleet(workplace: Path) -> Iterator[LabSwarm]:
    spec = workplace / "vendors-2.yaml"
    spec.write_text(SPEC)
    skip_without_wheels(spec)
    with lab_of(f"gate2-{os.getpid()}", spec, workplace) as found:
        run = found.deploy()
        assert run.status == 0, run.out + run.err
        yield found


def test_a_fresh_deploy_is_healthy(fleet: LabSwarm) -> None:
    recovers(fleet)
    out = fleet.swarmctl("status").out
    assert "odom 20" in out
    assert "scan 5" in out


def test_the_launch_file_of_a_robot_gives_its_driver_the_environment(fleet: LabSwarm) -> None:
    unit = f"swarm-{SWARM}.{LAUNCHED}.service"
    variables = fleet.shell(PI, f"tr '\\0' '\\n' </proc/$(systemctl show -P MainPID {unit})/environ")
    assert "BURGER_MODEL=waffle" in variables.splitlines()


def test_a_topic_without_its_type_is_left_out_and_logged(fleet: LabSwarm) -> None:
    log = fleet.shell(PI, f"sudo journalctl -o cat -u swarm-{SWARM}.{STAMPED}.service")
    assert "servo is left out: this host lacks vendor_msgs/Servo" in log


def test_the_lab_runs_no_launch_files_of_packages(fleet: LabSwarm) -> None:
    launch = "/opt/ros/kilted/share/burger_bringup/launch/robot.launch.py"
    for words in (f"launch {launch}", "topic list"):
        found = fleet.shell(PI, f"{SOURCE}; ros2 {words} 2>&1 || true")
        assert "a lab has no ros2 command" in found, words


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_drives_within_its_limits_until_its_commander_dies(
    fleet: LabSwarm, promise: Promise, robot: str
) -> None:
    top = TOP if robot == LAUNCHED else SPEED
    with fleet.driving(DESK, robot, SPEED) as publisher:
        until(lambda: fleet.robot(robot)["v"] == pytest.approx(top), f"{robot} does not drive at {top} m/s")
        began = time.monotonic()
        publisher.kill()
        fleet.seconds_to_standstill(robot)
        took = time.monotonic() - began
    promise(f"{robot} of a vendor, ROS 2: commander killed, until it stands", took, STOPPED)


def test_a_commander_whose_host_is_cut_off_moves_the_robot_no_more(fleet: LabSwarm, promise: Promise) -> None:
    with commanding(fleet, DESK, {EXECUTED: SPEED}, fleet.ros.stranger[1:]) as commander:
        commander.command(1.0)
        until(lambda: moves(fleet.robot(EXECUTED)), f"{EXECUTED} does not move")
        began = time.monotonic()
        fleet.cut(DESK)
        fleet.seconds_to_standstill(EXECUTED)
        took = time.monotonic() - began
        fleet.join(DESK)
        fleet.hang_up(DESK)
    promise("cart of a vendor, ROS 2: commander's host cut off, until it stands", took, STOPPED)
    fleet.seconds_to_standstill(EXECUTED)
    recovers(fleet)


def test_a_stranger_moves_nothing_and_status_names_it(fleet: LabSwarm) -> None:
    before = fleet.robots()
    with commanding(fleet, PI, dict.fromkeys(ROBOTS, SPEED), "stranger") as stranger:
        stranger.command(1.0)
        shown = [""]

        def named() -> bool:
            shown[0] = fleet.swarmctl("status").out
            return shown[0].count("waits for commands from /stranger") == len(ROBOTS)

        until(named, lambda: shown[0])
        assert "the gate rejected /stranger" in shown[0]
    for robot in ROBOTS:
        assert fleet.robot(robot)["distance"] == before[robot]["distance"]


class TestHoweverAGateEnds(Gated):
    """On ROS 2, where the gate's next start sends the zero; it obeys whoever commands then."""

    KILLED = 2.5
    HUNG = 4.5

    def then(self, commander: Publisher) -> None:
        commander.kill()
