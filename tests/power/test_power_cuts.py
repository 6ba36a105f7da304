"""The power of a host may go at any system call of a deploy: after the next boot it is wholly old or new.

A part of ``make power-cuts``. Each run is a process of its own, whose mounts and images end with it.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests import ROOT
from tests.power import disk, isolated

LACKS = isolated.missing()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(LACKS), reason=f"power cuts need {LACKS}")]


def cut(*options: str, system: str = "ext4", root: Path = ROOT) -> list[dict[str, Any]]:
    """Returns the rows of a run on a file system."""
    command = [sys.executable, "-m", "tests.power", "--json", f"--system={system}", "--jobs=1", *options]
    environment = {**os.environ, "PYTHONPATH": str(root / "templates/onboard")}
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, check=False)
    assert done.stdout, done.stderr
    rows: list[dict[str, Any]] = json.loads(done.stdout)
    return rows


def test_a_host_is_whole_wherever_its_power_goes() -> None:
    scenes = {
        "deploy": {"old", "new"},
        "undo": {"old"},
        "undo at boot": {"old"},
        "remove": {"old", "none"},
        "new key, lost peer": {"old, next key", "old, next key, pi expelled", "old, new key, pi expelled"},
    }

    rows = cut("--log=lost", "--random=2", "--deploys-each=10", *(f"--scene={name}" for name in scenes))

    assert [problem for row in rows for problem in row["wrong"]] == []
    assert {row["scene"]: set(row["states"]) for row in rows if row["scene"] in scenes} == scenes


def test_a_cut_while_old_releases_are_removed_leaves_a_whole_host() -> None:
    (row,) = cut("--log=lost", "--random=0", "--sparse=20", "--scene=garbage collection")

    assert row["wrong"] == []
    assert set(row["states"]) == {"between 2", "new"}


@pytest.mark.parametrize("system", ["xfs", "btrfs"])
def test_a_host_is_whole_on_other_file_systems(system: str) -> None:
    if lacks := disk.missing(system):
        pytest.skip(f"{system} needs {lacks} (`make power-tools`)")
    (row,) = cut("--log=lost", "--random=0", "--sparse=16", "--scene=deploy", system=system)

    assert row["wrong"] == []
    assert set(row["states"]) == {"old", "new"}


def test_cuts_show_a_release_that_was_not_synced(tmp_path: Path) -> None:
    for folder in ("swarmctl", "templates", "schemas", "tests/power", "tests/onboard/agent"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("__init__.py", "timing.py", "onboard/__init__.py"):
        shutil.copy(ROOT / "tests" / name, tmp_path / "tests" / name)
    files = tmp_path / "templates/onboard/swarm_onboard/agent/files.py"
    text = files.read_text()
    assert text.count("library.syncfs(descriptor) != 0") == 1
    files.write_text(text.replace("library.syncfs(descriptor) != 0", "False"))

    rows = cut("--log=flushed", "--random=0", "--sparse=1000", "--scene=deploy", root=tmp_path)

    assert any("is damaged" in problem for row in rows for problem in row["wrong"])
