"""Before a vendor's driver without a dead-man: whatever ends the commands, or the gate, the robot stands."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image, processes
from tests.onboard.gate.faults import CROWD
from tests.onboard.gate.ros_host import run_isolated

HERE = Path(__file__).parent
OWN_TIMEOUT = 0.5  # s, the gate's command_timeout


@pytest.fixture(scope="module")
def figures() -> Any:
    """What `faults.py` prints, if this machine can have the lab's image."""
    try:
        processes.require("unshare", "ip", "mount", "mmdebstrap")
    except LabError as error:
        pytest.skip(f"no lab here: {error}")
    return run_isolated(HERE / "faults.py", image.ensure(lambda _line: None))


@pytest.mark.lab
@pytest.mark.parametrize(
    ("fault", "bar"),
    [
        ("publisher_killed", OWN_TIMEOUT + 0.4),
        ("flooded", OWN_TIMEOUT + 0.4),
        ("commander_stopped", OWN_TIMEOUT + 0.4),
        ("not_a_number", 0.4),
        ("terminated", 0.5),
        ("killed", 1.0),
        ("killed_and_restarted", 1.5),
        ("crowded", OWN_TIMEOUT + 0.4),
        ("shut_down", OWN_TIMEOUT + 0.4),
        ("replaced", OWN_TIMEOUT + 0.4),
        ("master_killed", OWN_TIMEOUT + 0.4),
    ],
)
def test_the_robot_stands_soon_after(fault, bar, figures, promise):
    took = figures[fault]["stands"]
    assert math.isfinite(took), "it moves again"
    promise(f"gate: {fault.replace('_', ' ')}, until the robot stands", took - figures[fault]["lost"], bar)


@pytest.mark.lab
def test_strangers_move_nothing_and_are_reported(figures):
    found = figures["stranger"]
    assert (found["moved"], found["level"]) == (0, 1)
    assert "refuses /stranger on 127.0.0.1: not among its commanders boss" in found["message"]


@pytest.mark.lab
def test_commands_that_are_no_numbers_are_counted_and_stop(figures):
    assert figures["not_a_number"]["refused"] > 0
    assert figures["not_a_number"]["moved"] == 0


@pytest.mark.lab
def test_the_driver_receives_no_more_than_the_robots_fastest(figures):
    assert figures["too_fast"]["fastest"] == pytest.approx(0.22)


@pytest.mark.lab
def test_floods_move_nothing_that_they_may_not(figures):
    assert figures["flooded"]["fastest"] == pytest.approx(0.1)


@pytest.mark.lab
def test_a_driver_that_comes_back_late_gets_a_zero_first(figures):
    assert figures["driver_restarted"]["first"] == [0.0] * 6


@pytest.mark.lab
def test_a_restarted_gate_ignores_what_was_latched_before(figures):
    assert figures["latched"]["moved"] == 0


@pytest.mark.lab
def test_who_passes_beside_the_gate_is_an_error_with_its_name(figures):
    assert figures["bypass"]["rival"] == 2
    assert "/tb/vendor/driver takes commands past the gate" in figures["bypass"]["past"]


@pytest.mark.lab
def test_systemd_restarts_the_gate_unless_it_was_stopped(figures):
    statuses = {name: figures[name]["status"] for name in ("terminated", "master_killed")}
    assert statuses == {"terminated": 0, "master_killed": 91}


@pytest.mark.lab
@pytest.mark.parametrize("fault", ["crowded", "shut_down", "replaced"])
def test_nobody_else_ends_the_gate(fault, figures):
    assert figures[fault]["ended"] is None


@pytest.mark.lab
def test_a_crowd_gets_few_of_the_files_of_a_gate(figures):
    assert figures["crowded"]["files"] < CROWD / 4


@pytest.mark.lab
def test_a_gate_whose_name_was_taken_is_registered_as_before(figures):
    assert figures["replaced"]["after"] == figures["replaced"]["before"]
