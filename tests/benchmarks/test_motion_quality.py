"""Robots drive as commanded: the page is up to date, and each of its bars can be missed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import motion
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from motion_quality import papers, paths, robots, verdict
from motion_quality.paths import Leg, Manoeuvre, Place, Twist
from motion_quality.robots import Entrant
from motion_quality.trial import Ride, place_of
from motion_quality.verdict import Row
from swarm_onboard.driver import rosserial_robot, session
from swarm_onboard.driver.config import Kinematics, Scale

from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.spec.catalog import load_catalog

ENTRANTS = {one.name: one for one in robots.entrants()}
ROVER = "arduino-rover"  # its sketch computes wheel speeds from commands, and its wheels count coarsely
every_robot = pytest.mark.parametrize("name", ENTRANTS)
every_polled_robot = pytest.mark.parametrize("name", [name for name in ENTRANTS if name != ROVER])


def rows_of(entrant: Entrant) -> dict[str, Row]:
    return {one.name: verdict.row(entrant, one) for one in paths.manoeuvres(entrant.wheels)}


def missed(entrant: Entrant) -> set[str]:
    return {miss for row in rows_of(entrant).values() for miss in row.misses}


def test_the_page_is_up_to_date_and_no_robot_is_beyond_a_bar(
    root: Path, tmp_path: Path, golden: Callable[[Path, str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    written = tmp_path / "page.md"
    assert motion.main(["--page", str(written)]) == 0, capsys.readouterr().out
    golden(root / "docs/motion-quality.md", written.read_text("utf-8"))


def test_each_type_drives_or_is_left_out_by_name() -> None:
    driving = {name.split(",")[0] for name in ENTRANTS}
    assert driving | robots.left_out().keys() == with_protocol(load_catalog().types).keys()
    assert not driving & robots.left_out().keys()
    assert papers.FORMULAS.keys() <= driving


def test_the_readme_states_what_is_measured(root: Path) -> None:
    koala = rows_of(ENTRANTS["koala"])["straight, 1 m"]
    page = (root / "README.md").read_text("utf-8")
    assert (
        "A Koala that is commanded to drive a metre drives one. By the wheel formula that the paper" in page
    )
    assert "it [drives 10 cm](docs/motion-quality.md" in page
    assert koala.driven.end < 0.01
    assert koala.paper is not None
    assert koala.paper.driven == pytest.approx(0.10, abs=0.005)


# Each bar can be missed: what follows breaks the driver, not the emulator.


def kinematics_with(entrant: Entrant, **changed: float) -> Entrant:
    kinematics = replace(entrant.config.kinematics, **changed)
    return replace(entrant, config=replace(entrant.config, kinematics=kinematics))


def scales_with(entrant: Entrant, **factors: float) -> Entrant:
    scales = tuple(
        replace(one, **{name: factor * getattr(one, name) for name, factor in factors.items()})
        for one in entrant.config.kinematics.scales
    )
    return kinematics_with(entrant, scales=scales)


@every_robot
def test_a_wheel_separation_two_percent_wrong_is_beyond_the_bar(name: str) -> None:
    entrant = ENTRANTS[name]
    wrong = kinematics_with(entrant, wheel_separation=1.02 * entrant.wheels.separation)
    assert "the heading" in missed(wrong)


@every_polled_robot
def test_speeds_three_percent_wrong_are_beyond_the_bar(name: str) -> None:
    assert "the end" in missed(scales_with(ENTRANTS[name], speed_units_per_mps=1.03))


@every_polled_robot
def test_counters_two_percent_wrong_are_beyond_the_bar(name: str) -> None:
    assert {"the end in odometry", "the heading in odometry"} <= missed(
        scales_with(ENTRANTS[name], metres_per_count=1.02)
    )


def test_a_rover_with_wheels_a_fifth_larger_is_beyond_the_bar() -> None:
    entrant = ENTRANTS[ROVER]
    protocol = entrant.config.protocol
    smaller = replace(protocol, ticks=replace(protocol.ticks, wheel_radius=protocol.ticks.wheel_radius / 1.2))
    wrong = replace(entrant, config=replace(entrant.config, protocol=smaller))
    assert {"the end in odometry", "the heading in odometry"} <= missed(wrong)


@every_robot
def test_wheels_clamped_each_by_itself_are_beyond_the_bar(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def wheels(linear: float, angular: float, kinematics: Kinematics) -> list[float]:
        half, most = angular * kinematics.wheel_separation / 2, kinematics.wheel_speed_max
        return [max(-most, min(most, speed)) for speed in (linear - half, linear + half)]

    def units(linear: float, angular: float, kinematics: Kinematics, scale: Scale) -> tuple[int, int]:
        left, right = wheels(linear, angular, kinematics)
        return round(left * scale.speed_units_per_mps), round(right * scale.speed_units_per_mps)

    def twist(linear: float, angular: float, kinematics: Kinematics) -> tuple[float, float]:
        left, right = wheels(linear, angular, kinematics)
        return (left + right) / 2, (right - left) / kinematics.wheel_separation

    monkeypatch.setattr(session, "wheel_units", units)
    monkeypatch.setattr(rosserial_robot, "within_limits", twist)
    rows = rows_of(ENTRANTS[name])
    assert "the curvature" in rows["half circle, outer wheel too fast"].misses
    assert rows["half circle to the left"].misses == []


def test_a_robot_beyond_a_bar_fails_the_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = scales_with(ENTRANTS["koala"], speed_units_per_mps=0.9)
    monkeypatch.setattr(robots, "entrants", lambda: [wrong])
    assert motion.main([]) == 1
    assert "BEYOND ITS BAR: koala, straight, 1 m: the end" in capsys.readouterr().out


# What holds for any command.

share = st.floats(-4, 4)


@every_robot
def test_the_curve_driven_is_the_curve_commanded(name: str) -> None:
    """Through the driver and the line, whatever the command: no farther off than rounding explains."""
    entrant = ENTRANTS[name]
    wheels, robot = entrant.wheels, entrant.make()
    ride = Ride(entrant.config, robot)

    @settings(max_examples=150)
    @given(share, share)
    def drives(linear: float, angular: float) -> None:
        command = Twist(linear * wheels.fastest, angular * 2 * wheels.fastest / wheels.separation)
        rounding = paths.bend(command, wheels) if command.linear else math.inf
        assume(rounding < math.inf)
        before = place_of(robot)
        ride.drive(Manoeuvre("", (Leg(command, 0.3),)))
        after = place_of(robot)
        way = math.copysign(after.driven - before.driven, command.linear)
        assert (after.heading - before.heading) / way == pytest.approx(
            command.curvature, abs=rounding + verdict.BEND * abs(command.curvature) + 1e-6
        )

    drives()


@every_robot
def test_each_wheel_turns_as_ordered_within_its_units(name: str) -> None:
    """Also on the spot, where a curve says nothing."""
    entrant = ENTRANTS[name]
    wheels, robot = entrant.wheels, entrant.make()
    ride = Ride(entrant.config, robot)

    @settings(max_examples=100)
    @given(share, share)
    def turn(linear: float, angular: float) -> None:
        command = Twist(linear * wheels.fastest, angular * 2 * wheels.fastest / wheels.separation)
        wanted = wheels.speeds(wheels.limited(command))
        ride.hold(command)
        slack = [
            max(wheels.unit, wheels.slowest if abs(speed) < wheels.slowest else 0.0) / 2 for speed in wanted
        ]
        for got, speed, most in zip((robot.state.left, robot.state.right), wanted, slack, strict=True):
            assert abs(got - speed) <= most + verdict.BEND * abs(speed) + 1e-9

    turn()


def test_an_arc_is_integrated_exactly() -> None:
    quarter = paths.after(Place(), Twist(math.pi / 2, math.pi / 2), 1.0)
    assert (quarter.x, quarter.y, quarter.heading) == pytest.approx((1.0, 1.0, math.pi / 2))
    small = Place()
    for _ in range(1000):
        small = paths.after(small, Twist(math.pi / 2, math.pi / 2), 0.001)
    assert quarter.away(small) < 1e-9


@pytest.mark.parametrize(
    ("formula", "twist", "request_line"),
    [
        ("koala", Twist(0.2, 0.0), b"D,4,4\n"),
        ("koala", Twist(0.1, 0.5), b"D,-40,45\n"),
        ("koala", Twist(0.0, 4.0), b"D,-100,100\n"),
        ("khepera3", Twist(0.1, 0.0), b"D,l731,l731\n"),
        ("khepera3", Twist(0.0, 1.0), b"D,l-7317,l7317\n"),
        ("khepera3", Twist(0.0, 6.0), b"D,l-35000,l100\n"),
        ("epuck", Twist(0.0, 1.0), b"D,-71,71\n"),
    ],
)
def test_a_paper_s_formula_sends_what_its_code_sends(formula: str, twist: Twist, request_line: bytes) -> None:
    assert papers.FORMULAS[formula].request(twist) == request_line
