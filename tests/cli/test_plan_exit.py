"""The exit code of ``swarmctl plan``: whose absence counts."""

from __future__ import annotations

import pytest
from swarm_onboard.agent.steps import Kind, Step

from swarmctl.cli import exit_codes
from swarmctl.plan.plan import HostPlan, Plan, Problem

AWAY = HostPlan("pi", None, "b", problem=Problem("unreachable", "connect timed out"))
UNFIT = HostPlan("pi", None, "b", problem=Problem("unfit", "it lacks rospy"))
SAME = HostPlan("laptop", "a", "a")
OTHER = HostPlan("laptop", "a", "b", steps=(Step(Kind.CREATE, "env/ros.env", "new"),))


@pytest.mark.parametrize(
    ("hosts", "optional", "code"),
    [
        ((SAME, AWAY), {"pi"}, exit_codes.OK),
        ((SAME, AWAY), set(), exit_codes.HOSTS_UNREACHABLE),
        ((SAME, UNFIT), {"pi"}, exit_codes.HOSTS_FAILED),
        ((OTHER, AWAY), {"pi"}, exit_codes.CHANGES),
    ],
)
def test_an_optional_host_may_be_away_but_not_unfit(
    hosts: tuple[HostPlan, ...], optional: set[str], code: int
) -> None:
    assert exit_codes.of_plan(Plan("s", hosts), optional, detailed=True) == code
