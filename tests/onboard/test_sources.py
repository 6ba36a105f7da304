"""On-robot code runs on robots: Python 3.8, the standard library, declared imports, valid ROS packages."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from catkin_pkg.package import parse_package_string

from swarmctl.render import shipped_files
from swarmctl.resources import onboard

FILES = sorted(onboard().glob("*/**/*.py"))
MANIFESTS = sorted(onboard().glob("nodes/*/package.xml"))
STANDARD_LIBRARY = sys.stdlib_module_names - {
    "tomllib",
    "zoneinfo",
    "graphlib",
}  # Python 3.8 lacks these three
STANDARD_LIBRARY |= {"_sha256", "_sha2"}  # the latter replaces the former in Python 3.12
MESSAGES = {"diagnostic_msgs", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "tf2_msgs"}
ROS1 = {"rospy", "rosgraph", "roslib"}
ROS2 = {"rclpy", "rcl_interfaces"}
DEBIAN = {"serial": "python3-serial", "yaml": "python3-yaml"}  # packages with another name than their module
#: What each package may import beside the standard library and itself.
MAY_IMPORT = {
    "agent": {"swarm_onboard.common", "swarm_onboard.tunnel"},
    "command": {"swarm_onboard.common", "swarm_onboard.ros", *MESSAGES},
    "common": {"yaml"},
    "driver": {
        *("swarm_onboard.command", "swarm_onboard.common", "swarm_onboard.ros", "swarm_onboard.rosserial"),
        *("serial", *MESSAGES),
    },
    "gate": {"swarm_onboard.command", "swarm_onboard.common", "swarm_onboard.ros", *MESSAGES},
    "guard": {"swarm_onboard.common", "rosmaster", "roslib", "rospkg"},  # roscore is made of them
    "multimaster": {"swarm_onboard.common"},
    "host_checks": {"swarm_onboard.agent", "swarm_onboard.tunnel"},
    "ros1_probe": {"swarm_onboard.agent", "swarm_onboard.common"},
    "ros2_probe": {*("swarm_onboard", "swarm_onboard.agent", "swarm_onboard.common", "swarm_onboard.ros2")},
    "ros2_recorder": {
        *("swarm_onboard.agent", "swarm_onboard.ros2", "swarm_onboard.ros2_probe"),
        *("rclpy", "mcap"),  # the agent brings the latter
    },
    "ros": {"geometry_msgs"},
    "ros1": {"swarm_onboard.ros", *ROS1},
    "ros2": {"swarm_onboard.ros", *ROS2, "std_msgs"},
    "ros2_tools": {
        *("swarm_onboard.agent", "swarm_onboard.ros2", "swarm_onboard.ros2_probe", "rclpy", "yaml"),
    },
    "domain_relay": {
        *("swarm_onboard.common", "swarm_onboard.multimaster", "swarm_onboard.ros", "swarm_onboard.ros2"),
        *("rclpy", "diagnostic_msgs"),
    },
    "rosserial": set[str](),
    "stand_in": {"swarm_onboard.command", "swarm_onboard.ros", "rospy", *MESSAGES},
    "teleop": {"swarm_onboard.common", "swarm_onboard.ros", "yaml", *MESSAGES},
    "tunnel": {"swarm_onboard.common"},
}


def name_of(path: Path) -> str:
    return str(path.relative_to(onboard()))


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_file_is_python_3_8_and_imports_what_a_robot_has(path: Path) -> None:
    inside = path.relative_to(onboard()).parts
    package = inside[1].replace("drivers", "driver") if inside[0] == "nodes" else inside[0]
    own = {f"swarm_onboard.{package}"}
    assert imports_of(path.read_bytes()) <= STANDARD_LIBRARY | own | MAY_IMPORT[package]


def imports_of(source: bytes) -> set[str]:
    """The modules and packages at the top that a file imports; of `swarm_onboard`, its packages."""
    nodes = list(ast.walk(ast.parse(source, feature_version=(3, 8))))
    imported = {one.name for node in nodes if isinstance(node, ast.Import) for one in node.names}
    imported |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
    return {".".join(name.split(".")[: 2 if name.startswith("swarm_onboard.") else 1]) for name in imported}


def python_3_8() -> str | None:
    """A Python 3.8 that starts; pyenv's shims are there without one."""
    shims = [shutil.which("python3.8"), *map(str, Path.home().glob(".pyenv/versions/3.8.*/bin/python3.8"))]
    starts = (
        one
        for one in shims
        if one and not subprocess.run([one, "--version"], capture_output=True, check=False).returncode
    )
    return next(starts, None)


def test_python_3_8_imports_what_needs_no_other_library() -> None:
    python = python_3_8()
    if python is None:
        pytest.skip("no python3.8 here")
    packages = ("agent", "common", "ros1_probe", "ros2_probe", "rosserial")
    modules = [
        ".".join(path.relative_to(onboard().parent).with_suffix("").parts)
        for package in packages
        for path in sorted((onboard() / package).rglob("*.py"))
        if path.name not in ("__init__.py", "loader.py")
    ]
    code = f"import sys, importlib; sys.path.insert(0, {str(onboard().parent)!r}); "
    code += f"[importlib.import_module(name) for name in {modules!r}]"
    subprocess.run([python, "-I", "-S", "-B", "-c", code], check=True, timeout=30)


@pytest.mark.parametrize("path", MANIFESTS, ids=name_of)
def test_package_manifest_is_valid_for_catkin(path: Path) -> None:
    """roswtf, rospack and catkin refuse a workspace with one manifest that is not."""
    warnings: list[str] = []
    package = parse_package_string(path.read_text(), str(path), warnings=warnings)
    package.validate(warnings=warnings)
    assert warnings == []
    assert package.maintainers
    assert package.licenses == ["Apache-2.0"]


@pytest.mark.parametrize("path", MANIFESTS, ids=name_of)
def test_package_manifest_names_what_the_package_imports(path: Path) -> None:
    """`rosdep install` and roswtf go by it; its folder holds what it needs of `swarm_onboard`."""
    ros = "" if path.parent.name == "multimaster" else "ros1"
    files = {one.path: one.content for one in shipped_files.folder(path.parent.name, ros)}
    found = {name for file, content in files.items() if file.endswith(".py") for name in imports_of(content)}
    shipped = {".".join(file.split("/")[1:3]) for file in files}
    needed = {DEBIAN.get(one, one) for one in found - STANDARD_LIBRARY - shipped}
    assert needed <= {one.name for one in parse_package_string(path.read_text()).exec_depends}
