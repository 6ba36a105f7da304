"""Which robots of a lab have a stand-in, and what the disk of their host has for it."""

from __future__ import annotations

import json
import os
import subprocess
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from swarm_onboard.stand_in.config import load

from swarmctl.lab.driver_stand_ins import files, state_in
from swarmctl.lab.emulators.emulator_lookup import build_robot
from swarmctl.lab.lab_plan import LabPlan, Workspace, plan_of
from swarmctl.lab.lab_state import State
from swarmctl.render.build_bundle import bundles
from tests.lab.lab_values import swarm_from
from tests.ros_packages.packages import manifest

SPEC = """
version: 1
name: burgers
mode: central
hub: desk
hosts:
  desk: {address: 10.77.1.1}
types:
  burger:
    title: Burger
    driver:
      package: turtlebot3_bringup
      launch: turtlebot3_robot.launch
      args: {multi_robot_name: "{namespace}"}
      publishes:
        - {topic: odom, type: nav_msgs/Odometry, rate: 30.0}
        - {topic: state, type: mavros_msgs/State, rate: 1.0}
    kinematics: {kind: differential, linear_max: 0.22, angular_max: 2.84, wheel_separation: 0.16}
    settings: {limits: {linear: 0.1}}
  pioneer:
    title: Pioneer
    driver:
      package: rosaria
      executable: RosAria
      params: {port: "{device}"}
      requires: [aria_msgs, tf]
      subscribes: [{topic: cmd_motors, type: std_msgs/Bool}]
    kinematics: {kind: differential, linear_max: 0.7, angular_max: 2.0}
    link: {kinds: [serial], baud: 9600}
robots:
  b-1: {type: burger, host: desk}
  b2:
    type: burger
    host: desk
    driver: {package: turtlebot3_bringup, launch: turtlebot3_robot.launch, args: {model: burger}}
  p1: {type: pioneer, host: desk}
  k1: {type: koala, host: desk}
links:
  - {kind: serial, host: desk, robot: p1, device: /dev/ttyS0}
  - {kind: serial, host: desk, robot: k1, device: /dev/ttyS1}
"""


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> LabPlan:
    return plan_of(swarm_from(tmp_path_factory.mktemp("lab"), SPEC))


@pytest.fixture
def disk(plan: LabPlan, tmp_path: Path) -> Path:
    return disk_of(plan, tmp_path)


def disk_of(plan: LabPlan, folder: Path) -> Path:
    for one in files(plan.stand_ins, plan.distros[0]):
        path = folder / one.path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(one.content)
        path.chmod(0o755 if one.executable else 0o644)
    return folder


def test_robots_with_a_foreign_driver_have_a_stand_in(plan: LabPlan) -> None:
    assert [one.robot for one in plan.stand_ins] == ["b-1", "b2", "p1"]
    assert {robot.name: robot.emulator for robot in plan.robots} == {"p1": "silent", "k1": "koala"}
    assert build_robot("silent").receive(b"\xfa\xfb\x03\x00") == b""


def test_a_plan_with_stand_ins_survives_its_file(plan: LabPlan) -> None:
    assert LabPlan.from_json(json.loads(json.dumps(plan.to_json()))) == plan


def test_a_launch_file_declares_the_arguments_of_all_its_robots(disk: Path) -> None:
    launch = ElementTree.parse(disk / "usr/share/turtlebot3_bringup/launch/turtlebot3_robot.launch").getroot()
    assert {one.get("name") for one in launch.iter("arg")} == {"multi_robot_name", "model"}
    assert [one.get("pkg") for one in launch.iter("node")] == ["swarm_stand_in"]


