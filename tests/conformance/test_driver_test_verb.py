"""``swarmctl driver test`` as people meet it: confirmed first, one line for a port, never left driving."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from textwrap import indent

import pytest

from swarmctl.cli import exit_codes
from swarmctl.lab.emulators import ArduinoRover
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.lab.emulators.serial_robot import Port
from swarmctl.scaffold.starting_files import codec_text
from tests import ROOT
from tests.conformance.user_robots import OWN, TYPE, beetle
from tests.timing import PATIENCE, wait_for

EXAMPLE = ROOT / "examples/arduino-rover/swarm.yaml"
#: An alarm may come while the one before is caught; of the three that raise, four levels let none through.
LEVEL = "while True:\n    try:\n        {}\n    except BaseException: pass"
SWALLOWED = "while True: str()"
for _ in range(4):
    SWALLOWED = LEVEL.format(SWALLOWED.replace("\n", "\n        "))
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
        capture_output=True, text=True, timeout=5 * PATIENCE, check=False,
    )  # fmt: skip


def test_json_report(port: Port) -> None:
    ran = run("beetle", "--port", str(port.path), "--yes", "--json")
    assert (ran.returncode, ran.stderr) == (exit_codes.OK, "")
    output = json.loads(ran.stdout)
    assert (output["v"], output["type"], output["passed"]) == (1, "beetle", True)
    assert output["results"][0] == {"check": "stop", "verdict": "ok", "figure": "confirmed", "fix": ""}


def test_a_mismatch_is_an_error_with_a_fix(folder: Path) -> None:
    with beetle("no firmware") as port:
        ran = run("beetle", "--port", str(port.path), "--yes")
    assert ran.returncode == exit_codes.ERROR
    assert "fail  firmware" in ran.stdout
    assert "-> fix `identify`" in ran.stdout
    assert ran.stdout.endswith("the robot does not match its type: 1 ok, 0 warnings, 1 failed\n")


def test_nothing_is_sent_before_the_robot_is_lifted(port: Port) -> None:
    ran = run("beetle", "--port", str(port.path))
    assert (ran.returncode, ran.stdout) == (exit_codes.USAGE, "")
    assert "the wheels must not touch the ground" in ran.stderr
    mine, theirs = pty.openpty()
    os.write(mine, b"n\n")
    ran = run("beetle", "--port", str(port.path), stdin=theirs)
    assert ran.returncode == exit_codes.ERROR
    assert "Are the wheels off the ground?" in ran.stderr
    assert "nothing was sent" in ran.stderr
    assert port.snapshot().commands == 0
    os.close(mine)
    os.close(theirs)


def test_a_port_that_cannot_be_opened_is_one_line(port: Port, folder: Path) -> None:
    missing = run("beetle", "--port", str(folder / "nothing"), "--yes")
    plain = run("beetle", "--port", str(folder / "robots/beetle.yaml"), "--yes")
    for ran, output in ((missing, "is missing"), (plain, "is not a serial port")):
        assert (ran.returncode, ran.stdout) == (exit_codes.ERROR, "")
        assert output in ran.stderr
        assert "/dev/serial/by-id" in ran.stderr
        assert "Traceback" not in ran.stderr
    descriptor = os.open(str(port.path), os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    busy = run("beetle", "--port", str(port.path), "--yes")
    os.close(descriptor)
    assert "is in use by another program" in busy.stderr


def interrupted_after(row: str, *arguments: str) -> tuple[int, str, str]:
    """Returns exit code and output of a test that is interrupted as soon as it prints ``row``."""
    with subprocess.Popen(
        [PROGRAM, "driver", "test", *arguments, "--yes"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, env={**os.environ, "NO_COLOR": "1", "PYTHONUNBUFFERED": "1"},
    ) as process:  # fmt: skip
        assert process.stdout is not None
        output = ""
        for line in process.stdout:
            output += line
            if f" {row} " in line:
                process.send_signal(signal.SIGINT)
                break
        out, err = process.communicate(timeout=PATIENCE)
    return process.returncode, output + out, err


def test_a_board_is_tested_against_the_spec_and_then_stands() -> None:
    """The spec has a sketch per robot: another one on the board is reported."""
    with Port(ArduinoRover(rate=10.0, firmware="0123456789ab")) as port:
        code, out, err = interrupted_after(
            "firmware", "rover", "--spec", str(EXAMPLE), "--port", str(port.path)
        )
        assert not port.snapshot().v
    assert (code, "Traceback" in err) == (exit_codes.INTERRUPTED, False)
    assert "ok    subscribes to commands   cmd_vel, geometry_msgs/Twist" in out
    assert re.search(
        r"fail  firmware +the sketch is 0123456789ab, the spec makes [0-9a-f]{12}: `swarmctl", out
    )


def test_without_spec_the_firmware_is_only_reported() -> None:
    with Port(ArduinoRover(rate=10.0, firmware="0123456789ab")) as port:
        _, out, _ = interrupted_after("firmware", "arduino-rover", "--port", str(port.path))
    assert "ok    firmware                 0123456789ab; use --spec to compare it" in out


def test_a_silent_board_is_an_error_within_half_a_minute() -> None:
    with Port(ArduinoRover()) as port:
        port.faults = Faults(stuck=True)
        ran = run("arduino-rover", "--port", str(port.path), "--yes")
    assert ran.returncode == exit_codes.ERROR
    assert "fail  board                    the board has sent nothing for 15 s (at 57600 baud)" in ran.stdout
    assert "-> check the USB cable, that the rosserial sketch is on the board" in ran.stdout


def test_an_unknown_robot_is_an_error() -> None:
    ran = run("rovr", "--spec", str(EXAMPLE), "--port", "/dev/null", "--yes")
    assert ran.returncode == exit_codes.ERROR
    assert "there is no host or robot called `rovr`" in ran.stderr
    assert "`rover`" in ran.stderr


@pytest.mark.parametrize(
    ("hang", "code"),
    [("while True: pass", exit_codes.ERROR), (SWALLOWED, -signal.SIGALRM)],
    ids=["raises", "swallows"],
)
def test_a_codec_that_hangs_in_motion_ends_with_a_stop(
    folder: Path, port: Port, hang: str, code: int
) -> None:
    """The stop goes out in the bytes of before; from a class that even swallows the alarm nothing does."""
    (folder / "robots/beetle.yaml").write_text(OWN)
    begin = '        """Sets both wheel speeds, in the robot\'s units; zeros stop it."""\n'
    hangs = (
        "        self.calls = getattr(self, 'calls', 0) + 1\n"
        f"        if self.calls > 6:\n            open('hung', 'w').close()\n{indent(hang, ' ' * 12)}\n"
    )
    (folder / "robots/beetle.py").write_text(codec_text("beetle").replace(begin, begin + hangs))
    for _ in range(
        5
    ):  # on a busy machine a call may take too long before the one that hangs, or before its `try`
        ran = run("beetle", "--port", str(port.path), "--yes")
        if (folder / "hung").exists() and ran.returncode == code:
            break
    assert ran.returncode == code, ran.stdout + ran.stderr
    if code == exit_codes.ERROR:
        assert "a call of the protocol's class exceeds the time limit of a driver" in ran.stderr
        assert not port.snapshot().v


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_at_any_moment_stops_the_robot(port: Port, number: int) -> None:
    with subprocess.Popen(
        [PROGRAM, "driver", "test", "beetle", "--port", str(port.path), "--yes"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        wait_for(lambda: port.snapshot().v)
        process.send_signal(number)
        _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == exit_codes.INTERRUPTED
    assert "interrupted; the robot confirmed the stop" in err
    assert "Traceback" not in err
    assert not port.snapshot().v
