"""Robots on real ptys, spoken to as a driver does: with pyserial, opened exclusively."""

from __future__ import annotations

import os
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.lab.emulators import TYPES, emulator
from swarmctl.lab.emulators.pty import WAITING_LIMIT, Cable
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.lab.emulators.serial_robot import Port
from tests.timing import PATIENCE, wait_for, work_at_most


@pytest.fixture(autouse=True)
def _nothing_left_behind() -> Iterator[None]:
    threads, files = threading.active_count(), len(list(Path("/proc/self/fd").iterdir()))
    yield
    assert threading.active_count() == threads
    assert len(list(Path("/proc/self/fd").iterdir())) == files


@pytest.fixture
def port() -> Iterator[Port]:
    with Port(emulator("koala")) as plugged:
        yield plugged


def line(port: Port, timeout: float = PATIENCE) -> serial.Serial:
    return serial.Serial(str(port.path), 115200, timeout=timeout, exclusive=True)


def ask(driver: serial.Serial, request: bytes) -> bytes:
    driver.write(request)
    return bytes(driver.read_until(b"\n"))


def waiting_at(path: str) -> bytes:
    """What a program reads that opens the port and flushes nothing."""
    reader = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        return os.read(reader, 100)
    except BlockingIOError:
        return b""
    finally:
        os.close(reader)


@pytest.mark.parametrize("name", sorted(TYPES.keys() - {"arduino-rover"}))
def test_a_driver_is_answered(name: str) -> None:
    with Port(emulator(name)) as port, line(port) as driver:
        driver.write(b"E\r")
        assert driver.read(5) == b"e,0,0"


def test_a_second_driver_is_locked_out(port: Port) -> None:
    with line(port), pytest.raises(serial.SerialException):
        line(port)


def test_a_driver_may_reconnect(port: Port) -> None:
    for count in range(5):
        with line(port) as driver:
            assert ask(driver, b"G,%d,0\n" % count) == b"g\r\n"
            assert ask(driver, b"H\n") == b"h,%d,0\r\n" % count
    assert port.snapshot().plugged


def test_unread_bytes_are_discarded_for_the_next_driver(port: Port) -> None:
    path = str(port.path)
    with line(port) as driver:
        driver.write(b"N\n")
        wait_for(lambda: driver.in_waiting > 0)
    time.sleep(0.05)
    assert waiting_at(path) == b""


def test_bytes_sent_to_a_closed_port_are_lost() -> None:
    cable = Cable(Path("/dev/ptmx"))
    try:
        cable.put([(0.0, b"noise")])
        cable.write()
        assert waiting_at(str(cable.path)) == b""
    finally:
        cable.close()


def test_the_port_belongs_to_group_dialout(port: Port) -> None:
    assert port.path is not None
    assert port.path.stat().st_mode & 0o777 == 0o660


def test_no_byte_is_lost_or_out_of_place(port: Port) -> None:
    requests = 3000  # 38 KB of replies: more than a pty holds
    with line(port) as driver:
        for number in range(requests):
            driver.write(b"G,%d,0\nH\n" % number)
        expected = b"".join(b"g\r\nh,%d,0\r\n" % number for number in range(requests))
        assert driver.read(len(expected)) == expected


def test_a_reader_that_never_reads_needs_bounded_memory(port: Port) -> None:
    with line(port, timeout=0.3) as driver:
        for _ in range(100):
            driver.write(b"N\n" * 100)
        wait_for(lambda: port.snapshot().commands == 10_000)
        received = b"".join(iter(lambda: driver.read(4096), b""))
        assert len(received) <= WAITING_LIMIT + 32_768
        assert received.startswith(b"n,")
        assert ask(driver, b"E\n") == b"e,0,0\r\n"


def test_an_unplugged_reader_gets_a_hangup(port: Port) -> None:
    with line(port) as driver:
        timer = threading.Timer(0.05, port.unplug)
        timer.start()
        with pytest.raises(serial.SerialException):
            driver.read(1)
        timer.join()
    assert not port.snapshot().plugged
    assert port.path is None


def test_a_replugged_port_works(port: Port) -> None:
    port.unplug()
    port.unplug()
    path = port.plug()
    assert port.plug() == path == port.path
    with line(port) as driver:
        assert ask(driver, b"E\n") == b"e,0,0\r\n"


def test_an_unplugged_robot_drives_on() -> None:
    port = Port(emulator("koala"))
    port.plug()
    with line(port) as driver:
        ask(driver, b"D,100,100\n")
    port.unplug()
    began = time.monotonic()
    before = port.snapshot()
    time.sleep(0.1)
    after = port.snapshot()
    most = 0.45 * (time.monotonic() - began)
    assert after.v == pytest.approx(0.45)
    assert 0.045 <= after.x - before.x <= most


def test_twenty_idle_ports_cost_nothing() -> None:
    ports = [Port(emulator("koala")) for _ in range(20)]
    try:
        for port in ports:
            port.plug()
            port.robot.receive(b"D,10,10\n")
        with work_at_most(5):
            time.sleep(2.0)
    finally:
        for port in ports:
            port.close()


