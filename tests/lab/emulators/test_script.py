"""Scripts: what happens to a robot and when, in virtual and in real time, and the message for a wrong one."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
import serial

from swarmctl.lab.emulators import VirtualPort, Wall, emulator, play, read_script
from swarmctl.lab.emulators.fault_script import script_of
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.lab.emulators.serial_robot import Port
from swarmctl.views.findings.human import findings
from tests.timing import PATIENCE

DAY = """
- {at: 8.0, set: {battery: 0.25}}
- {at: 1.0, fault: {drop: 1}}
- {at: 2.0, fault: {}}
- {at: 3.0, unplug: true}
- {at: 4.0, plug: true}
- {at: 5.0, power_cycle: true}
- {at: 6.0, walls: [[1, -1, 1, 1]]}
- {at: 7.0, place: [0.9, 0, 0]}
"""


def test_each_step_happens_at_its_time() -> None:
    port = VirtualPort(emulator("epuck"))
    steps, wrong = script_of(DAY, "day.yaml", port.robot)
    assert (wrong, [step.at for step in steps]) == ((), [float(at) for at in range(1, 9)])
    received = []

    def wait(seconds: float) -> None:
        port.advance(seconds / 2)
        received.append(port.ask(b"Q\r"))
        port.advance(seconds / 2)

    assert port.ask(b"D,100,100\r") == b"d\r\n"
    play(steps, port, wait)
    assert received == [
        b"q,50,50\r\n",
        b"",  # dropped
        b"q,250,250\r\n",
        b"",  # unplugged
        b"q,450,450\r\n",
        b"q,0,0\r\n",  # switched off and on
        b"q,0,0\r\n",
        b"q,0,0\r\n",
    ]
    assert port.robot.walls == (Wall(1.0, -1.0, 1.0, 1.0),)
    assert (port.robot.state.x, port.robot.state.battery) == (0.9, 0.25)
    assert int(port.ask(b"N\r").split(b",")[1]) > 10  # it sees the wall


def test_the_same_script_plays_in_real_time() -> None:
    with Port(emulator("koala")) as port:
        steps, _ = script_of("[{at: 0.05, fault: {error: 1}}, {at: 0.1, place: [2, 0, 0]}]", "x", port.robot)
        play(steps, port, time.sleep)
        assert port.snapshot().x == 2.0
        with serial.Serial(str(port.path), timeout=PATIENCE) as driver:
            driver.write(b"E\n")
            assert driver.read_until(b"\n") == b"z,Protocol error\r\n"


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("- {at: 1, unplugged: true}", "day.yaml:1:11", "unknown key `unplugged`"),
        ("- {unplug: true}", "day.yaml:1:3", "`at` is missing"),
        ("- {at: -1, plug: true}", "day.yaml:1:8", "must be 0 or more"),
        ("- {at: soon, plug: true}", "day.yaml:1:8", "must be a number"),
        ("- {at: 1}", "day.yaml:1:3", "a step has one action, this one 0"),
        ("- {at: 1, plug: true, unplug: true}", "day.yaml:1:3", "this one 2"),
        ("- {at: 1, fault: {dorp: 1}}", "day.yaml:1:11", "did you mean 'drop'"),
        ("- {at: 1, fault: {drop: 2}}", "day.yaml:1:11", "a probability"),
        ("- {at: 1, fault: {no_time: true}}", "day.yaml:1:11", "for robots that use rosserial"),
        ("- at: 1\n  set: {selecter: 5}", "day.yaml:2:3", "did you mean 'selector'"),
        ("- at: 1\n  set: {selector: 77}", "day.yaml:2:3", "a position from 0 to 15"),
        ("- at: 1\n  set: {wheel_separation: 1}", "day.yaml:2:3", "fixed when the robot starts"),
        ("- {at: 1, place: [1, 2]}", "day.yaml:1:18", "expected 3 numbers"),
        ("- {at: 1, walls: [[0, 0, 1]]}", "day.yaml:1:19", "expected 4 numbers"),
        ("at: 1", "day.yaml:1:1", "must be a list"),
        ("", "day.yaml:1:1", "must be a list"),
        ("[]", "day.yaml:1:1", "no step"),
        ("- {at: 1", "day.yaml", ""),
    ],
)
def test_a_wrong_script_is_reported_with_its_place(text: str, place: str, message: str) -> None:
    _, wrong = script_of(text, "day.yaml", emulator("epuck"))
    output = findings(wrong, {"day.yaml": text}, 120).plain
    assert place in output
    assert message in output


def test_a_missing_script_is_reported(tmp_path: Path) -> None:
    _, wrong = read_script(tmp_path / "none.yaml", emulator("koala"))
    assert "cannot read" in wrong[0].message


# The virtual line


def test_a_delayed_reply_comes_at_its_virtual_time() -> None:
    port = VirtualPort(emulator("koala"))
    port.faults = Faults(delay=2.0, split=2, gap=1.0)
    port.write(b"E\n")
    assert port.advance(1.999) == b""
    assert port.advance(0.002) == b"e,0,"
    assert port.advance(1.0) == b"0\r\n"


def test_bytes_in_transit_are_lost_with_the_cable() -> None:
    port = VirtualPort(emulator("koala"))
    port.faults = Faults(delay=1.0)
    port.write(b"E\n")
    port.unplug()
    port.plug()
    assert port.advance(5.0) == b""


def test_a_stuck_robot_takes_its_bytes_later() -> None:
    port = VirtualPort(emulator("koala"))
    port.faults = Faults(stuck=True)
    assert port.ask(b"E\n") == b""
    port.faults = Faults()
    assert port.advance(0.0) == b"e,0,0\r\n"


def test_unsolicited_output_comes_at_its_virtual_time() -> None:
    port = VirtualPort(emulator("koala-2.5"))
    assert port.ask(b"A,4\r") == b"a\r"
    assert port.advance(0.35) == b"p,0,0\rp,0,0\rp,0,0\r"
    port.faults = Faults(vanish=1.0)
    assert port.advance(1.0) == b""
    assert not port.plugged
