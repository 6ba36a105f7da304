"""Robots that speak unasked and robots that notice their port: in exact time, and on a real pty."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable
from typing import ClassVar

import pytest
import serial

from swarmctl.lab.emulators import Robot, emulator
from swarmctl.lab.emulators.faults import Faults
from swarmctl.lab.emulators.motion import Chassis
from swarmctl.lab.emulators.port import Port

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
        return [b"heard " + data]

    def unasked_due(self) -> float:
        return self.next - self.chassis.time

    def unasked(self) -> list[bytes]:
        self.next += PERIOD
        self.number += 1
        return [b"%d\n" % self.number]

    def opened(self) -> None:
        self.seen.append("opened")
        self.next = self.chassis.time + PERIOD

    def closed(self) -> None:
        self.seen.append("closed")


def eventually(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + 5.0
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_a_robot_says_in_exact_time_what_it_has_to_say() -> None:
    talker = Talker()
    talker.opened()
    assert talker.live(0.049) == []
    assert talker.live(0.002) == [b"1\n"]
    assert talker.live(0.16) == [b"2\n", b"3\n", b"4\n"]


def test_most_robots_never_speak_unasked() -> None:
    koala = emulator("koala")
    assert koala.unasked_due() == math.inf
    assert koala.live(3600.0) == []


def test_a_robot_that_never_stops_being_due_is_found_out() -> None:
    class Stuck(Talker):
        def unasked_due(self) -> float:
            return 0.0

    with pytest.raises(RuntimeError, match="is still 0 after unasked"):
        Stuck().live(1.0)


def test_it_speaks_on_the_line_at_its_own_times() -> None:
    with Port(Talker()) as port, serial.Serial(str(port.path), timeout=2.0) as driver:
        began = time.monotonic()
        assert [driver.read_until(b"\n") for _ in range(6)] == [b"%d\n" % number for number in range(1, 7)]
        assert 0.2 < time.monotonic() - began < 2.0


def test_a_machine_too_slow_for_a_robot_slows_it_down() -> None:
    """Else each look would take longer than the one before, and the port never come back."""

    class Heavy(Talker):
        def advance(self, dt: float) -> None:
            time.sleep(3 * dt)
            super().advance(dt)

    with Port(Heavy()) as port, serial.Serial(str(port.path), timeout=2.0) as driver:
        for _ in range(20):
            assert driver.read_until(b"\n")
        began = time.monotonic()
        port.snapshot()
        assert time.monotonic() - began < 3.0


def test_what_it_says_is_lost_while_nobody_has_the_port_open() -> None:
    talker = Talker()
    with Port(talker) as port:
        with serial.Serial(str(port.path), timeout=2.0) as driver:
            driver.read_until(b"\n")
        eventually(lambda: talker.seen == ["opened", "closed"])
        time.sleep(3 * PERIOD)
        with serial.Serial(str(port.path), timeout=2.0) as driver:
            assert int(driver.read_until(b"\n")) >= 4


def test_it_goes_on_counting_without_a_cable() -> None:
    talker = Talker()
    port = Port(talker)
    port.plug()
    with serial.Serial(str(port.path), timeout=2.0) as driver:
        driver.read_until(b"\n")
        port.unplug()
    time.sleep(3 * PERIOD)
    port.snapshot()
    assert talker.number >= 3
    assert talker.seen == ["opened", "closed"]


def test_it_notices_each_opening_even_one_that_writes_at_once() -> None:
    talker = Talker()
    with Port(talker) as port:
        for number in range(1, 4):
            with serial.Serial(str(port.path), timeout=2.0) as driver:
                driver.write(b"x")
                heard = b""
                while b"heard x" not in heard:
                    heard += driver.read(1)
            eventually(lambda number=number: talker.seen == ["opened", "closed"] * number)


def test_faults_strike_what_is_said_unasked_but_no_error_does() -> None:
    with Port(Talker()) as port, serial.Serial(str(port.path), timeout=2.0) as driver:
        driver.read_until(b"\n")
        port.faults = Faults(error=1.0, split=2, gap=0.001)
        assert driver.read_until(b"\n").strip().isdigit()
        port.faults = Faults(drop=1.0)
        time.sleep(2 * PERIOD)
        driver.reset_input_buffer()
        driver.timeout = 3 * PERIOD
        assert driver.read(1) == b""


def test_a_cable_may_vanish_while_somebody_only_looks() -> None:
    talker = Talker()
    threads, files = threading.active_count(), len(os.listdir("/proc/self/fd"))  # noqa: PTH208
    with Port(talker) as port:
        with serial.Serial(str(port.path), timeout=2.0) as driver:
            driver.read_until(b"\n")
            port.faults = Faults(vanish=1.0)
            eventually(lambda: not port.snapshot().plugged)
        port.faults = Faults()
        assert port.plug().exists()
    assert (threading.active_count(), len(os.listdir("/proc/self/fd"))) == (threads, files)  # noqa: PTH208
