"""A forked run of swarmctl does what the console script does."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from tests.e2e import forked
from tests.e2e.lab_swarm import SWARMCTL


def test_a_forked_run_is_like_one_of_the_console_script(
    tmp_path: Path, leader_spec: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Output, errors and exit code; environment and folder are those of this run, not of the one before."""
    wrong = tmp_path / "wrong.yaml"
    monkeypatch.chdir(tmp_path)
    wrong.write_text("version: 1\nname: Bad name\n")
    uncolored, narrow = {**os.environ, "NO_COLOR": "1"}, {**os.environ, "COLUMNS": "60", "FORCE_COLOR": "1"}
    for arguments in (["validate", wrong.name], ["graph", str(leader_spec)], ["plan"], ["--version"]):
        argv = [str(SWARMCTL), *arguments]
        for env in (uncolored, narrow):
            real = forked.console_script(argv, env, timeout=60)
            run = forked.swarmctl(argv, env, timeout=60)
            assert (run.returncode, run.stdout, run.stderr) == (real.returncode, real.stdout, real.stderr)


def test_a_run_that_does_not_end_is_killed() -> None:
    with pytest.raises(subprocess.TimeoutExpired):
        forked.swarmctl(["swarmctl", "emulate", "koala"], os.environ, timeout=0.5)
    run = forked.swarmctl(["swarmctl", "--version"], os.environ, timeout=60)
    assert run.returncode == 0
