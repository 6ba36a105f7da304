from __future__ import annotations

import os
from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.disk import Seen, judge, observe

ROOT = Seen("/", "/opt/swarm", 4 << 30, 16 << 30, 100_000, read_only=False)


def test_each_file_system_is_reported_once(tmp_path: Path) -> None:
    (tmp_path / "opt/swarm").mkdir(parents=True)
    (tmp_path / "etc").mkdir()
    (found,) = observe(Home("new", str(tmp_path)))
    space = os.statvfs(tmp_path)
    assert (found.used_by, found.read_only) == ("/opt/swarm", False)
    assert found.size == space.f_blocks * space.f_frsize
    assert str(tmp_path).startswith(found.place)


@pytest.mark.parametrize(
    ("changes", "state", "message"),
    [
        ({}, "ok", "4096 MiB free"),
        ({"read_only": True}, "bad", "is read-only"),
        ({"free": 12 << 10}, "bad", "is full: 12 KiB free; /opt/swarm is on it"),
        ({"inodes": 3}, "bad", "has 3 inodes left"),
        ({"inodes": None}, "ok", "free"),
        ({"free": 100 << 20}, "warning", "100 MiB free of 16384 MiB"),
        ({"inodes": 900}, "warning", "has only 900 inodes left"),
    ],
)
def test_a_file_system_is_judged_by_what_is_left(changes: dict[str, int], state: str, message: str) -> None:
    found = judge(ROOT._replace(**changes), "pi")
    assert (found.state, found.about) == (state, "/")
    assert message in found.message
