"""Drivers that vendors publish, deployed as robots: their own nodes, behind our gate.

Debian has none of these packages. $SWARMCTL_WORKSPACE names built workspaces, divided by colons; one of them
must hold everything here, built into `devel` or `install`: turtlebot3_fake (C++, of
https://github.com/ROBOTIS-GIT/turtlebot3_simulations at e9d809c) with turtlebot3_msgs; and arbotix_msgs,
control_msgs and trajectory_msgs, whose messages arbotix_python uses. The sources of arbotix_python (of
https://github.com/vanadiumlabs/arbotix_ros at 9a905f7) must be below its `src`. turtlebot3_fake is used as it
was built; arbotix_python is Python, and travels with the release. Both simulate their motors.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from tests.child_process import child_process
from tests.e2e.lab_needs import workspace_with
from tests.e2e.lab_swarm import SOURCE, SWARM, LabSwarm, lab_of, quoted, until
from tests.timing import Promise

BUILT = ("turtlebot3_fake", "turtlebot3_msgs", "arbotix_msgs", "control_msgs", "trajectory_msgs")
DESK, PI = "desk", "pi"
BURGER, ARM = "tb", "ax"
WISH = (0.3, 0.6)  # m/s and rad/s that the pilot commands
LIMITED = (0.15, 0.3)  # with half the speed on the same curve
SPEED = 0.2  # m/s
STOPPED = 1.0  # s: the gate's command_timeout of 0.5, a period of the odometry, and what ssh takes
UNIT = f"swarm-{SWARM}.{BURGER}.service"
SPEC = f"""\
version: 1
name: {SWARM}
mode: central
hub: {DESK}
hosts:
  {DESK}: {{address: 192.168.77.10, user: robot}}
  {PI}: {{address: 192.168.77.11, user: robot, workspaces: [WORKSPACE]}}
packages:
  arbotix_python: {{from: ./arbotix_python}}
  piloting: {{from: ./piloting}}
types:
  arbotix:
    title: Base of an ArbotiX, simulated by its driver
    driver:
      package: arbotix_python
      executable: arbotix_driver
      requires: [arbotix_msgs, control_msgs]
      params:
        sim: true
        controllers:
          base:
            type: diff_controller
            rate: 20.0
            base_width: 0.14
            ticks_meter: 4100
            odom_frame_id: "{{frame}}/odom"
            base_frame_id: "{{frame}}/base_link"
      publishes: [{{topic: odom, type: nav_msgs/Odometry, rate: 15.0}}]  # of its loop of 100 Hz
    kinematics: {{kind: differential, linear_max: 0.5, angular_max: 2.0, wheel_separation: 0.14}}
robots:
  {ARM}: {{type: arbotix, host: {PI}}}
  {BURGER}:
    type: turtlebot3-burger
    host: {PI}
    settings: {{limits: {{linear: {LIMITED[0]}}}}}
    driver:
      package: turtlebot3_fake
      executable: turtlebot3_fake_node
      params: {{tb3_model: burger, odom_frame: "{{frame}}/odom", base_frame: "{{frame}}/base_footprint"}}
      remap: {{tb3_model: ~tb3_model, odom_frame: ~odom_frame, base_frame: ~base_frame}}
      publishes:
        - {{topic: odom, type: nav_msgs/Odometry, rate: 30.0}}
        - {{topic: joint_states, type: sensor_msgs/JointState, rate: 30.0}}
      stops_after: 1.0
links:
  - {{kind: wlan, name: air, hosts: [{DESK}, {PI}]}}
programs:
  pilot: {{host: {DESK}, package: piloting, executable: pilot}}
control:
  - {{by: pilot, of: [{ARM}, {BURGER}]}}
