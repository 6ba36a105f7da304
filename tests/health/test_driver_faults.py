"""Faults of drivers: their units, their registration, their answers."""

from __future__ import annotations

import pytest
from swarm_onboard.agent.observations import Report

from tests.health.faults import UNIT_K3, Fault, check
from tests.health.swarm_values import K3_PI, UNIT, both, changed, with_node, with_unit

DEAD = {"active": "inactive", "sub": "dead", "pid": 0}

FAULTS = {
    "environment that a drop-in overrides": Fault(
        K3_PI,
        both(
            changed(environments={UNIT["k3"]: ("ROS_MASTER_URI is http://10.9.9.9:11311 instead of X",)}),
            with_node("k3", registered=False, alive=False),
        ),
        {"environment k3": ("bad", ["driver k3"])},
        message="ROS_MASTER_URI is http://10.9.9.9:11311 instead of X",
    ),
    "driver that warns": Fault(
        K3_PI,
        with_node("k3", report=Report(1, "7 of 120 requests in the last minute failed")),
        {"report k3": ("warning", [])},
        healthy=True,
        message="7 of 120 requests in the last minute failed",
    ),
    "crash loop": Fault(
        K3_PI,
        both(
            with_unit(UNIT["k3"], active="activating", sub="auto-restart", restarts=7, result="exit-code"),
            with_node("k3", registered=False, alive=None),
        ),
        {UNIT_K3: ("bad", ["driver k3"])},
        message="crash loop: restarted 7 times, last result exit-code",
    ),
    "restarted while being looked at": Fault(
        K3_PI,
        with_unit(UNIT["k3"], restarts=1, restarted=1),
        {UNIT_K3: ("bad", [])},
        message="ended and is started again,",
    ),
    "restarted often before": Fault(
        K3_PI, with_unit(UNIT["k3"], restarts=3), {UNIT_K3: ("warning", [])}, healthy=True
    ),
    "failed driver with a stale registration": Fault(
        K3_PI,
        both(
            with_unit(UNIT["k3"], active="failed", sub="failed", result="watchdog", pid=0),
            with_node("k3", alive=False, error="connection refused"),
        ),
        {UNIT_K3: ("bad", ["driver k3"])},
        message="failed: watchdog",
    ),
    "stopped driver": Fault(
        K3_PI,
        both(with_unit(UNIT["k3"], **DEAD), with_node("k3", registered=False, alive=None)),
        {UNIT_K3: ("bad", ["driver k3"])},
        message="does not run (inactive)",
    ),
    "driver that is starting": Fault(
        K3_PI,
        with_unit(UNIT["k3"], active="activating", sub="start"),
        {UNIT_K3: ("warning", [])},
        healthy=True,
    ),
    "hanging driver": Fault(
        K3_PI,
        with_node("k3", alive=False, error="no answer within 2 s"),
        {"driver k3": ("bad", [])},
        message="is registered and its unit runs, but it does not answer",
    ),
    "driver that a new master does not know": Fault(
        K3_PI,
        with_node("k3", registered=False, alive=None),
        {"driver k3": ("bad", [])},
        message="although its unit runs; the master may have been restarted",
    ),
    "driver that ended and is starting again": Fault(
        K3_PI,
        both(
            with_unit(UNIT["k3"], restarts=1, recent=1, exit="exit code 1"),
            with_node("k3", registered=False, alive=None),
        ),
        {"driver k3": ("bad", [])},
        message="its unit was restarted 1 time, last result exit code 1",
    ),
    "driver that advertises localhost": Fault(
        K3_PI,
        with_node("k3", uri="http://localhost:40001/"),
        {"driver k3": ("bad", [])},
        message="advertises localhost instead of 192.168.77.11",
    ),
    "deaf driver": Fault(
        K3_PI,
        with_node("k3", subscribes={}),
        {"driver k3": ("bad", [])},
        message="does not subscribe to /k3/cmd_vel",
    ),
    "second driver of the same name": Fault(
        K3_PI,
        with_node("k3", pid=43),
        {"driver k3": ("warning", [])},
        healthy=True,
        message="a second driver",
    ),
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS.keys())
def test_a_fault_is_reported_with_its_symptoms(fault: Fault) -> None:
    check(fault)
