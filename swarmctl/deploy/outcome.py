"""What came of a host in a deploy or a removal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from swarm_onboard.agent.systemd import UnitState

from swarmctl.deploy.prepare import Prepared
from swarmctl.plan.plan import HostPlan
from swarmctl.remote.transport import HostError


@dataclass(frozen=True)
class Outcome:
    """The result of one host: the executed plan, and the units after it.

    ``recovered``: whether an earlier deploy, which was interrupted, was confirmed or undone first.
    """

    plan: HostPlan
    units: Mapping[str, UnitState] = field(default_factory=dict)
    recovered: bool = False

    @property
    def changed(self) -> bool:
        """True if the plan had steps on the host, or an earlier deploy was recovered."""
        return bool(self.plan.steps) or self.recovered


@dataclass(frozen=True)
class Removed:
    """The result of a removal: ``changed`` if the swarm was deployed there."""

    changed: bool


Result = Outcome | Removed | Prepared | HostError
