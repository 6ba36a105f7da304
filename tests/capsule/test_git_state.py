"""The commit of the folder of a spec; changes elsewhere in the repository do not count."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from swarmctl.capsule.capsule_index import Git
from swarmctl.capsule.git_state import git_state


def git(folder: Path, *arguments: str) -> str:
    who = ["-c", "user.name=ada", "-c", "user.email=ada@lab", "-c", "commit.gpgsign=false"]
    ran = subprocess.run(
        ["git", *who, "-C", folder, *arguments], capture_output=True, text=True, check=True
    )  # fmt: skip
    return ran.stdout.strip()


def test_changes_count_in_the_folder_alone(tmp_path: Path) -> None:
    lab, other = tmp_path / "lab", tmp_path / "other"
    lab.mkdir()
    other.mkdir()
    git(tmp_path, "init", "-q")
    assert git_state(lab) is None  # without a commit
    (lab / "swarm.yaml").write_text("version: 1\n")
    git(tmp_path, "add", "-A")
    git(tmp_path, "commit", "-q", "-m", "a lab")
    commit = git(tmp_path, "rev-parse", "HEAD")
    (other / "note").touch()
    assert git_state(lab) == Git(commit=commit, changed=False)
    (lab / "swarm.yaml").write_text("version: 1 # two\n")
    assert git_state(lab) == Git(commit=commit, changed=True)
    git(tmp_path, "checkout", "-q", "lab")
    (lab / "new.yaml").touch()
    assert git_state(lab) == Git(commit=commit, changed=True)


def test_there_may_be_no_repository_and_no_git(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert git_state(tmp_path) is None
    git(tmp_path, "init", "-q")
    git(tmp_path, "commit", "-q", "--allow-empty", "-m", "nothing")
    assert git_state(tmp_path) is not None
    (tmp_path / ".git/index").write_bytes(b"damaged")
    assert git_state(tmp_path) is None
    (tmp_path / ".git/index").unlink()
    monkeypatch.setenv("PATH", str(tmp_path))
    assert git_state(tmp_path) is None
