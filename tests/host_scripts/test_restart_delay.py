"""``restart-delay``: a unit that ends again and again starts ever later; one that has run long, at once."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path

import pytest

from swarmctl.resources import templates
from tests.timing import PATIENCE

PROGRAM = templates() / "os/restart-delay"
UNIT = "swarm-test.k3.service"


@pytest.fixture
def records(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the records; ``sleep`` notes how long it takes, ``systemctl`` prints 7 restarts."""
    for name, script in {"sleep": f'echo "$1" >>{tmp_path}/slept', "systemctl": "echo 7"}.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{script}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    return tmp_path / "restarts"


def start(records: Path) -> tuple[int, str]:
    """The delay of the next start, s, and what is printed."""
    slept = records.parent / "slept"
    slept.unlink(missing_ok=True)
    command = [str(PROGRAM), UNIT, str(records)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True)
    assert done.stderr == ""
    return int(slept.read_text()) if slept.exists() else 0, done.stdout.strip()


def age(records: Path, seconds: int) -> None:
    """Moves the last start into the past."""
    count, began = (records / UNIT).read_text().split()
    (records / UNIT).write_text(f"{count} {int(began) - seconds}\n")


def test_the_delay_grows_and_has_a_limit(records: Path) -> None:
    assert [start(records)[0] for _ in range(10)] == [0, 0, 0, 0, 2, 4, 8, 16, 20, 20]
    assert start(records)[1] == "ended 10 times, each within a minute of its start: starts again in 20 s"


def test_a_unit_that_has_run_for_a_minute_starts_at_once(records: Path) -> None:
    delays = [start(records)[0] for _ in range(6)]
    age(records, 90)
    assert (delays[-1], start(records)) == (4, (0, ""))


def test_a_start_by_hand_is_not_delayed_and_begins_a_new_count(records: Path) -> None:
    for _ in range(6):
        start(records)
    systemctl = records.parent / "systemctl"
    systemctl.write_text(f'#!/bin/sh\n[ "$*" = "show --property=NRestarts --value -- {UNIT}" ] && echo 0\n')
    assert start(records) == (0, "")
    systemctl.write_text("#!/bin/sh\nexit 1\n")
    assert [start(records)[0] for _ in range(4)] == [0, 0, 0, 2]


def test_a_stop_ends_the_wait_and_is_no_failure(records: Path) -> None:
    """The unit would count as failed after `systemctl stop`."""
    for _ in range(4):
        start(records)
    (records.parent / "sleep").unlink()
    (records / UNIT).write_text(f"9 {(records / UNIT).read_text().split()[1]}\n")
    waiting = subprocess.Popen([str(PROGRAM), UNIT, str(records)], stdout=subprocess.PIPE, text=True)
    assert waiting.stdout is not None
    assert waiting.stdout.readline().endswith("starts again in 20 s\n")
    time.sleep(0.2)  # until it waits
    waiting.terminate()
    assert waiting.communicate(timeout=10) == ("", None), "the sleep, which has the pipe as well, goes on"
    assert waiting.returncode == 0