def test_an_executable_starts_the_stand_in_of_this_disk(disk: Path) -> None:
    starter = disk / "usr/share/rosaria/RosAria"
    text = starter.read_text().replace("/usr", f"{disk}/usr")
    starter.write_text(text.replace("exec ", "exec /bin/echo "))
    done = subprocess.run([starter, "__name:=driver"], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [f"{disk}/usr/share/swarm_stand_in/stand_in.py", "__name:=driver"]
    assert (disk / "usr/share/swarm_stand_in/stand_in.py").stat().st_mode & 0o111


def test_the_node_reads_what_the_lab_wrote(disk: Path) -> None:
    config = load(disk / "usr/share/swarm_stand_in/robots", "/b_1/")
    assert (config.robot, config.command, config.odom_frame) == ("b-1", "cmd_vel", "odom")
    assert config.frame_of("base_link") == "base_link", "its driver is passed no prefix"
    assert config.limits == (0.22, 0.0, 0.0, 2.84), "the vendor's limits, not those of the spec"
    assert [(one.topic, one.rate) for one in config.outputs] == [("odom", 30.0), ("state", 1.0)]
    assert load(disk / "usr/share/swarm_stand_in/robots", "/p1").inputs == (("cmd_motors", "std_msgs/Bool"),)


def test_an_installed_package_needs_no_stand_in(plan: LabPlan, tmp_path: Path) -> None:
    image, workspace = tmp_path / "image", Workspace(f"{tmp_path}/ws/devel", "/opt/ros/noetic", ())
    state = State(replace(plan, workspace=workspace), {"noetic": image})
    assert [one.robot for one in state.stand_ins] == ["b-1", "b2", "p1"]
    put(image / "usr/share/rosaria/package.xml")
    assert [one.robot for one in state.stand_ins] == ["b-1", "b2"]
    put(tmp_path / "ws/devel/share/turtlebot3_bringup/cmake/turtlebot3_bringupConfig.cmake")
    places = [state.installed_in(one.host, one.package) for one in plan.stand_ins]
    assert places == ["the workspace"] * 2 + ["the image"]


def test_a_package_that_travels_needs_no_stand_in(tmp_path: Path) -> None:
    put(tmp_path / "pioneers/package.xml", manifest("rosaria"))
    swarm = swarm_from(tmp_path, f"{SPEC}packages:\n  rosaria: {{from: ./pioneers}}\n")
    assert [one.robot for one in plan_of(swarm).stand_ins] == ["b-1", "b2"]


def put(path: Path, text: str = "") -> None:
    path.parent.mkdir(parents=True)
    path.write_text(text)


def test_what_a_driver_requires_has_a_stand_in_too(plan: LabPlan, disk: Path, tmp_path: Path) -> None:
    assert "<name>aria_msgs</name>" in (disk / "usr/share/aria_msgs/package.xml").read_text()
    image = tmp_path / "image"
    put(image / "usr/share/tf/package.xml")
    missing = {one.robot: one.requires for one in State(plan, {"noetic": image}).stand_ins}
    assert missing["p1"] == ("aria_msgs",), "a package of the image keeps its own files"


def test_message_packages_that_a_lab_lacks_are_named(plan: LabPlan, tmp_path: Path) -> None:
    image, space = tmp_path / "image", tmp_path / "devel"
    (image / "usr/lib/python3/dist-packages/nav_msgs").mkdir(parents=True)
    assert State(plan, {"noetic": image}).missing_messages(plan.stand_ins[0]) == ("mavros_msgs",)
    (space / "lib/python3/dist-packages/mavros_msgs").mkdir(parents=True)
    built = replace(plan, workspace=Workspace(str(space), "/opt/ros/noetic", ()))
    assert State(built, {"noetic": image}).missing_messages(plan.stand_ins[0]) == ()


def test_the_true_state_is_the_one_that_the_node_wrote(plan: LabPlan, tmp_path: Path) -> None:
    one = plan.stand_ins[0]
    assert state_in(None, one)["v"] == 0.0
    assert state_in(tmp_path, one)["v"] == 0.0
    written = tmp_path / one.state.lstrip("/")
    written.parent.mkdir(parents=True)
    written.write_text('{"x": 1.5, "v": 0.22, "left": 0.22, "right": 0.22}')
    assert (state_in(tmp_path, one)["x"], state_in(tmp_path, one)["v"]) == (1.5, 0.22)
    written.write_text("{")
    assert state_in(tmp_path, one)["v"] == 0.0


ROS_2 = SPEC.replace("hub: desk\n", "hub: desk\nros: {distro: kilted}\n")


@pytest.fixture
def ros_2(tmp_path: Path) -> Path:
    return ros_2_disk(tmp_path, ROS_2)


def ros_2_disk(tmp_path: Path, text: str) -> Path:
    """The disk of a host with ROS 2; its stand-in prints its environment and its arguments."""
    swarm = swarm_from(
        tmp_path, text.replace("publishes:\n", "environment: {MODEL: burger}\n      publishes:\n", 1)
    )
    disk = disk_of(plan_of(swarm), tmp_path / "disk")
    for file in bundles(swarm)["desk"].files:
        if file.path.endswith(".launch.xml"):
            (tmp_path / Path(file.path).name).write_bytes(file.content)
    (disk / "usr/share/swarm_stand_in/stand_in.py").write_text('#!/bin/sh\necho "$MODEL" "$@"\n')
    command = disk / "opt/ros/kilted/bin/ros2"
    command.write_text(command.read_text().replace("/usr/share", f"{disk}/usr/share"))
    return disk


def ros2_launch(disk: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [disk / "opt/ros/kilted/bin/ros2", *words],
        capture_output=True, text=True, check=False,
        env={**os.environ, "AMENT_PREFIX_PATH": f"/nowhere:{disk}/opt/ros/kilted"},
    )  # fmt: skip


def test_ros_2_finds_the_packages_of_stand_ins(ros_2: Path) -> None:
    index = {
        file.name for file in (ros_2 / "opt/ros/kilted/share/ament_index/resource_index/packages").iterdir()
    }
    assert index == {"turtlebot3_bringup", "rosaria", "aria_msgs", "tf", "ros2launch"}
    assert (ros_2 / "opt/ros/kilted/lib/rosaria/RosAria").stat().st_mode & 0o111
    config = json.loads((ros_2 / "usr/share/swarm_stand_in/robots/p1.json").read_text())
    assert config["command"] == "cmd_vel"


def test_ros2_launch_becomes_the_stand_in_as_the_driver_would_be(ros_2: Path, tmp_path: Path) -> None:
    done = ros2_launch(ros_2, "launch", f"{tmp_path}/b-1.launch.xml")
    words = "burger --ros-args -r __ns:=/b_1 -r /b_1/cmd_vel:=/b_1/gate/cmd_vel"
    assert (done.stdout.strip(), done.stderr) == (words, "")


SPACED = "launch: turtlebot3_robot.launch\n      namespace_argument: ns"  # of b-1


def test_a_launch_file_can_set_the_namespace_itself(tmp_path: Path) -> None:
    swarm = swarm_from(tmp_path, SPEC.replace("launch: turtlebot3_robot.launch", SPACED, 1))
    disk = disk_of(plan_of(swarm), tmp_path / "disk")
    launch = ElementTree.parse(disk / "usr/share/turtlebot3_bringup/launch/turtlebot3_robot.launch").getroot()
    assert [one.get("ns") for one in launch.iter("node")] == ["$(arg ns)"]


def test_so_it_does_on_ros_2(tmp_path: Path) -> None:
    disk = ros_2_disk(tmp_path, ROS_2.replace("launch: turtlebot3_robot.launch", SPACED, 1))
    done = ros2_launch(disk, "launch", f"{tmp_path}/b-1.launch.xml")
    words = "burger --ros-args -r /b_1/cmd_vel:=/b_1/gate/cmd_vel -r __ns:=/b_1"
    assert (done.stdout.strip(), done.stderr) == (words, "")


@pytest.mark.parametrize(
    "words", [(), ("topic", "list"), ("launch", "swarm.launch.xml"), ("launch", "none.xml")]
)
def test_ros2_refuses_any_other_word(ros_2: Path, tmp_path: Path, words: tuple[str, ...]) -> None:
    done = ros2_launch(ros_2, *(str(tmp_path / one) if one.endswith("xml") else one for one in words))
    assert done.returncode == 1
    assert "a lab has no ros2 command" in done.stderr


def test_ros2_launch_runs_no_launch_file_of_another_package(ros_2: Path, tmp_path: Path) -> None:
    (ros_2 / "opt/ros/kilted/share/turtlebot3_bringup/launch/turtlebot3_robot.launch").write_text("<launch/>")
    done = ros2_launch(ros_2, "launch", f"{tmp_path}/b-1.launch.xml")
    assert (done.returncode, done.stdout) == (1, "")
    assert "turtlebot3_robot.launch has no stand-in" in done.stderr


def test_private_names_are_written_as_ros_2_has_them(tmp_path: Path) -> None:
    changed = ROS_2.replace("executable: RosAria", "executable: RosAria\n      command: ~cmd_vel")
    stand_in = next(one for one in plan_of(swarm_from(tmp_path, changed)).stand_ins if one.robot == "p1")
    assert json.loads(stand_in.config)["command"] == "~/cmd_vel"
