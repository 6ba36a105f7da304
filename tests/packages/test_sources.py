"""On-robot code runs on robots: Python 3.8, the standard library, declared imports, valid ROS packages."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from catkin_pkg.package import parse_package_string

from tests import ROOT

PACKAGES = ROOT / "templates/packages"
FILES = sorted(PACKAGES.rglob("*.py"))
MANIFESTS = sorted(PACKAGES.glob("*/package.xml"))
STANDARD_LIBRARY = sys.stdlib_module_names - {
    "tomllib",
    "zoneinfo",
    "graphlib",
}  # Python 3.8 lacks these three
STANDARD_LIBRARY |= {"_sha256", "_sha2"}  # the latter replaces the former in Python 3.12
ROS = {
    *("rospy", "rosgraph", "roslib"),
    *("diagnostic_msgs", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "tf2_msgs"),
}
DEBIAN = {"serial": "python3-serial", "yaml": "python3-yaml"}  # packages with another name than their module
#: What each package may import beside the standard library and itself.
MAY_IMPORT = {
    "agent": {"swarm_common"},
    "command": {"swarm_common", *ROS},
    "common": {"yaml"},
    "driver": {"swarm_command", "swarm_common", "swarm_rosserial", "serial", *ROS},
    "gate": {"swarm_command", "swarm_common", *ROS},
    "multimaster": {"swarm_common"},
    "ros1_probe": {"swarm_agent", "swarm_common"},
    "rosserial": set[str](),
    "stand_in": ROS,
    "teleop": {"yaml", *ROS},
}


def name_of(path: Path) -> str:
    return str(path.relative_to(PACKAGES))


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_file_is_python_3_8_and_imports_what_a_robot_has(path: Path) -> None:
    package = path.relative_to(PACKAGES).parts[0]
    own = {f"swarm_{package}"}
    assert imports_of(path) <= STANDARD_LIBRARY | own | MAY_IMPORT[package]


def imports_of(path: Path) -> set[str]:
    """The modules and packages at the top that a file imports."""
    nodes = list(ast.walk(ast.parse(path.read_text(), feature_version=(3, 8))))
    imported = {one.name for node in nodes if isinstance(node, ast.Import) for one in node.names}
    imported |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
    return {name.split(".")[0] for name in imported}


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
    packages = ("agent", "common", "ros1_probe", "rosserial")
    modules = [
        ".".join(path.relative_to(PACKAGES / package).with_suffix("").parts)
        for package in packages
        for path in sorted((PACKAGES / package).rglob("swarm_*/**/*.py"))
        if path.name != "__init__.py"
    ]
    folders = [str(PACKAGES / package) for package in packages]
    code = f"import sys, importlib; sys.path[:0] = {folders!r}; "
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
    """`rosdep install` and roswtf go by it; the folder of a release holds its `swarm_*` modules."""
    found = {name for file in path.parent.rglob("*.py") for name in imports_of(file)}
    needed = {DEBIAN.get(one, one) for one in found - STANDARD_LIBRARY if not one.startswith("swarm_")}
    assert needed <= {one.name for one in parse_package_string(path.read_text()).exec_depends}
