"""The single points of failure that a plan names."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from swarmctl.plan.plan import Plan
    from swarmctl.spec.load import Document

MOST = 3


def named(made: Plan, document: Document) -> Plan:
    """The plan with the worst single points of failure of its swarm."""
    from swarmctl.analysis.impact import impacts, single_points
    from swarmctl.swarm.index import SwarmIndex

    return replace(made, single_points=single_points(impacts(SwarmIndex(document)))[:MOST])
