"""An emulator of one's own: the page's example runs, and a wrong file is told in one line."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest
import serial

from swarmctl.lab.emulators import VirtualPort, play, read_script
from swarmctl.lab.emulators.own import OwnRobotError, built, load
from swarmctl.lab.emulators.port import Port
from swarmctl.lab.emulators.settings import build

PAGE = (Path(__file__).parents[2] / "docs/emulators.md").read_text("utf-8")
(SCRIPT,) = re.findall(r"^```yaml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
PLAYED, BEETLE = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture
def beetle(tmp_path: Path) -> Path:
    file = tmp_path / "beetle.py"
    file.write_text(BEETLE)
    return file


def test_the_pages_robot_answers_and_moves(beetle: Path) -> None:
    robot = build(load(beetle), {"model": "2"})
    port = VirtualPort(robot)
    assert port.ask(b"B\rS,100,50\rL,1\rL,2\r") == b"b,beetle,2\r\ns\r\nl\r\n!\r\n"
    port.advance(1.0)
    assert port.ask(b"P\n") == b"p,200,100\r\n"
    assert (robot.type_name, robot.state.v, robot.state.lights) == (
        "beetle",
        pytest.approx(0.075),
        {"lamp": 1},
    )


def test_the_pages_script_plays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad-day.yaml").write_text(SCRIPT)
    exec(compile(PLAYED, "docs/emulators.md", "exec"), {})
    assert callable(play)
    assert callable(read_script)


def test_a_robot_is_no_longer_than_a_page() -> None:
    assert len(BEETLE.splitlines()) <= 40


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\n", "has no class derived from LineRobot"),
        ("def f(:\n", "beetle.py:1: "),
        ("\nimport no_such_thing\n", "beetle.py:2: ModuleNotFoundError: No module named 'no_such_thing'"),
        ("\n\n1 / 0\n", "beetle.py:3: ZeroDivisionError"),
        ("\nimport sys\nsys.exit(0)\n", "beetle.py:3: SystemExit: it ends the whole program"),
        ("\nquit()\n", "beetle.py:2: SystemExit: it ends the whole program"),
        ("raise KeyboardInterrupt\n", "beetle.py:1: KeyboardInterrupt"),
        ("class Quit(BaseException): pass\nraise Quit('now')\n", "beetle.py:2: Quit: now"),
        (BEETLE.replace("def answer", "def reply_to"), "lacks the method `answer`"),
        (BEETLE + "\n\nclass Other(Beetle):\n    pass\n", "several robots, Beetle, Other"),
        (BEETLE.replace("model: int", "model: nothing"), "name 'nothing' is not defined"),
    ],
)
def test_a_wrong_file_is_told_in_one_line(beetle: Path, text: str, message: str) -> None:
    beetle.write_text(text)
    with pytest.raises(OwnRobotError) as told:
        load(beetle)
    assert message in str(told.value)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("model: int = 1", "model: int", "beetle.py: TypeError: Beetle.__init__() missing 1 required"),
        ("self.model = model", "self.model = 1 / 0", "beetle.py:13: ZeroDivisionError"),
        ("self.model = model", "raise SystemExit(0)", "beetle.py:13: SystemExit"),
    ],
)
def test_a_wrong_constructor_is_told_in_one_line(beetle: Path, before: str, after: str, message: str) -> None:
    beetle.write_text(BEETLE.replace(before, after))
    with pytest.raises(OwnRobotError) as told:
        built(load(beetle), {})
    assert message in str(told.value)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(OwnRobotError, match="there is no file"):
        load(tmp_path / "none.py")


def test_what_it_raises_in_a_reply_ends_it_and_is_blamed_on_its_line(beetle: Path) -> None:
    number = (
        BEETLE.splitlines().index("                self.chassis.drive(int(left) / 1000, int(right) / 1000)")
        + 1
    )
    with Port(build(load(beetle), {})) as port, serial.Serial(str(port.path), timeout=10.0) as driver:
        driver.write(b"S,1,fast\r")
        with pytest.raises(serial.SerialException):
            driver.read(1)
        end = time.monotonic() + 5.0
        while port.failure is None and time.monotonic() < end:
            time.sleep(0.01)
        assert port.failure == (
            f"{beetle}:{number}: ValueError: invalid literal for int() with base 10: 'fast'"
        )
        assert not port.snapshot().plugged


@pytest.mark.parametrize("raised", ["OSError('no')", "SystemExit('no')"])
@pytest.mark.parametrize("method", ["unasked_due", "opened"])
def test_what_it_raises_elsewhere_ends_it_too(beetle: Path, method: str, raised: str) -> None:
    closed = "    def closed(self):\n        pass\n" if method == "opened" else ""
    beetle.write_text(BEETLE + f"\n    def {method}(self):\n        raise {raised}\n" + closed)
    with Port(build(load(beetle), {})) as port:
        end = time.monotonic() + 5.0
        reader = serial.Serial(str(port.path), timeout=0.1) if method == "opened" else None
        while port.failure is None and time.monotonic() < end:
            time.sleep(0.01)
        if reader:
            reader.close()
        assert port.failure is not None
        assert raised.partition("(")[0] in port.failure


def test_a_state_that_cannot_be_told_is_that_of_before_and_ends_it(beetle: Path) -> None:
    """In a lab one robot's mistake leaves the others alone."""
    beetle.write_text(BEETLE + "\n    @property\n    def state(self):\n        raise SystemExit\n")
    with Port(build(load(beetle), {})) as port:
        assert (port.snapshot().x, port.snapshot().plugged) == (0.0, False)
        assert "SystemExit" in str(port.failure)
