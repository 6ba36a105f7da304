"""Which packages are found, and that nothing else is read."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from swarmctl.ros_packages.package import Packages
from swarmctl.spec import package_search
from swarmctl.spec.package_search import packages_in
from tests.ros_packages.packages import manifest


def add(folder: Path, name: str = "") -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(manifest(name or folder.name))
    return folder


def found(folder: Path) -> Packages:
    return packages_in([(folder, "")])


def test_packages_of_a_workspace_are_found(tmp_path: Path) -> None:
    add(tmp_path / "one")
    add(tmp_path / "ws/src/group/two")
    assert {one.name: one.folder for one in found(tmp_path).found} == {
        "one": "one",
        "two": "ws/src/group/two",
    }


@pytest.mark.parametrize(
    "folder", ["build/a", "devel/share/a", "install/share/a", ".hidden/a", "a/b/c/d/e/f/g"]
)
def test_what_builds_leave_is_no_package(tmp_path: Path, folder: str) -> None:
    add(tmp_path / folder)
    assert found(tmp_path).found == ()


def test_ignored_folders_and_packages_within_packages_are_left_out(tmp_path: Path) -> None:
    add(tmp_path / "outer")
    add(tmp_path / "outer/inner")
    add(tmp_path / "old/one")
    (tmp_path / "old/CATKIN_IGNORE").touch()
    assert [one.name for one in found(tmp_path).found] == ["outer"]


def test_links_are_not_read(tmp_path: Path) -> None:
    secret = tmp_path / "secret.launch"
    secret.write_text("<launch><node name='token' /></launch>")
    own = add(tmp_path / "ws/own")
    (own / "launch").mkdir()
    (own / "launch/a.launch").symlink_to(secret)
    (own / "msg").symlink_to("/proc/self")
    (tmp_path / "ws/linked").symlink_to(add(tmp_path / "elsewhere"))
    (package,) = found(tmp_path / "ws").found
    assert package.name == "own"
    assert package.contents.keys() == {"package.xml"}


def test_a_pipe_does_not_block(tmp_path: Path) -> None:
    own = add(tmp_path / "own")
    os.mkfifo(own / "a.launch")
    os.mkfifo(tmp_path / "package.xml")
    assert found(tmp_path).found == ()
    (package,) = found(own).found
    assert package.contents.keys() == {"package.xml"}


def test_a_package_above_the_limits_is_unknown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = add(tmp_path / "own")
    for number in range(30):
        (own / f"{number}.launch").write_text("<launch />" * 10)
    assert len(found(tmp_path).found) == 1
    monkeypatch.setattr(package_search, "_MAX_BYTES", 2000)
    assert found(tmp_path).found == ()
    monkeypatch.undo()
    monkeypatch.setattr(package_search, "_MAX_ENTRIES", 20)
    assert found(tmp_path).found == ()


def test_the_first_of_two_packages_with_one_name_counts(tmp_path: Path) -> None:
    add(tmp_path / "a/one", "same")
    add(tmp_path / "b/two", "same")
    packages = found(tmp_path)
    assert len(packages.found) == 2
    assert packages.by_name["same"].folder == "a/one"