def test_power_cycle_stops_the_robot_and_prints_its_banner() -> None:
    with Port(emulator("epuck")) as port, line(port) as driver:
        ask(driver, b"D,300,300\r")
        port.power_cycle()
        assert driver.read(len(port.robot.banner())) == port.robot.banner()
        assert port.snapshot().v == 0.0


@pytest.mark.skipif(os.geteuid() != 0, reason="mounts a devpts")
def test_a_port_may_use_another_devpts(tmp_path: Path) -> None:
    options = "newinstance,ptmxmode=0666,mode=0620"
    subprocess.run(["mount", "-t", "devpts", "-o", options, "devpts", tmp_path], check=True)
    try:
        with Port(emulator("epuck"), ptmx=tmp_path / "ptmx") as port, line(port) as driver:
            assert port.path == tmp_path / "0"
            assert port.path.stat().st_mode & 0o777 == 0o660
            assert ask(driver, b"E\r") == b"e,0,0\r\n"
    finally:
        subprocess.run(["umount", tmp_path], check=True)


# Faults


@pytest.fixture
def driver(port: Port) -> Iterator[serial.Serial]:
    with line(port) as opened:
        yield opened


def test_a_delayed_reply_is_late_and_whole(port: Port, driver: serial.Serial) -> None:
    port.faults = Faults(delay=0.15)
    began = time.monotonic()
    assert ask(driver, b"E\n") == b"e,0,0\r\n"
    assert time.monotonic() - began >= 0.15


def test_no_reply_overtakes_a_delayed_one(port: Port, driver: serial.Serial) -> None:
    port.faults = Faults(delay=0.15)
    driver.write(b"E\n")
    wait_for(lambda: port.snapshot().commands == 1)
    port.faults = Faults()
    driver.write(b"H\n")
    assert driver.read_until(b"\n") == b"e,0,0\r\n"
    assert driver.read_until(b"\n") == b"h,0,0\r\n"


def test_a_dropped_reply_means_an_executed_command(port: Port, driver: serial.Serial) -> None:
    port.faults = Faults(drop=1.0)
    driver.timeout = 0.1
    assert ask(driver, b"D,10,10\n") == b""
    assert port.snapshot().v > 0


def test_a_truncated_reply_is_half_a_line(port: Port, driver: serial.Serial) -> None:
    port.faults = Faults(truncate=1.0)
    driver.write(b"E\n")
    assert driver.read(3) == b"e,0"
    driver.timeout = 0.1
    assert driver.read() == b""


def test_the_error_fault_sends_the_robots_own_error(port: Port, driver: serial.Serial) -> None:
    port.faults = Faults(error=1.0)
    assert ask(driver, b"E\n") == b"z,Protocol error\r\n"


def test_a_split_reply_has_gaps_and_is_complete(port: Port, driver: serial.Serial) -> None:
    port.faults = Faults(split=3, gap=0.1)
    began = time.monotonic()
    assert ask(driver, b"E\n") == b"e,0,0\r\n"
    assert time.monotonic() - began >= 0.2


@given(st.binary(), st.integers(1, 300))
def test_splitting_loses_no_bytes(answer: bytes, split: int) -> None:
    pieces = Faults(split=split).pieces(answer, b"", Random(0))
    assert b"".join(data for _, data in pieces) == answer
    assert len(pieces) <= split
    assert all(data for _, data in pieces)


def test_garbage_precedes_the_reply_and_depends_on_the_seed(port: Port, driver: serial.Serial) -> None:
    received = []
    for _ in range(2):
        port.faults = Faults(garbage=1.0, seed=3)
        driver.timeout = 0.1
        driver.write(b"E\n")
        received.append(driver.read(100))
    assert received[0] == received[1] != b"e,0,0\r\n"
    assert received[0].endswith(b"e,0,0\r\n")


def test_a_vanished_port_can_be_plugged_again(port: Port) -> None:
    port.faults = Faults(vanish=1.0)
    with line(port) as driver, pytest.raises(serial.SerialException):
        ask(driver, b"E\n")
    wait_for(lambda: not port.snapshot().plugged)
    port.faults = Faults()
    port.plug()
    with line(port) as driver:
        assert ask(driver, b"E\n") == b"e,0,0\r\n"


def test_faults_are_parsed_from_texts() -> None:
    assert Faults.parse(["delay=0.2", "drop=0.1", "split=3"]) == Faults(delay=0.2, drop=0.1, split=3)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("dely=1", "did you mean 'delay'"),
        ("xyzzy=1", "There are: delay"),
        ("delay", "needs a number"),
        ("drop=2", "probability"),
        ("drop=nan", "probability"),
        ("delay=-1", "time"),
        ("split=0", "pieces"),
        ("split=1.5", "needs a number"),
    ],
)
def test_a_wrong_fault_is_explained(setting: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Faults.parse([setting])
