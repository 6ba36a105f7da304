"""A plan: per host, the steps from the release it runs to the one it should run, each with its cause."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from swarm_onboard.agent import steps
from swarm_onboard.agent.steps import Step

from swarmctl.analysis.impact import Impact


@dataclass(frozen=True)
class Problem:
    """Why a host cannot be planned or deployed, with a hint how to fix it."""

    kind: str
    message: str
    hint: str = ""


@dataclass(frozen=True)
class HostPlan:
    """The steps of one host from one release to the next; no steps if it is up to date.

    ``last``: the host's last transaction when it was observed; ``files_only``: nothing that runs on the host
    uses what changes.
    """

    host: str
    previous: str | None
    next: str
    steps: tuple[Step, ...] = ()
    diffs: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    problem: Problem | None = None
    last: str = ""
    files_only: bool = False

    def targets(self, *kinds: str) -> tuple[str, ...]:
        """Returns the targets of the steps of these kinds."""
        return tuple(steps.targets(self.steps, *kinds))

    def to_json(self) -> dict[str, Any]:
        """Returns the host's entry in ``plan --json``."""
        return {
            "host": self.host,
            "previous": self.previous,
            "next": self.next,
            "steps": [step._asdict() for step in self.steps],
            "diffs": dict(self.diffs),
            "notes": list(self.notes),
            "problem": asdict(self.problem) if self.problem else None,
        }


@dataclass(frozen=True)
class Plan:
    """The plans of all hosts in the order of the spec, and the single points of failure."""

    swarm: str
    hosts: tuple[HostPlan, ...]
    single_points: tuple[Impact, ...] = ()

    @property
    def changes(self) -> bool:
        """True if a host without a problem has steps."""
        return any(host.steps and not host.problem for host in self.hosts)

    @property
    def problems(self) -> tuple[HostPlan, ...]:
        """The hosts that cannot be planned."""
        return tuple(host for host in self.hosts if host.problem)

    @property
    def counts(self) -> Mapping[str, int]:
        """The number of steps of each kind, on hosts without a problem."""
        return Counter(step.kind for host in self.hosts if not host.problem for step in host.steps)

    def to_json(self) -> dict[str, Any]:
        """Returns what ``plan --json`` prints."""
        return {
            "v": 1,
            "swarm": self.swarm,
            "changes": self.changes,
            "hosts": [host.to_json() for host in self.hosts],
            "single_points_of_failure": [one.to_json() for one in self.single_points],
        }
