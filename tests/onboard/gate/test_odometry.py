"""A robot behind a gate stands by the odometry of its driver, or is named as moving."""

from __future__ import annotations

import math
from typing import Any

import pytest
from swarm_onboard.gate.robot_state import OdometryWatch, Reading

RATE = 20.0  # Hz


class Vendor:
    """A driver that publishes odometry, and somebody who asks the gate in front of it."""

    def __init__(self) -> None:
        self.now = 100.0
        self.x = 0.0
        self.watch = OdometryWatch("/tb/odom", lambda: self.now)

    def ask(self, zero_since: float | None) -> dict[str, Any]:
        self.watch.ask()
        return dict(self.watch.motion(zero_since))

    def drives(self, seconds: float, speed: float, *, turn: float = 0.0, shown: float | None = None) -> None:
        """Drives at ``speed``; its twist has that, or what is ``shown``."""
        for _ in range(round(seconds * RATE)):
            self.now += 1 / RATE
            self.x += speed / RATE
            twist = abs(speed if shown is None else shown)
            self.watch.take(Reading(self.x, 0.0, 0.0, 0.0, twist, turn, self.now))


@pytest.fixture
def vendor() -> Vendor:
    return Vendor()


def test_it_stands_once_readings_after_the_zero_show_it(vendor: Vendor) -> None:
    assert vendor.ask(100.0)["pending"]
    vendor.drives(0.5, 0.2)
    halt = vendor.now
    for _ in range(5):
        vendor.drives(1 / RATE, 0.0)
        assert vendor.ask(100.0)["still_since"] is None
    vendor.drives(0.3, 0.0)
    found = vendor.ask(100.0)
    assert (found["measured"], found["by"], found["pending"]) == (True, "odometry", False)
    assert halt <= found["still_since"] <= halt + 0.1


@pytest.mark.parametrize(
    "motion",
    [
        {"speed": 0.2},
        {"speed": 0.2, "shown": 0.0},  # its twist is what it was commanded, its pose is what it did
        {"speed": 0.0, "shown": 0.2},
        {"speed": 0.0, "turn": -0.5},
        {"speed": 0.03},
    ],
)
def test_a_robot_that_drives_on_despite_zeros_is_moving(vendor: Vendor, motion: Any) -> None:
    vendor.ask(100.0)
    for _ in range(20):
        vendor.drives(0.1, **motion)
        assert vendor.ask(100.0)["still_since"] is None
    found = vendor.ask(100.0)
    assert (found["measured"], found["pending"]) == (True, False)
    assert found["trouble"].startswith("it moves by its odometry, which has ")


def test_a_robot_that_drives_as_commanded_or_brakes_has_no_trouble(vendor: Vendor) -> None:
    vendor.ask(None)
    vendor.drives(2.0, 0.2)
    found = vendor.ask(None)
    assert (found["measured"], found["driven"], found.get("trouble")) == (True, [0.2, 0.0], None)
    zero = vendor.now
    vendor.drives(0.5, 0.1)
    found = vendor.ask(zero)
    assert (found["pending"], found.get("trouble")) == (True, None)
    vendor.drives(1.0, 0.1)
    assert vendor.ask(zero)["trouble"].startswith("it moves by its odometry")


def test_a_robot_that_turns_its_wheels_again_stands_no_more(vendor: Vendor) -> None:
    vendor.ask(100.0)
    vendor.drives(1.0, 0.0)
    assert vendor.ask(100.0)["still_since"] is not None
    vendor.drives(1.0, 0.0, shown=0.2)
    assert vendor.ask(100.0)["still_since"] is None


def test_readings_before_the_zero_prove_nothing(vendor: Vendor) -> None:
    vendor.ask(None)
    vendor.drives(1.0, 0.0)
    assert vendor.ask(None)["still_since"] is None
    assert vendor.ask(vendor.now)["still_since"] is None
    vendor.drives(0.25, 0.0)
    assert vendor.ask(101.0)["still_since"] is None
    vendor.drives(0.2, 0.0)
    assert vendor.ask(101.0)["still_since"] is not None


def test_odometry_that_does_not_arrive_or_ends_proves_nothing(vendor: Vendor) -> None:
    assert vendor.ask(100.0)["pending"]
    vendor.now += 1.6
    found = vendor.ask(100.0)
    assert not found["pending"]
    assert not found["measured"]
    assert found["trouble"] == "no odometry arrives on /tb/odom"
    vendor.drives(1.0, 0.0)
    assert vendor.ask(100.0)["still_since"] is not None
    vendor.now += 1.1
    assert vendor.ask(100.0)["still_since"] is None


def test_it_is_read_only_for_a_while_after_a_question(vendor: Vendor) -> None:
    assert not vendor.watch.wanted()
    vendor.ask(None)
    assert vendor.watch.wanted()
    vendor.drives(1.0, 0.0)
    vendor.now += 5.0
    assert not vendor.watch.wanted()
    vendor.drives(0.5, 0.0)  # the subscription ends a little later
    assert vendor.ask(100.0)["pending"]  # and what it brought does not count


def test_a_pose_that_jumps_by_a_turn_is_no_turn() -> None:
    near = Reading(0.0, 0.0, 0.0, math.pi - 0.001, 0.0, 0.0, 1.0)
    assert near.near(Reading(0.0, 0.0, 0.0, -math.pi + 0.001, 0.0, 0.0, 2.0))
