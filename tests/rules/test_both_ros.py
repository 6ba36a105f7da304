"""A swarm of ROS 1 and ROS 2: a rule about one of them is silent about the hosts of the other."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import ROOT
from tests.loading import load_swarm

EXAMPLE = (ROOT / "examples/ros1-and-ros2/swarm.yaml").read_text("utf-8")
OLD, NEW = "koala-laptop", "tb3-pi"


def codes(folder: Path, *changes: tuple[str, str]) -> set[str]:
    text = EXAMPLE
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    (folder / "swarm.yaml").write_text(text, "utf-8")
    found = {one.code for one in load_swarm(folder / "swarm.yaml")[1]}
    assert not any(one.startswith("SPEC") for one in found), "the change is misspelt"
    return found


def program(host: str, more: str) -> tuple[str, str]:
    added = f"programs:\n  own: {{host: {host}, package: own, executable: own, {more}}}\n"
    return "programs:\n", added


@pytest.mark.parametrize(
    ("host", "more", "code", "is_found"),
    [
        (OLD, "environment: {ROS_MASTER_URI: 'http://a:1'}", "PROG008", True),
        (NEW, "environment: {ROS_MASTER_URI: 'http://a:1'}", "PROG008", False),
        (OLD, "environment: {ROS_DOMAIN_ID: '1'}", "PROG008", False),
        (NEW, "environment: {ROS_DOMAIN_ID: '1'}", "PROG008", True),
        (OLD, "params: {use_sim_time: true}", "PROG009", True),
        (NEW, "params: {use_sim_time: true}", "PROG009", False),
        (OLD, "environment: {URI: '{master_uri}'}", "PROG027", False),
        (NEW, "environment: {URI: '{master_uri}'}", "PROG027", True),
    ],
)
def test_a_program_is_judged_by_the_ros_of_its_host(
    tmp_path: Path, host: str, more: str, code: str, is_found: bool
) -> None:
    assert (code in codes(tmp_path, program(host, more))) == is_found


@pytest.mark.parametrize(
    ("by", "of", "is_found"),
    [(OLD, "koala", False), (OLD, "tb3", True), (NEW, "koala", True), (NEW, "tb3", True)],
)
def test_a_host_commands_robots_of_its_own_master_only(
    tmp_path: Path, by: str, of: str, is_found: bool
) -> None:
    """A relay brings the names of nodes, not their hosts."""
    change = "control:\n", f"control:\n  - {{by: {by}, of: [{of}], priority: 5}}\n"
    assert ("AUTH012" in codes(tmp_path, change)) == is_found


@pytest.mark.parametrize(
    ("change", "code", "is_found"),
    [
        (("mode: combined\n", "mode: combined\nros: {domain: 7, master_port: 11411}\n"), "ROS001", False),
        (("distro: jazzy", "distro: noetic"), "DRIVER004", False),
        (("turtlebot3-burger", "turtlebot4"), "DRIVER004", False),
        (("distro: jazzy}", "distro: noetic}\nros: {domain: 7}"), "ROS001", True),
    ],
)
def test_settings_and_drivers_of_either_are_in_place(
    tmp_path: Path, change: tuple[str, str], code: str, is_found: bool
) -> None:
    assert (code in codes(tmp_path, change)) == is_found


def test_a_driver_that_its_island_cannot_run_is_named_there(tmp_path: Path) -> None:
    text = EXAMPLE.replace("turtlebot3-burger", "turtlebot4").replace("distro: jazzy", "distro: noetic")
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    (found,) = (one for one in load_swarm(tmp_path / "swarm.yaml")[1] if one.code == "DRIVER004")
    assert "is not for `noetic`" in found.message
    assert found.notes[0].span.line == text[: text.index("distro: noetic")].count("\n") + 1


@pytest.mark.parametrize(("host", "is_found"), [(OLD, False), (NEW, True)])
def test_a_package_is_delivered_to_ros_1_only(tmp_path: Path, host: str, is_found: bool) -> None:
    (tmp_path / "own").mkdir()
    manifest = "<package><name>own</name><version>1.0.0</version><description/></package>"
    (tmp_path / "own/package.xml").write_text(manifest, "utf-8")
    delivered = "control:\n", "packages: {own: {from: ./own}}\ncontrol:\n"
    assert ("ROS003" in codes(tmp_path, program(host, "optional: true"), delivered)) == is_found
