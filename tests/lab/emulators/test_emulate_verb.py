"""``swarmctl emulate`` as a process: its port, its link, its lines, its exit codes."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import serial

from tests.timing import PATIENCE

PROGRAM = "import typer; from swarmctl.cli.verbs.emulate import emulate; typer.run(emulate)"


@pytest.fixture
def start() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    started: list[subprocess.Popen[str]] = []

    def run(*arguments: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield run
    for process in started:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_a_robot_runs_until_it_is_interrupted(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path, end: signal.Signals
) -> None:
    link = tmp_path / "koala"
    process = start("koala", "--link", str(link))
    assert process.stdout
    path = process.stdout.readline().strip()
    assert str(link.readlink()) == path
    with serial.Serial(str(link), timeout=PATIENCE, exclusive=True) as driver:
        driver.write(b"D,44,44\n")
        assert driver.read_until(b"\n") == b"d\r\n"
        assert "+0.1980 +0.1980 m/s" in process.stdout.readline()
        driver.write(b"D,0,0\n")
        driver.read_until(b"\n")
        assert "+0.0000 +0.0000 m/s  'D,0,0'" in process.stdout.readline()
    process.send_signal(end)
    assert process.communicate(timeout=PATIENCE) == ("", "")
    assert process.returncode == 0
    assert not link.is_symlink()


def test_json_has_the_same_content(start: Callable[..., subprocess.Popen[str]]) -> None:
    process = start("khepera3", "--set", "firmware=3", "--json", "--seconds", "0.5")
    assert process.stdout
    port = json.loads(process.stdout.readline())["port"]
    with serial.Serial(port, timeout=PATIENCE) as driver:
        driver.write(b"D,l21872,l21872\n")
        assert driver.read_until(b"\n") == b"d\r\n"
    states = [json.loads(line) for line in process.communicate(timeout=PATIENCE)[0].splitlines()]
    assert [round(state["v"], 3) for state in states] == [0.1, 0.1]
    assert states[-1]["x"] > states[0]["x"]
    assert process.returncode == 0


def test_a_port_that_vanished_returns_under_its_link(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    link = tmp_path / "port"
    process = start("epuck", "--link", str(link), "--fault", "vanish=1")
    assert process.stdout
    first = process.stdout.readline()
    with serial.Serial(str(link), timeout=PATIENCE) as driver:
        driver.write(b"E\r")
        with pytest.raises(serial.SerialException):
            driver.read(1)
    assert process.stdout.readline().startswith("/dev/pts/")
    assert first.startswith("/dev/pts/")
    with serial.Serial(str(link)):
        pass


def test_a_script_plays_and_replugs_the_cable(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    script = tmp_path / "day.yaml"
    script.write_text("- {at: 0.2, unplug: true}\n- {at: 0.6, plug: true}\n- {at: 0.8, place: [1, 2, 0]}\n")
    process = start("koala", "--script", str(script), "--seconds", "1.2")
    assert process.stdout
    ports = [process.stdout.readline() for _ in range(2)]
    assert all(port.startswith("/dev/pts/") for port in ports)
    assert process.communicate(timeout=PATIENCE) == ("", "")
    assert process.returncode == 0


def test_an_error_in_a_script_has_its_line(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    script = tmp_path / "day.yaml"
    script.write_text("- at: 1\n  unplugged: true\n")
    process = start("koala", "--script", str(script))
    _, error = process.communicate(timeout=PATIENCE)
    assert "day.yaml:2:3" in error
    assert "did you mean `unplug`?" in error
    assert process.returncode == 1


def test_a_user_robot_runs_and_its_error_is_one_line(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    own = tmp_path / "beetle.py"
    own.write_text(
        "from swarmctl.lab.emulators import Chassis, LineRobot\n"
        "class Beetle(LineRobot):\n"
        "    def __init__(self, *, size: float = 0.1):\n"
        "        super().__init__(Chassis(wheel_separation=size, metres_per_count=1.0, counter_bits=16))\n"
        "    def answer(self, line):\n"
        "        return str(1 / int(line)).encode()\n"
    )
    process = start(str(own), "--set", "size=0.2")
    assert process.stdout
    with serial.Serial(process.stdout.readline().strip(), timeout=PATIENCE) as driver:
        driver.write(b"4\r")
        assert driver.read(4) == b"0.25"
        driver.write(b"0\r")
        error = process.communicate(timeout=PATIENCE)[1]
    assert error == f"error: {own}:6: ZeroDivisionError: division by zero\n"
    assert process.returncode == 1


OWN = """\
import os, sys
from swarmctl.lab.emulators import Chassis, LineRobot
print("loaded")
class Beetle(LineRobot):
    def __init__(self):
        super().__init__(Chassis(wheel_separation=0.1, metres_per_count=1.0, counter_bits=16))
        print("made")
    def answer(self, line):
        print("polled")
        return b"1"
    def advance(self, dt):
        super().advance(dt)
