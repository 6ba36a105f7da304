"""A unit whose program takes a change while it runs reloads; all others restart."""

from __future__ import annotations

from dataclasses import replace

import pytest
from swarm_onboard.agent.steps import Kind

from swarmctl.plan.plan import Plan
from swarmctl.plan.reconcile import reconcile
from swarmctl.plan.robots_in_use import stops_of
from swarmctl.render.bundle import Bundle
from swarmctl.views.plan import summary
from tests.onboard.agent.fakehost import RUNS
from tests.plan.test_reconcile import bundle, lines, running

FAILED = RUNS._replace(active="failed")


def with_live_value(fixed: str = "f1", **contents: str) -> Bundle:
    """As ``bundle``, and `a.service` takes ``params/a.yaml`` while it runs, but for ``fixed``."""
    plain = bundle(**contents)
    taken = replace(plain.files[0], fixed=fixed.encode())
    return replace(plain, files=(taken, *plain.files[1:]))


@pytest.mark.parametrize(
    ("before", "after", "seen", "kind"),
    [
        (with_live_value(), with_live_value(a="a2"), {}, Kind.RELOAD_UNIT),
        (with_live_value(), with_live_value(a="a2", fixed="f2"), {}, Kind.RESTART),
        (with_live_value(), with_live_value(a="a2", env="e2"), {}, Kind.RESTART),
        (bundle(), with_live_value(a="a2"), {}, Kind.RESTART),
        (with_live_value(), bundle(a="a2"), {}, Kind.RESTART),
        (with_live_value(), with_live_value(a="a2"), {"drift": {"env/ros.env": "changed"}}, Kind.RESTART),
        (with_live_value(), with_live_value(a="a2"), {"units": {"a.service": FAILED}}, Kind.RESTART),
    ],
    ids=["live value", "fixed value", "another file", "old manifest", "old version", "drift", "failed"],
)
def test_a_unit_reloads_if_it_takes_the_change_while_it_runs(
    before: Bundle, after: Bundle, seen: dict[str, object], kind: Kind
) -> None:
    plan = reconcile(after, running(before, **seen))
    both = plan.targets(Kind.RELOAD_UNIT), plan.targets(Kind.RESTART)
    reloaded, restarted = both if kind == Kind.RELOAD_UNIT else reversed(both)
    assert "a.service" in reloaded
    assert "a.service" not in restarted
    assert not plan.files_only


def test_a_reload_of_a_unit_has_its_cause() -> None:
    plan = reconcile(with_live_value(a="a2"), running(with_live_value()))
    assert lines(plan)[2:] == [
        "reload-unit a.service: params/a.yaml changes, and it takes that while it runs"
    ]
    assert stops_of(plan) == ()
    assert "1 reload" in summary(Plan("s", (plan,))).plain
