"""``restart-delay``: a unit that ends again and again starts ever later; one that has run long, at once."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from swarmctl.resources import templates
from tests.timing import PATIENCE

PROGRAM = templates() / "host/restart-delay"
UNIT = "swarm-test.k3.service"


@pytest.fixture
def runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The runtime folder of a unit; ``sleep`` notes how long it takes, ``systemctl`` prints 7 restarts."""
    for name, script in {"sleep": f'echo "$1" >>{tmp_path}/slept', "systemctl": "echo 7"}.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{script}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    (tmp_path / "runtime").mkdir()
    return tmp_path / "runtime"


def start(runtime: Path) -> tuple[int, str]:
    """The delay of the next start, s, and what is printed."""
    slept = runtime.parent / "slept"
    slept.unlink(missing_ok=True)
    command = [str(PROGRAM), UNIT, str(runtime)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True)
    assert done.stderr == ""
    return int(slept.read_text()) if slept.exists() else 0, done.stdout.strip()


def age(runtime: Path, seconds: int) -> None:
    """Moves the last start into the past."""
    count, began = (runtime / "restarts").read_text().split()
    (runtime / "restarts").write_text(f"{count} {int(began) - seconds}\n")


def test_the_delay_grows_and_has_a_limit(runtime: Path) -> None:
    assert [start(runtime)[0] for _ in range(10)] == [0, 0, 0, 0, 2, 4, 8, 16, 20, 20]
    assert start(runtime)[1] == "ended 10 times, each within a minute of its start: starts again in 20 s"


def test_a_unit_that_has_run_for_a_minute_starts_at_once(runtime: Path) -> None:
    delays = [start(runtime)[0] for _ in range(6)]
    age(runtime, 90)
    assert (delays[-1], start(runtime)) == (4, (0, ""))


def test_a_start_by_hand_is_not_delayed_and_begins_a_new_count(runtime: Path) -> None:
    for _ in range(6):
        start(runtime)
    systemctl = runtime.parent / "systemctl"
    systemctl.write_text(f'#!/bin/sh\n[ "$*" = "show --property=NRestarts --value -- {UNIT}" ] && echo 0\n')
    assert start(runtime) == (0, "")
    systemctl.write_text("#!/bin/sh\nexit 1\n")
    assert [start(runtime)[0] for _ in range(4)] == [0, 0, 0, 2]


def test_what_the_last_run_has_left_is_removed(runtime: Path) -> None:
    """The folder is kept while the unit restarts: its log files would fill the memory of the host."""
    start(runtime)
    (runtime / "log").mkdir()
    (runtime / "log/master.log").touch()
    (runtime / ".hidden").touch()
    start(runtime)
    assert [one.name for one in runtime.iterdir()] == ["restarts"]