"""
PACKAGE = """<package format="2"><name>piloting</name><version>1.0.0</version>
<description>drives</description><maintainer email="a@b.example">a</maintainer><license>BSD</license>
</package>"""
PROGRAM = f"""#!/bin/sh
exec rostopic pub -r 10 /{BURGER}/cmd_vel geometry_msgs/Twist '[{WISH[0]}, 0, 0]' '[0, 0, {WISH[1]}]' "$@"
"""


class Odometry:
    """What a robot's driver publishes as its velocity, received on its host, as it comes."""

    def __init__(self, fleet: LabSwarm, robot: str) -> None:
        self.frames = ("", "")
        self.velocity = (0.0, 0.0)  # m/s, rad/s
        command = f"{SOURCE}; export PYTHONUNBUFFERED=1; exec rostopic echo --noarr -p /{robot}/odom"
        argv = fleet.shell_argv(PI, command)
        self._process = subprocess.Popen(
            argv, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        keys = self._process.stdout.readline().rstrip().split(",")
        for line in self._process.stdout:
            found = dict(zip(keys, line.rstrip().split(","), strict=False))
            self.frames = (found["field.header.frame_id"], found["field.child_frame_id"])
            twist = "field.twist.twist"
            self.velocity = (float(found[f"{twist}.linear.x"]), float(found[f"{twist}.angular.z"]))

    def close(self) -> None:
        self._process.kill()
        self._reader.join(10)


@pytest.fixture(scope="module")
def fleet(workplace: Path) -> Iterator[LabSwarm]:
    workspace = workspace_with(*BUILT)
    folder = workplace / "vendors"
    source = next(Path(workspace).resolve().glob("src/**/arbotix_python/package.xml"), None)
    if source is None:
        pytest.skip(f"no arbotix_python below {workspace}/src: add its sources beside {', '.join(BUILT)}")
    shutil.copytree(source.parent, folder / "arbotix_python")
    (folder / "piloting").mkdir()
    (folder / "piloting/package.xml").write_text(PACKAGE)
    (folder / "piloting/pilot").write_text(PROGRAM)
    (folder / "piloting/pilot").chmod(0o755)
    spec = workplace / "vendors.yaml"
    spec.write_text(SPEC.replace("WORKSPACE", str(Path(workspace).resolve())))
    with lab_of(f"vendors-{os.getpid()}", spec, folder, "--workspace", workspace) as found:
        run = found.deploy()
        assert run.status == 0, run.out + run.err
        yield found


@contextmanager
def odometry_of(fleet: LabSwarm, robot: str) -> Iterator[Odometry]:
    found = Odometry(fleet, robot)
    try:
        until(lambda: found.frames != ("", ""), f"{robot} publishes no odometry")
        yield found
    finally:
        found.close()


@pytest.fixture(scope="module")
def burger(fleet: LabSwarm) -> Iterator[Odometry]:
    with odometry_of(fleet, BURGER) as found:
        yield found


@pytest.fixture(scope="module")
def arm(fleet: LabSwarm) -> Iterator[Odometry]:
    with odometry_of(fleet, ARM) as found:
        yield found


def stands(one: Odometry) -> Callable[[], bool]:
    return lambda: one.velocity == pytest.approx((0.0, 0.0), abs=1e-3)


def drives(one: Odometry, linear: float, angular: float = 0.0) -> Callable[[], bool]:
    return lambda: one.velocity == pytest.approx((linear, angular), abs=0.01)


def recovers(fleet: LabSwarm) -> None:
    shown = [""]

    def healthy() -> bool:
        run = fleet.swarmctl("status")
        shown[0] = run.out
        return run.status == 0

    try:
        until(healthy, "the swarm does not become healthy")
    except AssertionError as error:
        raise AssertionError(shown[0]) from error


def unhealthy_with(fleet: LabSwarm, line: str) -> bool:
    """Whether status prints ``line``; it is never healthy."""
    run = fleet.swarmctl("status")
    assert run.status == exit_codes.UNHEALTHY, run.out + run.err
    return line in run.out


def test_a_fresh_deploy_is_healthy_and_within_its_limits(fleet: LabSwarm, burger: Odometry) -> None:
    until(drives(burger, *LIMITED), "the pilot's robot does not drive at its limit")
    recovers(fleet)
    assert "commanded by pilot (/pilot)" in fleet.swarmctl("status").out


def test_frames_have_the_name_of_their_robot(burger: Odometry, arm: Odometry) -> None:
    assert burger.frames == (f"{BURGER}/odom", f"{BURGER}/base_footprint")
    assert arm.frames == (f"{ARM}/odom", f"{ARM}/base_link")


def test_no_robot_of_a_real_driver_has_a_stand_in(fleet: LabSwarm) -> None:
    assert fleet.robots() == {}


def test_a_driver_that_never_stops_is_stopped_by_its_gate(
    fleet: LabSwarm, arm: Odometry, promise: Promise
) -> None:
    with fleet.publishing(PI, ARM, SPEED) as publisher:
        until(drives(arm, SPEED), "the odometry does not follow the command")
        fleet.shell(PI, f"kill -9 {publisher.pid}")
        took = until(stands(arm), "it still drives")
    promise("arbotix_python: its commander is killed, until it stands", took, STOPPED)


def test_a_stranger_moves_neither_and_status_names_it(
    fleet: LabSwarm, arm: Odometry, burger: Odometry
) -> None:
    seen = set()
    with fleet.publishing(DESK, ARM, 0.77), fleet.publishing(DESK, BURGER, 0.77):

        def named() -> bool:
            seen.update({arm.velocity, *([burger.velocity] if burger.velocity[0] > 0.2 else ())})
            out = fleet.swarmctl("status").out
            lines = [f"on 192.168.77.10 on /{robot}/cmd_vel; rejected by the gate" for robot in (ARM, BURGER)]
            return all(line in out for line in lines)

        until(named, "a refusal is not reported")
    assert seen == {(0.0, 0.0)}


def test_a_killed_driver_is_named_and_comes_back(fleet: LabSwarm, burger: Odometry) -> None:
    """Killed again and again: systemd starts another each time."""
    node = "turtlebot3_fake_node"
    killing = f"while sleep 0.2; do for one in $(pidof {node}); do kill -9 $one; done; done"
    argv = fleet.shell_argv(PI, f"exec timeout 120 sh -c {quoted(killing)}")
    with child_process(argv, stdin=subprocess.DEVNULL):
        until(lambda: UNIT in fleet.swarmctl("status").out, "status does not name the driver's unit")
        lost = "no node subscribes to /tb/gate/cmd_vel: commands do not reach the driver"
        until(lambda: unhealthy_with(fleet, lost), "status does not name the lost driver")
    fleet.shell(PI, f"for one in $(pgrep -x timeout); do kill $one; done; sudo systemctl restart {UNIT}")
    until(drives(burger, *LIMITED), "the pilot's robot does not drive again")
    recovers(fleet)
