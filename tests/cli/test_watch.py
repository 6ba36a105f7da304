"""``swarmctl watch``: when what it deploys was chosen, and the unit that runs it."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from swarmctl.cli import console, exit_codes
from swarmctl.cli.deploy_rounds import Rounds
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.verbs import watch
from swarmctl.cli.where import Where
from tests import in_process
from tests.e2e.experiment import EXAMPLES

K3 = "k3: {type: khepera3, host: k3-pi"


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    """A spec whose last edit was long ago."""
    copied = Path(shutil.copy(EXAMPLES / "paper-leader/swarm.yaml", tmp_path / "swarm.yaml"))
    os.utime(copied, (1000.0, 1000.0))
    return copied


def first_round(spec: Path) -> Rounds:
    where = Where(SpecFiles((spec,)))
    document = console.read_document(where.spec)
    return watch._rounds(where, document, watch._edited(document, where))


def test_the_last_edit_is_when_it_was_chosen(spec: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert first_round(spec).rules.issued == 1000.0
    monkeypatch.setattr(time, "time", lambda: 900.0)  # a file from the future locks out nobody
    assert first_round(spec).rules.issued == 900.0


def test_an_edit_that_changes_a_release_is_chosen_now(spec: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time, "time", lambda: 2000.0)
    before = first_round(spec)
    before.failed["k3-pi", "a release"] = 1.0
    same = watch._next(before.where, before)
    assert same.rules.issued == 1000.0
    spec.write_text(spec.read_text() + "# a comment\n")
    assert watch._next(before.where, same).rules.issued == 1000.0
    spec.write_text(spec.read_text().replace(K3, f"{K3}, settings: {{limits: {{linear: 0.05}}}}"))
    os.utime(spec, (500.0, 500.0))  # as `mv` and `rsync -a` leave it
    changed = watch._next(before.where, same)
    assert changed.rules.issued == 2000.0
    assert (changed.stop, changed.failed) == (before.stop, before.failed)


def test_the_unit_runs_it_for_the_same_hosts(spec: Path, tmp_path: Path) -> None:
    config = {"XDG_CONFIG_HOME": str(tmp_path / "config")}
    done = in_process.swarmctl(
        "watch", str(spec), "--install", "--limit", "k3-pi", "--every", "30", env=config
    )
    assert done.returncode == exit_codes.OK, done.stderr
    (unit,) = (tmp_path / "config/systemd/user").iterdir()
    assert f"wrote {unit}\n" in done.stdout
    line = next(one for one in unit.read_text().splitlines() if one.startswith("ExecStart="))
    assert line.endswith(f" -m swarmctl watch {spec} --limit k3-pi --every 30")
    if program := shutil.which("systemd-analyze"):
        read = subprocess.run(
            [program, "verify", "--man=no", unit], capture_output=True, text=True, check=False
        )
        assert unit.name not in read.stderr, read.stderr


def test_a_unit_that_cannot_be_written_is_an_error(spec: Path) -> None:
    done = in_process.swarmctl("watch", str(spec), "--install", env={"XDG_CONFIG_HOME": "/proc/none"})
    assert done.returncode == exit_codes.ERROR
    assert done.stderr.startswith("error: cannot write /proc/none")


def test_a_unit_for_a_lab_is_refused(spec: Path) -> None:
    done = in_process.swarmctl("watch", str(spec), "--install", "--lab")
    assert done.returncode == exit_codes.USAGE
    assert "--install is for real hosts" in done.stderr
