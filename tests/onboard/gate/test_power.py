"""A gate answers with the battery and the dock of a recent message of its driver, or with nothing."""

from __future__ import annotations

import math

import pytest
from swarm_onboard.command.battery_watch import BatteryLimits, BatteryWatch
from swarm_onboard.command.limits import STANDSTILL
from swarm_onboard.command.report import Level
from swarm_onboard.gate.gate import Gate
from swarm_onboard.gate.robot_state import PowerWatch

from tests.onboard.gate.test_gate import CONFIG, Bench

UNKNOWN, CHARGING, DISCHARGING, NOT_CHARGING, FULL = range(5)  # sensor_msgs/BatteryState


def watch(bench: Bench, docked: str = "") -> PowerWatch:
    """The watch of the gate of ``bench``."""
    charge = BatteryWatch(BatteryLimits(low=0.25, empty=0.1), bench.commands, lambda: bench.now)
    made = PowerWatch("/tb/battery_state", docked, charge, lambda: bench.now)
    bench.gate = Gate(CONFIG, bench.commands, bench, power=made, clock=lambda: bench.now)
    return made


def power(bench: Bench) -> tuple[object, object]:
    motion = bench.gate.motion()
    return motion["battery"], motion["docked"]


@pytest.mark.parametrize(
    ("percentage", "status", "battery", "docked"),
    [
        (0.8, CHARGING, 0.8, True),
        (1.0, FULL, 1.0, True),
        (0.8, DISCHARGING, 0.8, False),
        (0.8, NOT_CHARGING, 0.8, False),
        (0.8, UNKNOWN, 0.8, None),
        (math.nan, CHARGING, None, True),  # not measured
        (85.0, DISCHARGING, None, False),  # per cent, against the definition
    ],
)
def test_battery_and_dock_are_those_of_the_drivers_message(
    percentage: float, status: int, battery: float | None, docked: bool | None
) -> None:
    bench = Bench()
    watch(bench).take_battery(percentage, status)
    assert power(bench) == (battery, docked)


def test_a_topic_for_the_dock_counts_more_than_the_battery() -> None:
    bench = Bench()
    topics = watch(bench, "/tb/docked")
    topics.take_battery(0.5, CHARGING)
    assert power(bench) == (0.5, None)  # a cable on the desk
    topics.take_docked(True)
    assert power(bench) == (0.5, True)
    topics.take_docked(False)
    assert power(bench) == (0.5, False)


def test_what_is_old_or_of_a_driver_that_is_gone_is_not_known() -> None:
    bench = Bench()
    topics = watch(bench)
    assert power(bench) == (None, None)
    topics.take_battery(0.5, CHARGING)
    bench.now += 59
    assert power(bench) == (0.5, True)
    bench.now += 2
    assert power(bench) == (None, None)
    topics.take_battery(0.5, CHARGING)
    bench.connected = 0
    assert "docked" not in bench.gate.motion()


def test_an_empty_battery_means_zeros_until_it_is_no_longer_low() -> None:
    bench = Bench()
    topics = watch(bench)

    def driven(percentage: float) -> bool:
        """Whether commands are passed on once that was the battery's level for a while."""
        for _ in range(4):  # a driver that publishes its battery once in 5 s
            topics.take_battery(percentage, UNKNOWN)
            for _ in range(20):
                bench.command(0.1)
                bench.wait(0.25)
        return bench.sent[-1][1] != STANDSTILL

    assert driven(0.5)
    assert driven(0.2)
    assert (bench.reports[-1].level, bench.reports[-1].message) == (
        Level.WARN,
        "driving; battery low: 20%, low is 25%",
    )
    assert not driven(0.05)
    assert (bench.reports[-1].level, bench.reports[-1].message) == (
        Level.ERROR,
        "standing still; battery empty: 5%, takes no command until 25%",
    )
    assert bench.reports[-1].values["dead-man trips"] == "0", "it was commanded all the time"
    assert not driven(math.nan), "not known is no reason to drive"
    assert not driven(0.2)
    assert driven(0.3)
    assert driven(math.nan), "nor a reason to stand"


def test_one_odd_message_stops_no_robot() -> None:
    bench = Bench()
    topics = watch(bench)
    for percentage in (0.5, 0.0, 0.5, 0.0, 0.0, 0.5):
        topics.take_battery(percentage, UNKNOWN)
        bench.wait(10.0)
        bench.command(0.1)
        assert bench.sent[-1][1] != STANDSTILL
