"""What came of one trial."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from swarmctl.capsule.capsule_index import Judged
    from swarmctl.deploy.host_systems import System
    from swarmctl.deploy.robot_stop import RobotStop
    from swarmctl.deploy.trial_start import Clock
    from swarmctl.health.host_costs import UnitCost
    from swarmctl.health.swarm_health import Look


class TrialError(Exception):
    """A trial did not begin, or did not go to its end."""


@dataclass
class Trial:
    """What came of one trial; ``began`` by host, s since 1970 by the hosts' ``clocks``.

    ``costs``: of the units of a host, from the first look at it in the trial to the last one.
    """

    number: int
    before: Look
    after: Look | None = None
    began: dict[str, float] = field(default_factory=dict)
    clocks: Mapping[str, Clock] = field(default_factory=dict)
    ended: float = 0.0
    costs: dict[str, list[UnitCost]] = field(default_factory=dict)
    systems: Mapping[str, System] = field(default_factory=dict)
    stops: list[RobotStop] = field(default_factory=list)
    outcome: str = "completed"
    cause: str = ""
    judged: list[Judged] = field(default_factory=list)

    @property
    def success(self) -> bool | None:
        """Whether it was completed, and its bags show what was wanted; None if nothing was."""
        met = all(one.met for one in self.judged)
        return self.outcome == "completed" and met if self.judged else None

    @property
    def skew(self) -> float | None:
        """S between the first and the last host's start, as far as their clocks are known."""
        moments = [moment - self.clocks[host].ahead for host, moment in self.began.items()]
        return max(moments) - min(moments) if moments else None

    @property
    def start(self) -> float:
        """When the first host started, or else the first look: s since 1970 by the operator's clock."""
        moments = [moment - self.clocks[host].ahead for host, moment in self.began.items()]
        return min(moments, default=self.before.began)

    def interrupt(self) -> None:
        """Makes it one that a person has ended."""
        self.outcome, self.cause = "interrupted", "ended by a person"

    def fail(self, cause: str) -> None:
        """Makes it a failed one; the first cause stays."""
        if self.outcome == "completed":
            self.outcome, self.cause = "failed", cause
