"""A plan that would touch a robot in use has that as its problem."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from swarm_onboard.agent.steps import Kind, Step

from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import HostPlan
from swarmctl.plan.robots_in_use import not_busy
from swarmctl.render.bundle import Unit
from tests.onboard.agent.fakehost import bundle

BUNDLE = replace(bundle("1"), units=(Unit("k3.service", (), robot="k3"), Unit("master.service", ())))
GONE: Any = {"units": [{"name": "old.service", "needs": [], "robot": "old", "digest": "d"}], "files": {}}
BUSY = Observed(
    "a", GONE, busy={"k3": "is commanded by joy", "old": "is not confirmed to stand by its wheels"}
)


@pytest.mark.parametrize(
    ("steps", "problem"),
    [
        ([(Kind.RESTART, "k3.service")], "k3 is commanded by joy"),
        ([(Kind.STOP, "old.service")], "old is not confirmed to stand by its wheels"),
        (
            [(Kind.STOP, "old.service"), (Kind.RESTART, "k3.service")],
            "k3 is commanded by joy; old is not confirmed to stand by its wheels",
        ),
        ([(Kind.RESTART, "master.service")], None),
        ([(Kind.START, "k3.service"), (Kind.UPDATE, "params/k3.yaml")], None),
    ],
)
def test_only_robots_whose_units_stop_count(steps: list[tuple[Kind, str]], problem: str | None) -> None:
    plan = HostPlan("pi", "a", "b", tuple(Step(kind, target, "") for kind, target in steps))
    found = not_busy(plan, BUNDLE, BUSY).problem
    assert (found.message if found else None) == problem
    assert not_busy(plan, BUNDLE, Observed("a", GONE)).problem is None
