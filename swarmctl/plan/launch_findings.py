"""What rules found in the launch files of a host, as its problem and notes. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from swarmctl.diagnostics import Diagnostic, Severity
from swarmctl.plan.plan import HostPlan, Problem
from swarmctl.plan.preflight import UNFIT

NOT_CHECKED = "its launch files were not checked: they are too many or too large"


def with_findings(plan: HostPlan, found: Iterable[Diagnostic]) -> HostPlan:
    """Returns the plan with the first error as its problem, unless it has one, and the others as notes."""
    listed = sorted(found, key=lambda one: one.severity is not Severity.ERROR)
    problem = plan.problem
    if listed and problem is None and listed[0].severity is Severity.ERROR:
        first = listed.pop(0)
        problem = Problem(UNFIT, first.line, "; ".join(first.help))
    notes = ["; ".join((one.line, *one.help[:1])) for one in listed]
    return replace(plan, problem=problem, notes=(*plan.notes, *notes))
