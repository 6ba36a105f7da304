"""Every fault of a line: what a driver receives, and what the robot does. In virtual time."""

from __future__ import annotations

from dataclasses import dataclass, fields

import pytest
import serial

from swarmctl.lab.emulators import VirtualPort, emulator
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.lab.emulators.serial_robot import Port
from tests.timing import PATIENCE

ORDER, REPLY = b"D,100,100\r", b"d\r\n"


@dataclass(frozen=True)
class Row:
    """A fault, what is received within 0.5 s of a command and 2 s later, and whether it drives."""

    fault: str
    soon: bytes
    later: bytes
    drives: bool = True


BANNER = emulator("epuck").banner()
TABLE = [
    Row("delay=0", REPLY, b""),
    Row("delay=0.6", b"", REPLY),
    Row("late=1", b"", REPLY),
    Row("late=1 late_by=0.4", REPLY, b""),
    Row("drop=1", b"", b""),
    Row("error=1", b"z,Command not found\r\n", b""),
    Row("truncate=1", b"d", b""),
    Row("garbage=1", REPLY, b""),
    Row("banner=1", BANNER, b"", drives=False),
    Row("vanish=1", b"", b""),
    Row("stuck=1", b"", b"", drives=False),
    Row("split=3 gap=0.2", REPLY, b""),
    Row("split=3 gap=0.3", b"d\r", b"\n"),
]


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.fault)
def test_each_fault_shows_on_the_line_and_in_the_robot(row: Row) -> None:
    port = VirtualPort(emulator("epuck"))
    port.faults = Faults.parse([*row.fault.split(), "seed=5"])
    port.write(ORDER)
    soon = port.advance(0.5)
    noise = len(soon) - len(REPLY) if row.fault == "garbage=1" else 0
    assert 1 <= noise <= 8 or row.fault != "garbage=1"
    assert soon[noise:] == row.soon
    assert port.advance(2.0) == row.later
    assert (port.robot.state.v > 0) is row.drives
    assert port.plugged is (row.fault != "vanish=1")


def test_the_tables_have_every_fault_of_a_text_line() -> None:
    shown = {setting.partition("=")[0] for row in TABLE for setting in row.fault.split()}
    in_frames = {"stray_ff", "bad_length", "bad_checksum", "overlong", "wrong_md5", "no_time"}  # the rover's
    assert shown | in_frames | {"seed"} == {field.name for field in fields(Faults)}


@pytest.mark.parametrize(
    "name", ["stray_ff", "bad_length", "bad_checksum", "overlong", "wrong_md5", "no_time"]
)
def test_frame_faults_need_a_rosserial_robot(name: str) -> None:
    with pytest.raises(ValueError, match=f"'{name}' is for robots that use rosserial"):
        VirtualPort(emulator("koala")).faults = Faults.parse([f"{name}=1"])
    VirtualPort(emulator("arduino-rover")).faults = Faults.parse([f"{name}=1"])


def test_the_same_seed_strikes_the_same_replies() -> None:
    def received(seed: int) -> list[bytes]:
        port = VirtualPort(emulator("koala"))
        port.faults = Faults(drop=0.3, garbage=0.3, truncate=0.3, seed=seed)
        return [port.ask(b"N\n") for _ in range(30)]

    assert received(1) == received(1) != received(2)


# On a real pty


def test_a_stuck_robot_takes_its_bytes_when_released() -> None:
    with Port(emulator("koala")) as port, serial.Serial(str(port.path), timeout=0.2) as driver:
        port.faults = Faults(stuck=True)
        driver.write(b"E\n")
        assert driver.read(1) == b""
        assert port.snapshot().commands == 0
        driver.write_timeout = 0.2
        with pytest.raises(serial.SerialTimeoutException):
            driver.write(b"E\n" * 50_000)
        driver.timeout = PATIENCE
        port.faults = Faults()
        assert driver.read_until(b"\n") == b"e,0,0\r\n"


def test_a_robot_that_resets_itself_prints_its_banner_and_stands() -> None:
    with Port(emulator("epuck")) as port, serial.Serial(str(port.path), timeout=PATIENCE) as driver:
        driver.write(ORDER)
        assert driver.read(3) == REPLY
        port.faults = Faults(banner=1.0)
        driver.write(b"E\r")
        assert driver.read(len(BANNER)) == BANNER
        assert port.snapshot().v == 0.0
