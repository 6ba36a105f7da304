"""A line that loses some of what it carries is reported for as long as it does, not only as it happens."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from swarm_onboard.command.report import Level, Report
from swarm_onboard.driver.driver import Phase

from swarmctl.lab.emulators import VirtualPort, emulator
from swarmctl.lab.emulators.serial_faults import Faults
from tests.onboard.driver.board_bench import BoardBench
from tests.onboard.driver.board_bench import ready as ready_board
from tests.onboard.driver.fakes import Bench, Clock, FakeKoala, config_for
from tests.onboard.rosserial.fakes import LWHEEL

FAILED = "requests in the last minute failed"
DAMAGED = "frames in the last minute were damaged"


class LossyKoala(FakeKoala):
    """Loses every ``every``-th reply."""

    every = 0
    count = 0

    def write(self, data: bytes) -> None:
        before = self.waiting
        super().write(data)
        self.count += 1
        if self.every and self.count % self.every == 0:
            self.waiting = before


def lossy(every: int) -> Bench:
    bench = Bench(robot=LossyKoala)
    bench.run(1.0)
    bench.robot.every = every
    return bench


def reports(bench: Bench, seconds: float) -> list[Report]:
    """The reports of so many seconds."""
    before = len(bench.sink.reports)
    bench.run(seconds)
    return bench.sink.reports[before:]


def test_a_line_that_loses_replies_is_a_warning_in_every_report():
    bench = lossy(10)
    bench.run(10.0)
    found = reports(bench, 60.0)
    assert len(found) > 50
    assert {(one.level, FAILED in one.message) for one in found} == {(Level.WARN, True)}
    assert f"{FAILED} (last: no reply to `" in found[-1].message
    assert "no other program uses /dev/robot" in found[-1].message
    failed, _, total, *_ = found[-1].message.partition("; ")[2].split()
    assert int(failed) == pytest.approx(int(total) / 10, abs=2)


def test_the_warning_ends_a_minute_after_the_losses():
    bench = lossy(10)
    bench.run(20.0)
    bench.robot.every = 0
    found = reports(bench, 10.0)[-1]
    assert (found.level, FAILED in found.message) == (Level.WARN, True)
    assert reports(bench, 55.0)[-1].level is Level.OK


@pytest.mark.parametrize("failures", [1, 4])
def test_a_few_lost_replies_are_no_warning(failures):
    bench = lossy(0)
    found = []
    for _ in range(failures):
        bench.robot.silent_to = "H"
        found += reports(bench, 0.15)
        bench.robot.silent_to = ""
        found += reports(bench, 5.0)
    assert int(bench.sink.reports[-1].values["failed exchanges"]) == failures
    assert not any("failed" in one.message for one in found)


def test_a_line_that_loses_one_reply_in_a_hundred_is_no_warning():
    bench = lossy(100)
    assert not any("failed" in one.message for one in reports(bench, 90.0))
    assert int(bench.sink.reports[-1].values["failed exchanges"]) > 5


def test_a_robot_that_was_off_is_well_when_it_is_on():
    bench = Bench()
    bench.robot.silent_to = "D"
    bench.run(60.0)
    bench.robot.silent_to = ""
    bench.run(6.0)
    assert int(bench.sink.reports[-1].values["failed exchanges"]) > 5
    assert {one.level for one in reports(bench, 30.0)} == {Level.OK}


def unplug(bench: Bench) -> None:
    bench.robot.plugged = False
    bench.run(0.5)
    bench.robot.plugged = True


@pytest.mark.parametrize("new", [Bench, ready_board], ids=["koala", "board"])
def test_a_connection_that_is_lost_again_and_again_is_a_warning(new: Callable[[], Bench]):
    bench = new()
    for _ in range(2):
        bench.run(20.0)
        unplug(bench)
    bench.run(20.0)
    assert bench.sink.reports[-1].level is Level.OK
    unplug(bench)
    bench.run(20.0)
    assert bench.driver.phase is Phase.READY
    report = bench.sink.reports[-1]
    assert report.level is Level.WARN
    assert "connection was lost 3 times in the last 10 minutes (last: /dev/robot is gone)" in report.message
    for _ in range(12):
        bench.run(50.0)
    assert bench.sink.reports[-1].level is Level.OK


def test_a_board_that_falls_silent_again_and_again_is_a_warning():
    bench = ready_board()
    for _ in range(3):
        bench.robot.silent = True
        bench.run(17.0)
        bench.robot.silent = False
        bench.run(10.0)
    assert bench.driver.phase is Phase.READY
    assert "lost 3 times in the last 10 minutes (last: no sync with the board" in bench.report.message


def damaged(bench: BoardBench, frames: int) -> None:
    for _ in range(frames):
        bench.robot.send(LWHEEL[:-1] + bytes([LWHEEL[-1] ^ 1]))
        bench.run(0.2)


def test_a_board_whose_frames_are_damaged_is_a_warning():
    bench = ready_board()
    damaged(bench, 4)
    bench.run(3.0)
    assert bench.report.level is Level.OK
    damaged(bench, 4)
    bench.run(10.0)
    assert bench.report.level is Level.WARN
    assert "; 8 of " in bench.report.message
    assert f"{DAMAGED}: check the cable or radio" in bench.report.message


class Emulated:
    """An emulated robot as its own port: what its line does in virtual time, on the clock of the driver."""

    def __init__(self, clock: Clock, name: str) -> None:
        self._clock = clock
        self._began = clock.now
        self._waiting = b""
        self.port = VirtualPort(emulator(name))

    def open(self) -> Emulated:
        return self

    def write(self, data: bytes) -> None:
        self._catch_up()
        self.port.write(data)

    def read(self, timeout: float) -> bytes:
        self._catch_up()
        end = self._clock.now + timeout
        while not self._waiting and self._clock.now < end:
            self._clock.now = min(end, self._clock.now + 0.005)
            self._catch_up()
        data, self._waiting = self._waiting, b""
        return data

    def drain(self) -> None:
        self._catch_up()
        self._waiting = b""

    def fileno(self) -> int:
        raise AssertionError("nobody waits for a port in virtual time")

    def close(self) -> None:
        """Nothing to let go of."""

    def _catch_up(self) -> None:
        self._waiting += self.port.advance(max(0.0, self._clock.now - self._began - self.port.time))


@pytest.mark.parametrize(
    ("name", "fault", "message"),
    [
        ("koala", "drop=0.2", FAILED),
        ("khepera3", "truncate=0.2", FAILED),
        ("epuck-binary", "drop=0.2", FAILED),
        ("arduino-rover", "bad_checksum=0.2", DAMAGED),
    ],
)
def test_an_emulated_robot_whose_line_loses_a_fifth_is_a_warning(name: str, fault: str, message: str):
    bench = Bench(config_for(name), robot=lambda clock: Emulated(clock, name.replace("-binary", "")))
    for faults in ("", fault):
        bench.robot.port.faults = Faults.parse(faults.split())
        before = len(bench.sink.reports)
        for _ in range(4000):
            bench.run(0.01)
        ready = [one for one in bench.sink.reports[before:] if one.values["state"] == "ready"][-10:]
        assert ready
        assert {(one.level, message in one.message) for one in ready} == (
            {(Level.WARN, True)} if faults else {(Level.OK, False)}
        )
