"""The recorder of bags on a host: why it ends, and that what it runs closes its bag then."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent import recorder

from tests.timing import wait_for

ROSBAG = """
import signal, sys, time
def close(*_):
    with open("closed", "w") as file:
        file.write(" ".join(sys.argv[1:]))
    raise SystemExit
signal.signal(signal.SIGINT, close)
print("\\x1b[33m[ WARN] [1.0]: slow\\x1b[0m", flush=True)
print("\\x1b[0m[ INFO] [1.0]: Recording\\x1b[0m", flush=True)
open("begun", "w").close()
time.sleep(1000)
"""


def prepared(folder: Path, source: str, seconds: float = 0.0, topics: Sequence[str] = ("/a", "/b")) -> None:
    command = [sys.executable, "-c", source]
    recorder.note(str(folder), {"command": command, "topics": topics, "seconds": seconds, "ended": ""})


def state(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / recorder.STATE).read_text())
    return found


def test_its_end_by_systemd_closes_the_bag(tmp_path: Path) -> None:
    prepared(tmp_path, ROSBAG)
    with subprocess.Popen([sys.executable, "-m", recorder.__name__, str(tmp_path)]) as running:
        wait_for((tmp_path / "begun").exists)
        running.send_signal(signal.SIGTERM)
    assert (tmp_path / "closed").read_text() == "/a /b"
    assert state(tmp_path)["ended"] == "stopped"
    assert state(tmp_path)["output"] == "[ WARN] [1.0]: slow", "without the colour"


@pytest.fixture
def _handler() -> Any:
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


@pytest.mark.usefixtures("_handler")
def test_it_ends_after_its_time(tmp_path: Path) -> None:
    prepared(tmp_path, ROSBAG, seconds=0.5)
    recorder.run(str(tmp_path))
    assert state(tmp_path)["ended"] == "time"


@pytest.mark.usefixtures("_handler")
def test_it_ends_before_the_disk_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "nearly_full", lambda folder: (Path(folder) / "begun").exists())
    prepared(tmp_path, ROSBAG)
    recorder.run(str(tmp_path))
    assert state(tmp_path)["ended"] == "disk"
    assert (tmp_path / "closed").exists()


@pytest.mark.usefixtures("_handler")
def test_a_recorder_that_fails_is_no_end_of_its_own(tmp_path: Path) -> None:
    prepared(tmp_path, "print('no master'); raise SystemExit(7)")
    recorder.run(str(tmp_path))
    found = state(tmp_path)
    assert (found["ended"], found["status"], found["output"]) == ("failed", 7, "no master")
