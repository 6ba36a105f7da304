"""A driver reports a battery that is low, and lets the robot stand while it is empty."""

from __future__ import annotations

from swarm_onboard.command.report import Level

from tests.onboard.driver.fakes import Bench, config_for

LIMITS = {"low": 0.25, "empty": 0.1}
VOLTS = 50  # of the fake's steps of 20 mV; a Koala's battery is empty at 11 V and full at 13 V


def charge(bench: Bench, share: float) -> None:
    bench.robot.battery = round((11 + 2 * share) * VOLTS)


def driving(rate: float = 1.0) -> Bench:
    """A robot with limits that drives, with half of its battery, which is read at ``rate`` Hz."""
    bench = Bench(config_for("koala", battery=LIMITS, rates={"battery": rate}))
    drive(bench, 3)
    assert bench.robot.speed != (0, 0)
    return bench


def drive(bench: Bench, seconds: float) -> None:
    for _ in range(round(5 * seconds)):
        bench.command(0.1)
        bench.run(0.2)


def drained() -> Bench:
    """A robot that stands, since its battery is empty."""
    bench = driving()
    charge(bench, 0.08)
    drive(bench, 10)
    assert bench.robot.speed == (0, 0)
    return bench


def test_a_battery_that_is_nearly_empty_is_a_warning() -> None:
    bench = Bench()
    bench.run(3.0)
    assert bench.sink.reports[-1].level is Level.OK
    charge(bench, 0.1)
    bench.run(3.0)
    report = bench.sink.reports[-1]
    assert report.level is Level.WARN
    assert report.message.endswith("; battery low: 10%, low is 15%")


def test_a_robot_without_limits_drives_until_its_battery_is_gone() -> None:
    bench = Bench()
    charge(bench, 0.0)
    drive(bench, 20)
    assert bench.robot.speed != (0, 0)


def test_a_robot_with_a_low_battery_drives_on() -> None:
    bench = driving()
    charge(bench, 0.18)
    drive(bench, 20)
    assert bench.robot.speed != (0, 0)
    report = bench.sink.reports[-1]
    assert (report.level, report.message) == (Level.WARN, "driving; battery low: 18%, low is 25%")


def test_a_robot_with_an_empty_battery_stands_and_says_until_when() -> None:
    bench = drained()
    report = bench.sink.reports[-1]
    assert report.level is Level.ERROR
    assert report.message == "standing still; battery empty: 8%, takes no command until 25%"
    assert report.values["dead-man trips"] == "0", "it was commanded all the time"


def test_a_battery_that_recovers_at_rest_does_not_let_it_drive() -> None:
    bench = drained()
    charge(bench, 0.24)
    drive(bench, 20)
    assert bench.robot.speed == (0, 0)
    charge(bench, 0.26)
    drive(bench, 10)
    assert bench.robot.speed != (0, 0)
    assert bench.sink.reports[-1].level is Level.OK


def test_a_voltage_that_falls_for_a_moment_stops_no_robot() -> None:
    bench = driving(rate=10.0)
    for _ in range(10):
        charge(bench, 0.05)
        drive(bench, 2)
        assert bench.robot.speed != (0, 0)
        charge(bench, 0.5)
        drive(bench, 2)


def test_one_high_reading_does_not_let_it_drive() -> None:
    bench = drained()
    for _ in range(10):
        charge(bench, 0.9)
        drive(bench, 2)
        charge(bench, 0.05)
        drive(bench, 2)
        assert bench.robot.speed == (0, 0)


def test_a_battery_that_is_not_read_any_more_changes_nothing() -> None:
    for bench, drives in ((driving(), True), (drained(), False)):
        bench.robot.refuses = "M"
        drive(bench, 30)
        assert (bench.robot.speed != (0, 0)) is drives


def test_a_robot_plugged_in_again_stands_until_it_is_charged() -> None:
    bench = drained()
    bench.robot.plugged = False
    bench.run(10)
    bench.robot.plugged = True
    drive(bench, 10)
    assert bench.robot.speed == (0, 0)
    charge(bench, 1.0)
    drive(bench, 10)
    assert bench.robot.speed != (0, 0)
