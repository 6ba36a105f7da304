"""Packages that a spec delivers: what can travel with a release, and what PKG017 reports."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.loading import load_checked
from tests.rules.test_packages import SPEC, write

NAV = """<?xml version="1.0"?>
<package format="2">
  <name>nav</name><version>0.1.0</version><description>d</description>
  <maintainer email="a@b.example">a</maintainer><license>MIT</license>
  <depend>nav_core</depend>
</package>
"""
GO = "#!/usr/bin/env python3\n"


def spec(folder: Path, place: str = "./src/nav", files: dict[str, str] | None = None) -> Path:
    text = SPEC.format(program="executable: go.py").replace("own, exec", "nav, exec")
    found = files if files is not None else {"package.xml": NAV, "scripts/go.py": GO}
    write(folder, {f"src/nav/{path}": content for path, content in found.items()})
    write(folder, {"swarm.yaml": f"{text}packages: {{nav: {{from: {place}}}}}\n"})
    if "scripts/go.py" in found:
        (folder / "src/nav/scripts/go.py").chmod(0o755)
    return folder / "swarm.yaml"


def test_a_python_package_travels_with_all_its_files(tmp_path: Path) -> None:
    write(tmp_path / "src/nav", {"src/nav/__pycache__/x.pyc": "", ".git/config": "", "build/x": ""})
    write(tmp_path / "src/nav", {"src/nav/CATKIN_IGNORE": ""})
    document, found = load_checked(spec(tmp_path))
    assert document is not None, found
    nav = document.packages.delivered["nav"]
    assert {path: may for path, (_, may) in nav.files.items()} == {
        "package.xml": False,
        "scripts/go.py": True,
    }


@pytest.mark.parametrize(
    ("files", "place", "message"),
    [
        (None, "./src/other", "does not exist"),
        (None, "./swarm.yaml", "is not a folder"),
        ({"scripts/go.py": GO}, "src/nav", "has no package.xml"),
        ({"package.xml": NAV.replace(">nav<", ">navi<")}, "src/nav", "holds the package navi"),
        ({"package.xml": "<x"}, "src/nav", "names no package"),
        ({"package.xml": NAV.replace("MIT", "")}, "src/nav", "catkin refuses: it has an empty <license>"),
        ({"package.xml": NAV, f"{'d/' * 33}f": ""}, "src/nav", "beyond 32 levels"),
    ],
)
def test_what_cannot_travel_is_reported(
    tmp_path: Path, files: dict[str, str] | None, place: str, message: str
) -> None:
    document, found = load_checked(spec(tmp_path, place, files))
    assert document is None
    (finding,) = [one for one in found if one.code == "PKG017"]
    assert message in finding.message
    assert finding.span is not None
    assert finding.help


def workspace(folder: Path, files: dict[str, str], more: str = "") -> Path:
    """A spec with a workspace; its program uses the package nav, in one of its folders."""
    text = SPEC.format(program="executable: go.py").replace("own, exec", "nav, exec")
    own = {"ws/src/group/nav_folder/package.xml": NAV, "ws/src/group/nav_folder/scripts/go.py": GO}
    write(folder, own | {f"ws/src/{path}": content for path, content in files.items()})
    write(folder, {"swarm.yaml": f"{text}packages:\n  ws: {{from: ./ws/src, all: true}}\n{more}"})
    (folder / "ws/src/group/nav_folder/scripts/go.py").chmod(0o755)
    return folder / "swarm.yaml"


def manifest(name: str) -> str:
    """That of a package without dependencies."""
    return NAV.replace(">nav<", f">{name}<").replace("  <depend>nav_core</depend>\n", "")


def test_every_package_of_a_workspace_is_delivered(tmp_path: Path) -> None:
    path = workspace(
        tmp_path,
        {
            "core/package.xml": manifest("nav_core"),
            "core/inner/package.xml": manifest("inner"),  # part of nav_core
            "off/CATKIN_IGNORE": "",
            "off/deeper/package.xml": manifest("off"),
            "build/x/package.xml": manifest("built"),
            "big/package.xml": manifest("big"),
            "big/CMakeLists.txt": "add_executable(big a.cpp)\n",  # nobody uses it, so nobody builds it
        },
        more="  nav_core: {from: ./ws/src/core, skip_keys: [gazebo_ros]}\n",
    )
    document, found = load_checked(path)
    assert document is not None, found
    packages = document.packages.delivered
    assert {name: one.folder for name, one in packages.items()} == {
        "nav": "ws/src/group/nav_folder",
        "nav_core": "ws/src/core",
        "big": "ws/src/big",
    }
    assert packages["nav"].origin == "packages.ws (nav)"
    assert packages["nav_core"].skip_keys == {"gazebo_ros"}
    assert "inner/package.xml" in packages["nav_core"].files


@pytest.mark.parametrize(
    ("files", "message"),
    [
        (
            {"other/package.xml": NAV},
            "`ws/src` has the package nav at ws/src/other, which ws/src/group/nav_f",
        ),
        ({"core/package.xml": "<x"}, "`ws/src` has core, whose package.xml names no package; an empty file"),
    ],
)
def test_a_workspace_that_catkin_refuses_is_reported(
    tmp_path: Path, files: dict[str, str], message: str
) -> None:
    document, found = load_checked(workspace(tmp_path, files))
    assert document is None
    (finding,) = [one for one in found if one.code == "PKG017"]
    assert finding.message.startswith(message)
    assert finding.span is not None
    assert finding.span.line == 16


def test_links_of_a_workspace_lead_to_folders_of_the_spec_only(tmp_path: Path) -> None:
    folder = tmp_path / "project"
    write(folder, {"elsewhere/core/package.xml": manifest("nav_core"), "../outside/package.xml": NAV})
    path = workspace(folder, {})
    (folder / "ws/src/core").symlink_to("../../elsewhere/core")
    (folder / "ws/src/loop").symlink_to("../src")
    document, found = load_checked(path)
    assert document is not None, found
    assert set(document.packages.delivered) == {"nav", "nav_core"}
    (folder / "ws/src/out").symlink_to(tmp_path / "outside")
    document, found = load_checked(path)
    (finding,) = [one for one in found if one.code == "PKG017"]
    assert "has the link out, which leads out of the spec's folder" in finding.message


def test_a_package_of_a_workspace_that_is_used_needs_a_builder(tmp_path: Path) -> None:
    core = {"core/package.xml": manifest("nav_core"), "core/CMakeLists.txt": "generate_messages()\n"}
    document, found = load_checked(workspace(tmp_path, core))
    assert document is None
    (finding,) = [one for one in found if one.code == "PKG018"]
    assert "`nav_core` has to be built" in finding.message


@pytest.mark.parametrize(
    "line", ["add_executable(nav a.cpp)", "  cuda_add_library(x)", "generate_messages()"]
)
def test_what_has_to_be_built_needs_a_builder(tmp_path: Path, line: str) -> None:
    path = spec(tmp_path, files={"package.xml": NAV, "CMakeLists.txt": f"{line}\n", "scripts/go.py": GO})
    document, found = load_checked(path)
    assert document is None
    (finding,) = [one for one in found if one.code == "PKG018"]
    assert (
        f"`nav` has to be built ({line.split('(', maxsplit=1)[0].strip()} in its CMakeLists.txt)"
        in finding.message
    )
    path.write_text(path.read_text() + "ros: {builders: [koala-laptop]}\n")
    document, found = load_checked(path)
    assert document is not None, found
    assert document.packages.delivered["nav"].built_by


def test_a_cmake_file_that_builds_nothing_travels(tmp_path: Path) -> None:
    cmake = "project(nav)\nfind_package(catkin)\n# add_executable(x)\ncatkin_package()\n"
    document, found = load_checked(
        spec(tmp_path, files={"package.xml": NAV, "CMakeLists.txt": cmake, "scripts/go.py": GO})
    )
    assert document is not None, found


def test_a_link_out_of_the_folder_stays_behind(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("x")
    path = spec(tmp_path)
    (tmp_path / "src/nav/key").symlink_to(tmp_path / "secret")
    document, found = load_checked(path)
    assert document is not None, found
    assert "key" not in document.packages.delivered["nav"].files
