"""``swarmctl run``: what it refuses before it connects to a host, and which trials it resumes."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.capsule.folder import write
from swarmctl.cli import exit_codes
from swarmctl.cli.trial_capsule import completed
from swarmctl.cli.trial_hosts import TrialHosts
from tests.capsule.trial_folder import ABOUT, filled
from tests.in_process import swarmctl

EXPERIMENT = "\nexperiments:\n  circles: {duration: 5}\n"


@pytest.fixture
def spec(leader_spec: Path, tmp_path: Path) -> Path:
    file = tmp_path / "swarm.yaml"
    file.write_text(leader_spec.read_text("utf-8") + EXPERIMENT, "utf-8")
    return file


def test_a_misspelt_experiment_is_guessed(spec: Path) -> None:
    ran = swarmctl("run", str(spec), "circle")
    assert ran.returncode == exit_codes.USAGE
    assert "the spec has no experiment `circle`" in ran.stderr
    assert "did you mean `circles`?" in ran.stderr


def test_a_key_that_is_not_there_is_missed_before_a_robot_moves(spec: Path, tmp_path: Path) -> None:
    ran = swarmctl("run", str(spec), "circles", "--sign", str(tmp_path / "id_none"))
    assert ran.returncode == exit_codes.ERROR
    assert "id_none is no file" in ran.stderr


def test_a_folder_that_cannot_be_made_is_missed_before_a_robot_moves(
    spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[object] = []
    monkeypatch.setattr(TrialHosts, "run", lambda *_: begun.append(0))
    ran = swarmctl("run", str(spec), "circles", "--out", str(spec))
    assert (ran.returncode, begun) == (exit_codes.ERROR, [])
    assert f"cannot write {spec}" in ran.stderr


def test_only_completed_trials_are_left_out_of_a_resumed_run(tmp_path: Path) -> None:
    for number, outcome in ((1, "completed"), (2, "failed"), (3, "completed")):
        write(filled(tmp_path / f"{number:03}"), {**ABOUT, "trial": number, "outcome": outcome})
    (tmp_path / "003/index.json").write_text("{", "utf-8")
    assert completed(tmp_path) == {1}
