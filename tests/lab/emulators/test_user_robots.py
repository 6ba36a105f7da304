"""User emulators: the example of the page runs, and a wrong file is reported in one line."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
import serial

from swarmctl.lab.emulators import VirtualPort, play, read_script
from swarmctl.lab.emulators.emulator_settings import build
from swarmctl.lab.emulators.serial_robot import Port
from swarmctl.lab.emulators.user_robot import UserRobotError, build_user_robot, load_robot_class
from tests import ROOT
from tests.timing import PATIENCE, wait_for

PAGE = (ROOT / "docs/emulators.md").read_text("utf-8")
(SCRIPT,) = re.findall(r"^```yaml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
PLAYED, BEETLE = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture
def beetle(tmp_path: Path) -> Path:
    file = tmp_path / "beetle.py"
    file.write_text(BEETLE)
    return file


def test_the_robot_of_the_page_answers_and_moves(beetle: Path) -> None:
    robot = build(load_robot_class(beetle), {"model": "2"})
    port = VirtualPort(robot)
    assert port.ask(b"B\rS,100,50\rL,1\rL,2\r") == b"b,beetle,2\r\ns\r\nl\r\n!\r\n"
    port.advance(1.0)
    assert port.ask(b"P\n") == b"p,200,100\r\n"
    assert (robot.type_name, robot.state.v, robot.state.lights) == (
        "beetle",
        pytest.approx(0.075),
        {"lamp": 1},
    )


def test_the_script_of_the_page_plays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad-day.yaml").write_text(SCRIPT)
    exec(compile(PLAYED, "docs/emulators.md", "exec"), {})
    assert callable(play)
    assert callable(read_script)


def test_the_example_robot_is_short() -> None:
    assert len(BEETLE.splitlines()) <= 40


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\n", "needs a class derived from LineRobot"),
        ("def f(:\n", "beetle.py:1: "),
        ("\nimport no_such_thing\n", "beetle.py:2: ModuleNotFoundError: No module named 'no_such_thing'"),
        ("\n\n1 / 0\n", "beetle.py:3: ZeroDivisionError"),
        ("\nimport sys\nsys.exit(0)\n", "beetle.py:3: SystemExit: it would end the whole program"),
        ("\nquit()\n", "beetle.py:2: SystemExit: it would end the whole program"),
        ("raise KeyboardInterrupt\n", "beetle.py:1: KeyboardInterrupt"),
        ("class Quit(BaseException): pass\nraise Quit('now')\n", "beetle.py:2: Quit: now"),
        (BEETLE.replace("def answer", "def reply_to"), "needs the method `answer`"),
        (BEETLE + "\n\nclass Other(Beetle):\n    pass\n", "several robots, Beetle, Other"),
        (BEETLE.replace("model: int", "model: nothing"), "name 'nothing' is not defined"),
    ],
)
def test_a_wrong_file_is_reported_in_one_line(beetle: Path, text: str, message: str) -> None:
    beetle.write_text(text)
    with pytest.raises(UserRobotError) as error:
        load_robot_class(beetle)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("model: int = 1", "model: int", "beetle.py: TypeError: Beetle.__init__() missing 1 required"),
        ("self.model = model", "self.model = 1 / 0", "beetle.py:13: ZeroDivisionError"),
        ("self.model = model", "raise SystemExit(0)", "beetle.py:13: SystemExit"),
    ],
)
def test_a_wrong_constructor_is_reported_in_one_line(
    beetle: Path, before: str, after: str, message: str
) -> None:
    beetle.write_text(BEETLE.replace(before, after))
    with pytest.raises(UserRobotError) as error:
        build_user_robot(load_robot_class(beetle), {})
    assert message in str(error.value)


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(UserRobotError, match="file not found"):
        load_robot_class(tmp_path / "none.py")


def test_an_exception_in_a_reply_ends_it_with_file_and_line(beetle: Path) -> None:
    number = (
        BEETLE.splitlines().index("                self.chassis.drive(int(left) / 1000, int(right) / 1000)")
        + 1
    )
    with (
        Port(build(load_robot_class(beetle), {})) as port,
        serial.Serial(str(port.path), timeout=PATIENCE) as driver,
    ):
        driver.write(b"S,1,fast\r")
        with pytest.raises(serial.SerialException):
            driver.read(1)
        wait_for(lambda: port.failure)
        assert port.failure == (
            f"{beetle}:{number}: ValueError: invalid literal for int() with base 10: 'fast'"
        )
        assert not port.snapshot().plugged


@pytest.mark.parametrize("raised", ["OSError('no')", "SystemExit('no')"])
@pytest.mark.parametrize("method", ["unsolicited_due", "opened"])
def test_an_exception_elsewhere_ends_it_too(beetle: Path, method: str, raised: str) -> None:
    closed = "    def closed(self):\n        pass\n" if method == "opened" else ""
    beetle.write_text(BEETLE + f"\n    def {method}(self):\n        raise {raised}\n" + closed)
    with Port(build(load_robot_class(beetle), {})) as port:
        # Not pyserial: it configures the port, which may be closed by then.
        reader = os.open(port.path, os.O_RDWR | os.O_NOCTTY) if method == "opened" else None
        wait_for(lambda: port.failure)
        if reader is not None:
            os.close(reader)
        assert port.failure is not None
        assert raised.partition("(")[0] in port.failure


def test_an_exception_in_its_state_ends_it_with_the_last_state(beetle: Path) -> None:
    """In a lab one robot's mistake leaves the others alone."""
    beetle.write_text(BEETLE + "\n    @property\n    def state(self):\n        raise SystemExit\n")
    with Port(build(load_robot_class(beetle), {})) as port:
        assert (port.snapshot().x, port.snapshot().plugged) == (0.0, False)
        assert "SystemExit" in str(port.failure)
