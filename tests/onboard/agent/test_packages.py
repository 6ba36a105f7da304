"""The ROS packages and workspaces that a host reports, as rospack would once the workspace is sourced."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.onboard.agent.fakehost import FakeHost

WS = "/home/robot/catkin_ws"


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    return FakeHost(tmp_path)


def package(host: FakeHost, folder: str, name: str) -> None:
    place = host.prefix / folder.lstrip("/")
    place.mkdir(parents=True)
    (place / "package.xml").write_text(f"<package format='2'>\n  <name> {name}\n</name>\n</package>\n")


def space(host: FakeHost, path: str, *, sources: str = "", upon: str = "") -> None:
    """What catkin leaves in every space that it makes: setup files, and a marker that names the sources."""
    place = host.prefix / path.lstrip("/")
    place.mkdir(parents=True, exist_ok=True)
    (place / "setup.sh").touch()
    (place / ".catkin").write_text(sources)
    (place / "_setup_util.py").write_text(f"if True:\n    CMAKE_PREFIX_PATH = r'{upon}'.split(';')\n")


def has(host: FakeHost, *requires: str) -> dict[str, str | None]:
    found = host.observe(requires=requires).facts.has
    return {name: found[name] for name in requires}


def test_what_apt_installed_is_found_in_either_ros(host: FakeHost) -> None:
    package(host, "/opt/ros/noetic/share/joy", "joy")
    package(host, "/usr/share/rospy", "rospy")

    assert has(host, "package:joy", "package:rospy", "package:rtabmap_ros") == {
        "package:joy": "/opt/ros/noetic/share/joy",
        "package:rospy": "/usr/share/rospy",
        "package:rtabmap_ros": None,
    }


def test_a_package_counts_once_it_is_in_the_swarms_workspace(host: FakeHost) -> None:
    package(host, f"{WS}/src/group/joy_driver", "joy")  # known by its name, not its folder's
    space(host, f"{WS}/devel", sources=f"{WS}/src")

    assert has(host, "package:joy") == {"package:joy": None}
    assert has(host, f"workspace:{WS}", "package:joy") == {
        f"workspace:{WS}": f"{WS}/devel",
        "package:joy": f"{WS}/src/group/joy_driver",
    }


@pytest.mark.parametrize("given", [WS, f"{WS}/install"])
def test_an_installed_workspace_is_found_by_its_top_or_by_itself(host: FakeHost, given: str) -> None:
    space(host, f"{WS}/install")
    package(host, f"{WS}/install/share/joy", "joy")

    assert has(host, f"workspace:{given}", "package:joy") == {
        f"workspace:{given}": f"{WS}/install",
        "package:joy": f"{WS}/install/share/joy",
    }


def test_a_workspace_brings_what_it_was_built_upon(host: FakeHost) -> None:
    space(host, "/home/robot/base/devel", sources="/home/robot/base/src")
    package(host, "/home/robot/base/src/joy", "joy")
    space(host, f"{WS}/devel", upon="/home/robot/base/devel;/opt/ros/noetic")

    assert has(host, f"workspace:{WS}", "package:joy")["package:joy"] == "/home/robot/base/src/joy"


@pytest.mark.parametrize("mark", ["CATKIN_IGNORE", "rospack_nosubdirs"])
def test_what_ros_does_not_look_at_is_not_there(host: FakeHost, mark: str) -> None:
    package(host, f"{WS}/src/old/joy", "joy")
    (host.prefix / f"{WS}/src/old/{mark}".lstrip("/")).touch()
    package(host, f"{WS}/src/.attic/joy", "joy")
    space(host, f"{WS}/devel", sources=f"{WS}/src")

    assert has(host, f"workspace:{WS}", "package:joy")["package:joy"] is None


def test_a_workspace_that_was_never_built_is_none(host: FakeHost) -> None:
    package(host, f"{WS}/src/joy", "joy")

    assert has(host, f"workspace:{WS}", "package:joy") == {f"workspace:{WS}": None, "package:joy": None}


def test_sources_that_lead_in_a_circle_come_to_an_end(host: FakeHost) -> None:
    package(host, f"{WS}/src/joy", "joy")
    (host.prefix / f"{WS}/src/again".lstrip("/")).symlink_to(".")
    space(host, f"{WS}/devel", sources=f"{WS}/src")

    assert has(host, f"workspace:{WS}", "package:away")["package:away"] is None
