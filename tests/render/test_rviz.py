"""RViz shows each robot by its own names, and all in one frame where their starts are known."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import yaml

from swarmctl.render.build_bundle import bundles
from tests.loading import load_swarm

SPEC = """\
version: 1
name: seen
mode: leader
leader: pi
hosts:
  pi: {address: 192.168.77.12, user: robot, computer: raspberry-pi-3b}
  other: {address: 192.168.77.13, user: robot, computer: raspberry-pi-3b}
robots:
  k-1: {type: khepera3, host: pi, start: {x: 20 cm, y: -1.5, heading_deg: 90}}
  two: {type: epuck2, host: other}
links:
  - {kind: wlan, name: lab, hosts: [pi, other]}
  - {kind: serial, host: pi, robot: k-1, usb: {serial: K3}}
  - {kind: serial, host: other, robot: two, usb: {serial: EPUCK2}}
"""


def files_of(folder: Path, host: str, *changes: tuple[str, str]) -> dict[str, bytes]:
    text = SPEC
    for old, new in changes:
        text = text.replace(old, new)
    (folder / "swarm.yaml").write_text(text, "utf-8")
    swarm, found = load_swarm(folder / "swarm.yaml")
    assert swarm is not None, found
    return {one.path: one.content for one in bundles(swarm)[host].files}


def manager(files: dict[str, bytes]) -> Any:
    return yaml.safe_load(files["rviz/swarm.rviz"])["Visualization Manager"]


def test_every_robot_of_the_master_is_shown_by_its_own_names(tmp_path: Path) -> None:
    files = files_of(tmp_path, "pi")
    groups = {one["Name"]: one["Displays"] for one in manager(files)["Displays"] if "Displays" in one}
    assert list(groups) == ["k-1", "two"]
    by_class = {one["Class"]: one for one in groups["k-1"]}
    assert by_class["rviz/RobotModel"]["Robot Description"] == "/k_1/robot_description"
    assert by_class["rviz/RobotModel"]["TF Prefix"] == "k_1"
    assert by_class["rviz/Odometry"]["Topic"] == "/k_1/odom"
    assert by_class["rviz/LaserScan"]["Topic"] == "/k_1/proximity/scan"
    launch = ElementTree.fromstring(files["launch/view.launch"])
    prefixes = {group.get("ns"): group.find("node/param") for group in launch.iter("group")}
    assert {name: one.get("value") for name, one in prefixes.items() if one is not None} == {
        "k_1": "k_1",
        "two": "two",
    }


def test_robots_of_ros_packages_are_shown_by_their_own_frames(tmp_path: Path) -> None:
    """One without a URDF has no model; one whose driver adds no prefix has none in RViz."""
    (tmp_path / "plain.urdf").write_text('<robot name="plain"><link name="base_link" /></robot>')
    vendors = """
types:
  vendor:
    title: Base of a vendor
    driver: {package: base, executable: base, publishes: [{topic: /odom, type: nav_msgs/Odometry}]}
    kinematics: {kind: differential, linear_max: 0.5, angular_max: 2.0, wheel_separation: 0.14}
    urdf: plain.urdf
  mute: {title: Arm, driver: {package: arm, executable: arm}, kinematics: {kind: none}}
robots:
  tb: {type: turtlebot3-burger, host: pi}
  base: {type: vendor, host: pi}
  arm: {type: mute, host: pi}
"""
    files = files_of(tmp_path, "pi", ("\nrobots:\n", vendors))
    groups = {one["Name"]: one["Displays"] for one in manager(files)["Displays"] if "Displays" in one}
    assert list(groups) == ["tb", "base", "k-1", "two"]
    assert [one["Class"] for one in groups["tb"]] == ["rviz/Odometry", "rviz/LaserScan"]
    model, odometry = groups["base"]
    assert (model["Robot Description"], model["TF Prefix"]) == ("/base/robot_description", "")
    assert odometry["Topic"] == "/odom"
    launch = ElementTree.fromstring(files["launch/view.launch"])
    assert [group.get("ns") for group in launch.iter("group")] == ["base", "k_1", "two"]


def test_the_fixed_frame_may_be_that_of_a_vendors_odometry(tmp_path: Path) -> None:
    without = (", start: {x: 20 cm, y: -1.5, heading_deg: 90}", "")
    first = ("\n  k-1:", "\n  tb: {type: turtlebot3-burger, host: pi}\n  k-1:")
    assert manager(files_of(tmp_path, "pi", without, first))["Global Options"]["Fixed Frame"] == "tb/odom"


def test_the_window_has_the_panel_of_displays(tmp_path: Path) -> None:
    shown = yaml.safe_load(files_of(tmp_path, "pi")["rviz/swarm.rviz"])
    assert "rviz/Displays" in [one["Class"] for one in shown["Panels"]]


def test_two_people_may_look_at_once(tmp_path: Path) -> None:
    """A node of the same name would end the first one's."""
    launch = ElementTree.fromstring(files_of(tmp_path, "pi")["launch/view.launch"])
    named = [node.get("name", "") for node in launch.iter("node")]
    assert len(named) == 3
    assert [one for one in named if not one.startswith("$(anon ")] == []


def test_the_fixed_frame_is_the_map_where_a_start_is_known(tmp_path: Path) -> None:
    assert manager(files_of(tmp_path, "pi"))["Global Options"]["Fixed Frame"] == "map"
    without = files_of(tmp_path, "pi", (", start: {x: 20 cm, y: -1.5, heading_deg: 90}", ""))
    assert manager(without)["Global Options"]["Fixed Frame"] == "k_1/odom"


def test_only_the_host_of_the_master_has_the_files(tmp_path: Path) -> None:
    assert not {"rviz/swarm.rviz", "launch/view.launch"} & files_of(tmp_path, "other").keys()


def test_the_driver_gets_the_start_in_metres(tmp_path: Path) -> None:
    params = yaml.safe_load(files_of(tmp_path, "pi")["params/k-1.yaml"])
    assert params["start"] == {"x": 0.2, "y": -1.5, "heading_deg": 90.0}
    assert "start" not in yaml.safe_load(files_of(tmp_path, "other")["params/two.yaml"])
