"""The agent's verb ``launch_files``: texts of launch files only, of the packages that are named, bounded."""

from __future__ import annotations

import os
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from swarm_agent.verbs import launch_files

WORKSPACE = "workspace:/home/robot/ws"


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The package `talking` in /opt/ros of a host."""
    monkeypatch.setenv("SWARM_PREFIX", str(tmp_path))
    return added(tmp_path / "opt/ros/noetic/share/talking")


def added(folder: Path, text: str = "<launch/>") -> Path:
    (folder / "launch").mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{folder.name}</name></package>")
    (folder / "launch/a.launch").write_text(text)
    return folder


def read(
    *paths: str, requires: tuple[str, ...] = (), name: str = "talking", texts: bool = True
) -> dict[str, Any]:
    request = {"swarm": "test", "requires": list(requires), "files": {name: list(paths)}, "texts": texts}
    return launch_files.handle(request, b"", None)  # type: ignore[arg-type, return-value]


def test_the_text_of_a_launch_file_comes_with_its_place(package: Path) -> None:
    (package / "map.yaml").write_text("image: secret")
    answer = read("launch/a.launch", "map.yaml")
    assert answer == {
        "packages": {
            "talking": {
                "folder": "/opt/ros/noetic/share/talking", "has": ["launch/a.launch", "map.yaml"],
                "digests": {}, "texts": {"launch/a.launch": "<launch/>"}, "launch": [],
            }
        },
        "complete": True,
    }  # fmt: skip


def test_digests_alone_are_of_the_texts(package: Path) -> None:
    (package / "launch/b.launch").write_bytes(b"<launch/>\xff")
    paths = ("launch/a.launch", "launch/b.launch")
    texts = read(*paths)["packages"]["talking"]["texts"]
    found = read(*paths, "package.xml", texts=False)["packages"]["talking"]
    assert found["texts"] == {}
    assert (
        found["digests"].items()
        >= {path: sha256(text.encode()).hexdigest() for path, text in texts.items()}.items()
    )
    assert found["has"] == [*paths, "package.xml"]


def test_a_workspace_hides_what_the_host_has_installed(package: Path, tmp_path: Path) -> None:
    space = tmp_path / "home/robot/ws/install"
    added(space / "share/talking", "<launch><!-- own --></launch>")
    (space / "setup.sh").write_text("")
    found = read("launch/a.launch", requires=(WORKSPACE,))["packages"]["talking"]
    assert found["texts"] == {"launch/a.launch": "<launch><!-- own --></launch>"}


def test_launch_files_are_listed_where_one_is_missing(package: Path) -> None:
    found = read("launch/b.launch")["packages"]["talking"]
    assert (found["has"], found["launch"]) == ([], ["launch/a.launch"])


def test_an_unknown_package_has_no_folder(package: Path) -> None:
    nothing = {"folder": None, "has": [], "digests": {}, "texts": {}, "launch": []}
    assert read("launch/a.launch", name="away")["packages"] == {"away": nothing}


def test_nothing_outside_the_package_is_read(package: Path, tmp_path: Path) -> None:
    (tmp_path / "opt/ros/noetic/share/other.launch").write_text("secret")
    assert read("../other.launch", "/../../other.launch")["packages"]["talking"]["has"] == []


def test_pipes_and_large_files_have_no_text(package: Path) -> None:
    os.mkfifo(package / "launch/pipe.launch")
    (package / "launch/large.launch").write_bytes(b" " * (launch_files.LARGEST_FILE + 1))
    found = read("launch/pipe.launch", "launch/large.launch", "launch")["packages"]["talking"]
    assert (len(found["has"]), found["texts"]) == (3, {})


def test_an_answer_that_would_be_too_large_is_cut(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launch_files, "LARGEST_ANSWER", 12)
    (package / "launch/b.launch").write_text("<launch/>")
    answer = read("launch/a.launch", "launch/b.launch")
    assert answer["complete"] is False
    assert list(answer["packages"]["talking"]["texts"]) == ["launch/a.launch"]
