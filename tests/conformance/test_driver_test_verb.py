"""``swarmctl driver test`` as people meet it: asked first, one line for a port, never left driving."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from beetles import TYPE, beetle

from swarmctl.cli import exits
from swarmctl.lab.emulators.port import Port

PROGRAM = str(Path(sys.executable).with_name("swarmctl"))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots/beetle.yaml").write_text(TYPE)
    return tmp_path


@pytest.fixture
def port() -> Iterator[Port]:
    with beetle() as port:
        yield port


def run(*arguments: str, stdin: int = subprocess.DEVNULL) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [PROGRAM, "driver", "test", *arguments], stdin=stdin, env={**os.environ, "NO_COLOR": "1"},
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def test_a_report_for_programs(port: Port) -> None:
    ran = run("beetle", "--port", str(port.path), "--yes", "--json")
    assert (ran.returncode, ran.stderr) == (exits.OK, "")
    told = json.loads(ran.stdout)
    assert (told["v"], told["type"], told["passed"]) == (1, "beetle", True)
    assert told["results"][0] == {"check": "stop", "verdict": "ok", "figure": "confirmed", "mend": ""}


def test_a_robot_that_is_not_as_its_type_says_is_an_error_with_a_way_to_mend_it(folder: Path) -> None:
    with beetle("no firmware") as port:
        ran = run("beetle", "--port", str(port.path), "--yes")
    assert ran.returncode == exits.ERROR
    assert "fail  firmware" in ran.stdout
    assert "-> mend `identify`" in ran.stdout
    assert ran.stdout.endswith("not as its type says: 1 ok, 0 warnings, 1 failed\n")


def test_nothing_is_sent_before_the_wheels_are_off_the_ground(port: Port) -> None:
    ran = run("beetle", "--port", str(port.path))
    assert (ran.returncode, ran.stdout) == (exits.USAGE, "")
    assert "its wheels must not touch the ground" in ran.stderr
    mine, theirs = pty.openpty()
    os.write(mine, b"n\n")
    ran = run("beetle", "--port", str(port.path), stdin=theirs)
    assert ran.returncode == exits.ERROR
    assert "Are its wheels off the ground?" in ran.stderr
    assert "nothing was sent" in ran.stderr
    assert port.snapshot().commands == 0
    os.close(mine)
    os.close(theirs)


def test_ports_that_cannot_be_opened_are_one_line(port: Port, folder: Path) -> None:
    missing = run("beetle", "--port", str(folder / "nothing"), "--yes")
    plain = run("beetle", "--port", str(folder / "robots/beetle.yaml"), "--yes")
    for ran, told in ((missing, "is missing"), (plain, "is no serial port")):
        assert (ran.returncode, ran.stdout) == (exits.ERROR, "")
        assert told in ran.stderr
        assert "/dev/serial/by-id" in ran.stderr
        assert "Traceback" not in ran.stderr
    descriptor = os.open(str(port.path), os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    busy = run("beetle", "--port", str(port.path), "--yes")
    os.close(descriptor)
    assert "is in use by another program" in busy.stderr


def test_a_robot_that_speaks_by_itself_is_not_asked() -> None:
    ran = run("arduino-rover", "--port", "/dev/null", "--yes")
    assert ran.returncode == exits.USAGE
    assert "its board speaks rosserial, which is not asked" in ran.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_at_any_moment_leaves_a_robot_that_stands(port: Port, number: int) -> None:
    with subprocess.Popen(
        [PROGRAM, "driver", "test", "beetle", "--port", str(port.path), "--yes"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        end = time.monotonic() + 30
        while not port.snapshot().v and time.monotonic() < end:
            time.sleep(0.01)
        process.send_signal(number)
        _, err = process.communicate(timeout=30)
    assert process.returncode == exits.INTERRUPTED
    assert "interrupted; the robot has confirmed a stop" in err
    assert "Traceback" not in err
    assert not port.snapshot().v
