"""``swarmctl driver test`` as people meet it: asked first, one line for a port, never left driving."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from beetles import OWN, TYPE, beetle

from swarmctl.cli import exits
from swarmctl.lab.emulators import ArduinoRover
from swarmctl.lab.emulators.faults import Faults
from swarmctl.lab.emulators.port import Port
from swarmctl.render.own_type import codec_text

EXAMPLE = Path(__file__).parents[2] / "examples/arduino-rover/swarm.yaml"
SWALLOWED = "\n            ".join(
    ["while True:", "    try:", "        while True: str()", "    except BaseException: pass"]
)
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


def interrupted_after(row: str, *arguments: str) -> tuple[int, str, str]:
    """Exit code and output of a test that is given up as soon as it tells ``row``."""
    with subprocess.Popen(
        [PROGRAM, "driver", "test", *arguments, "--yes"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, env={**os.environ, "NO_COLOR": "1", "PYTHONUNBUFFERED": "1"},
    ) as process:  # fmt: skip
        assert process.stdout is not None
        told = ""
        for line in process.stdout:
            told += line
            if f" {row} " in line:
                process.send_signal(signal.SIGINT)
                break
        out, err = process.communicate(timeout=60)
    return process.returncode, told + out, err


def test_a_board_is_tried_as_the_spec_has_it_and_stands_after_it() -> None:
    """The spec makes a sketch for each robot: another one on the board is told."""
    with Port(ArduinoRover(rate=10.0, firmware="0123456789ab")) as port:
        code, out, err = interrupted_after(
            "firmware", "rover", "--spec", str(EXAMPLE), "--port", str(port.path)
        )
        assert not port.snapshot().v
    assert (code, "Traceback" in err) == (exits.INTERRUPTED, False)
    assert "ok    hears orders             cmd_vel, geometry_msgs/Twist" in out
    assert re.search(
        r"fail  firmware +the sketch is 0123456789ab, the spec makes [0-9a-f]{12}: `swarmctl", out
    )


def test_a_bare_type_tells_the_firmware() -> None:
    with Port(ArduinoRover(rate=10.0, firmware="0123456789ab")) as port:
        _, out, _ = interrupted_after("firmware", "arduino-rover", "--port", str(port.path))
    assert "ok    firmware                 0123456789ab; --spec compares it with a robot's" in out


def test_a_board_that_says_nothing_is_an_error_in_half_a_minute() -> None:
    with Port(ArduinoRover()) as port:
        port.faults = Faults(stuck=True)
        ran = run("arduino-rover", "--port", str(port.path), "--yes")
    assert ran.returncode == exits.ERROR
    assert "fail  board                    the board has said nothing for 15 s (at 57600 baud)" in ran.stdout
    assert "-> check the USB cable, that the rosserial sketch is on the board" in ran.stdout


def test_a_robot_that_the_spec_does_not_have() -> None:
    ran = run("rovr", "--spec", str(EXAMPLE), "--port", "/dev/null", "--yes")
    assert ran.returncode == exits.USAGE
    assert "there is no robot called `rovr`" in ran.stderr
    assert "`rover`" in ran.stderr


@pytest.mark.parametrize(
    ("hang", "code"),
    [("while True: pass", exits.ERROR), (SWALLOWED, -signal.SIGALRM)],
    ids=["raises", "swallows"],
)
def test_a_class_that_hangs_in_motion_ends_the_test_and_leaves_a_robot_that_stands(
    folder: Path, port: Port, hang: str, code: int
) -> None:
    """The stop goes out in the bytes of before; from a class that even swallows the alarm nothing does."""
    (folder / "robots/beetle.yaml").write_text(OWN)
    begin = '        """Sets both wheel speeds, in the robot\'s units; zeros stop it."""\n'
    hangs = (
        f"        self.said = getattr(self, 'said', 0) + 1\n        if self.said > 6:\n            {hang}\n"
    )
    (folder / "robots/beetle.py").write_text(codec_text("beetle").replace(begin, begin + hangs))
    began = time.monotonic()
    ran = run("beetle", "--port", str(port.path), "--yes")
    assert time.monotonic() - began < 30
    assert ran.returncode == code, ran.stdout + ran.stderr
    if code == exits.ERROR:
        assert "a call of the protocol's class takes longer than a driver waits" in ran.stderr
        assert not port.snapshot().v


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
