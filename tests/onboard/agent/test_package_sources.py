"""The package source of ROS: added with the right key only, and known again."""

from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent import package_sources
from swarm_onboard.agent.errors import FailedError, RefusedError

FINGERPRINT = "C1CF6E31E6BADE8868B172B4F42ED6FBAB17C654"


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A host whose gpg shows as fingerprint what the key consists of."""
    for folder in ("etc/apt/sources.list.d", "usr/share/keyrings", "bin"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "etc/apt/sources.list").write_text(
        "# deb http://old.example/ x\ndeb http://deb.example/a b c\n"
    )
    gpg = tmp_path / "bin/gpg"
    gpg.write_text('#!/bin/sh\nfor last; do :; done; echo "pub:-:"; echo "fpr:::::::::$(cat $last):"\n')
    gpg.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}/bin:/usr/bin:/bin")
    return tmp_path


def add(root: Path, key: str, platform: str = "ubuntu-20.04-aarch64") -> None:
    package_sources.add("packages.ros.org", platform, lambda path: f"{root}{path}", lambda _: key.encode())


def test_the_source_is_signed_by_its_key(root: Path) -> None:
    def servers() -> list[str]:
        return package_sources.servers(lambda path: f"{root}{path}")

    assert servers() == ["deb.example"]
    add(root, FINGERPRINT)
    assert servers() == ["deb.example", "packages.ros.org"]
    line = (root / "etc/apt/sources.list.d/swarm-ros.list").read_text()
    keyring = "/usr/share/keyrings/swarm-ros-archive.asc"
    assert line == f"deb [signed-by={keyring}] http://packages.ros.org/ros/ubuntu focal main\n"
    assert (root / keyring[1:]).read_text() == FINGERPRINT


def test_another_key_adds_nothing(root: Path) -> None:
    with pytest.raises(FailedError, match="is not the key"):
        add(root, "0" * 40)
    with pytest.raises(RefusedError, match="no packages for debian-12"):
        add(root, FINGERPRINT, "debian-12-x86_64")
    left = [
        path for path in (root / "etc/apt/sources.list.d", root / "usr/share/keyrings") if any(path.iterdir())
    ]
    assert left == []