"""


@pytest.mark.parametrize(
    ("place", "line"),
    [("import os, sys\n", 2), ('        print("made")\n', 8), ("        super().advance(dt)\n", 13)],
    ids=["import", "__init__", "method"],
)
def test_a_user_robot_that_exits_is_reported(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path, place: str, line: int
) -> None:
    own = tmp_path / "beetle.py"
    indent = place[: len(place) - len(place.lstrip())]
    own.write_text(OWN.replace(place, f"{place}{indent}sys.exit(0)\n"))
    process = start(str(own), "--seconds", "5")
    error = process.communicate(timeout=PATIENCE)[1]
    assert f"error: {own}:{line}: SystemExit: it would end the whole program" in error
    assert process.returncode == 1


def test_output_of_a_user_robot_goes_to_stderr(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    own = tmp_path / "beetle.py"
    own.write_text(OWN)
    process = start(str(own), "--json", "--seconds", "1")
    assert process.stdout
    with serial.Serial(json.loads(process.stdout.readline())["port"], timeout=PATIENCE) as driver:
        driver.write(b"?\r")
        assert driver.read(1) == b"1"
        assert process.communicate(timeout=PATIENCE) == ("", "loaded\nmade\npolled\n")


def test_a_forked_process_of_a_user_robot_ends(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    own = tmp_path / "beetle.py"
    own.write_text(OWN.replace('print("loaded")', "os.fork()"))
    out, error = start(str(own), "--seconds", "0.5").communicate(timeout=PATIENCE)
    assert out.count("/dev/pts/") == 1
    assert f"error: {own}: it called fork; the forked process ends" in error


def test_the_types_are_listed(start: Callable[..., subprocess.Popen[str]]) -> None:
    listed = start("--list").communicate(timeout=PATIENCE)[0]
    for name in ("koala", "koala-2.5", "khepera3", "epuck", "epuck2", "arduino-rover"):
        assert f"\n{name} " in "\n" + listed
    listed = json.loads(start("--list", "--json").communicate(timeout=PATIENCE)[0])
    assert {one["type"]: one["settings"] for one in listed}["epuck"] == [
        "wheel_separation",
        "selector",
        "battery",
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["koalla"], "did you mean `koala`?"),
        ([], "the robot type is missing"),
        (["koala", "--set", "firmware=2"], "unknown setting 'firmware'. There are: "),
        (["epuck-binary", "--set", "selector=16"], "a position from 0 to 15"),
        (["khepera3", "--set", "firmware=4"], "firmware 2 or 3"),
        (["khepera3", "--set", "firmware=new"], "'firmware' is a whole number"),
        (["khepera3", "--set", "server=perhaps"], "'server' is true or false"),
        (["epuck", "--set", "selecter=5"], "did you mean 'selector'?"),
        (["epuck", "--set", "selector=16"], "a position from 0 to 15"),
        (["koala", "--set", "battery=2"], "between 0 (empty) and 1 (full)"),
        (["koala", "--set", "wheel_separation=0"], "a distance in m"),
        (["koala", "--fault", "dely=1"], "did you mean 'delay'?"),
        (["koala", "--fault", "wrong_md5=1"], "for robots that use rosserial"),
    ],
)
def test_a_wrong_call_explains_the_right_one(
    start: Callable[..., subprocess.Popen[str]], arguments: list[str], message: str
) -> None:
    process = start(*arguments)
    _, error = process.communicate(timeout=PATIENCE)
    assert message in error
    assert process.returncode == 64


def test_a_link_never_replaces_a_file(start: Callable[..., subprocess.Popen[str]], tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_text("data")
    process = start("koala", "--link", str(precious))
    assert "is not a symbolic link" in process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == 1
    assert precious.read_text() == "data"
