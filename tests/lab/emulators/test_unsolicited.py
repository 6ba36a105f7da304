"""Robots with unsolicited output and robots that notice their port: in exact time, and on a real pty."""

from __future__ import annotations

import math
import os
import threading
import time
from typing import ClassVar

import pytest
import serial

from swarmctl.lab.emulators import Robot, emulator
from swarmctl.lab.emulators.differential_drive import Chassis
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.lab.emulators.serial_robot import Port
from tests.timing import PATIENCE, wait_for

PERIOD = 0.05


class Talker(Robot):
    """Counts aloud, twenty times a second, from the moment its port is opened."""

    type_name: ClassVar[str] = "talker"
    refusal = b"?\n"

    def __init__(self) -> None:
        super().__init__(Chassis(wheel_separation=0.1, metres_per_count=1.0, counter_bits=16))
        self.next = math.inf
        self.number = 0
        self.seen: list[str] = []

    def replies(self, data: bytes) -> list[bytes]:
        return [b"received " + data]

    def unsolicited_due(self) -> float:
        return self.next - self.chassis.time

    def unsolicited(self) -> list[bytes]:
        self.next += PERIOD
        self.number += 1
        return [b"%d\n" % self.number]

    def opened(self) -> None:
        self.seen.append("opened")
        self.next = self.chassis.time + PERIOD

    def closed(self) -> None:
        self.seen.append("closed")


def test_unsolicited_output_is_exact_in_time() -> None:
    talker = Talker()
    talker.opened()
    assert talker.run_for(0.049) == []
    assert talker.run_for(0.002) == [b"1\n"]
    assert talker.run_for(0.16) == [b"2\n", b"3\n", b"4\n"]


def test_most_robots_send_nothing_unsolicited() -> None:
    koala = emulator("koala")
    assert koala.unsolicited_due() == math.inf
    assert koala.run_for(3600.0) == []


def test_a_robot_that_is_always_due_is_an_error() -> None:
    class Stuck(Talker):
        def unsolicited_due(self) -> float:
            return 0.0

    with pytest.raises(RuntimeError, match="is still 0 after unsolicited"):
        Stuck().run_for(1.0)


def test_unsolicited_output_reaches_the_line_in_time() -> None:
    began = time.monotonic()
    with Port(Talker()) as port, serial.Serial(str(port.path), timeout=PATIENCE) as driver:
        assert [driver.read_until(b"\n") for _ in range(6)] == [b"%d\n" % number for number in range(1, 7)]
        assert time.monotonic() - began > 0.2


def test_a_slow_machine_slows_the_robot_down() -> None:
    """Else each look would take three times as long as the one before, and the port never come back."""

    class Heavy(Talker):
        def advance(self, dt: float) -> None:
            time.sleep(3 * dt)
            super().advance(dt)

    with Port(Heavy()) as port, serial.Serial(str(port.path), timeout=PATIENCE) as driver:
        for _ in range(20):
            assert driver.read_until(b"\n")
        port.snapshot()


def test_output_is_lost_while_the_port_is_closed() -> None:
    talker = Talker()
    with Port(talker) as port:
        with serial.Serial(str(port.path), timeout=PATIENCE) as driver:
            driver.read_until(b"\n")
        wait_for(lambda: talker.seen == ["opened", "closed"])
        time.sleep(3 * PERIOD)
        with serial.Serial(str(port.path), timeout=PATIENCE) as driver:
            assert int(driver.read_until(b"\n")) >= 4


def test_it_counts_on_without_a_cable() -> None:
    talker = Talker()
    port = Port(talker)
    port.plug()
    with serial.Serial(str(port.path), timeout=PATIENCE) as driver:
        driver.read_until(b"\n")
        port.unplug()
    time.sleep(3 * PERIOD)
    port.snapshot()
    assert talker.number >= 3
    assert talker.seen == ["opened", "closed"]


def test_it_notices_every_opening_of_the_port() -> None:
    talker = Talker()
    with Port(talker) as port:
        for number in range(1, 4):
            with serial.Serial(str(port.path), timeout=PATIENCE) as driver:
                driver.write(b"x")
                received = b""
                while b"received x" not in received:
                    received += driver.read(1)
            wait_for(lambda number=number: talker.seen == ["opened", "closed"] * number)


def test_faults_apply_to_unsolicited_output_except_error() -> None:
    with Port(Talker()) as port, serial.Serial(str(port.path), timeout=PATIENCE) as driver:
        driver.read_until(b"\n")
        port.faults = Faults(error=1.0, split=2, gap=0.001)
        assert driver.read_until(b"\n").strip().isdigit()
        port.faults = Faults(drop=1.0)
        time.sleep(2 * PERIOD)
        driver.reset_input_buffer()
        driver.timeout = 3 * PERIOD
        assert driver.read(1) == b""


def test_a_cable_may_vanish_during_a_snapshot() -> None:
    talker = Talker()
    threads, files = threading.active_count(), len(os.listdir("/proc/self/fd"))  # noqa: PTH208
    with Port(talker) as port:
        with serial.Serial(str(port.path), timeout=PATIENCE) as driver:
            driver.read_until(b"\n")
            port.faults = Faults(vanish=1.0)
            wait_for(lambda: not port.snapshot().plugged)
        port.faults = Faults()
        assert port.plug().exists()
    assert (threading.active_count(), len(os.listdir("/proc/self/fd"))) == (threads, files)  # noqa: PTH208
