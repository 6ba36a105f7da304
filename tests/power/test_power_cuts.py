"""The power of a host may go at any system call of a deploy: after the next boot it is wholly old or new.

A part of ``make power-cuts``. Each run is a process of its own, whose mounts and images end with it.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import ROOT
from tests.power import disk, isolated
from tests.power.unsynced import copy_without, cut, syncs

LACKS = isolated.missing()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(LACKS), reason=f"power cuts need {LACKS}")]


def test_a_host_is_whole_wherever_its_power_goes() -> None:
    scenes = {
        "deploy": {"old", "new"},
        "undo": {"old"},
        "undo at boot": {"old"},
        "remove": {"old", "none"},
        "new key, lost peer": {"old, next key", "old, next key, pi expelled", "old, new key, pi expelled"},
    }

    rows = cut(
        ROOT,
        "--system=ext4",
        "--log=lost",
        "--random=2",
        "--deploys-each=10",
        *(f"--scene={name}" for name in scenes),
    )

    assert [problem for row in rows for problem in row["wrong"]] == []
    assert {row["scene"]: set(row["states"]) for row in rows if row["scene"] in scenes} == scenes


def test_a_cut_while_old_releases_are_removed_leaves_a_whole_host() -> None:
    (row,) = cut(
        ROOT, "--system=ext4", "--log=lost", "--random=0", "--sparse=20", "--scene=garbage collection"
    )

    assert row["wrong"] == []
    assert set(row["states"]) == {"between 2", "new"}


@pytest.mark.parametrize("system", ["xfs", "btrfs"])
def test_a_host_is_whole_on_other_file_systems(system: str) -> None:
    if lacks := disk.missing(system):
        pytest.skip(f"{system} needs {lacks} (`make power-tools`)")
    (row,) = cut(ROOT, f"--system={system}", "--log=lost", "--random=0", "--sparse=16", "--scene=deploy")

    assert row["wrong"] == []
    assert set(row["states"]) == {"old", "new"}


@pytest.mark.parametrize("scene", ["first deploy", "files alone"])
def test_cuts_show_a_release_that_was_not_synced(tmp_path: Path, scene: str) -> None:
    """Secrets are synced after it, with all that is on the disk; ``files alone`` has none."""
    taken = syncs() if scene == "first deploy" else [one for one in syncs() if one.file == "staging.py"]
    assert taken
    copy_without(taken, tmp_path)

    rows = cut(tmp_path, "--system=ext4", "--random=0", "--sparse=10", f"--scene={scene}")

    assert any("is damaged" in problem for row in rows for problem in row["wrong"])
