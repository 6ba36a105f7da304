"""What every check compares: the expected graph, and what the hosts answered. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, ExpectedProgram, ExpectedRobot
from swarmctl.health.name_conflicts import Conflict, Launched, conflicts
from swarmctl.health.root_cause import HOST
from swarmctl.remote.transport import HostError, Kind

_AWAY = (Kind.UNREACHABLE, Kind.LOST)
_NO_MAIN_PROCESS = ("dead", "failed", "auto-restart", "start-pre")  # sub states of a service


@dataclass(frozen=True)
class CheckContext:
    """A swarm as it should be and as it is. A host without outcome was not probed.

    ``launched``: the nodes that launch files start, by host and program or robot.
    """

    graph: ExpectedGraph
    outcomes: Mapping[str, Answer | HostError]
    launched: Launched

    @cached_property
    def answers(self) -> Mapping[str, Answer]:
        """The hosts that answered."""
        return {name: one for name, one in self.outcomes.items() if isinstance(one, Answer)}

    @cached_property
    def hosts(self) -> tuple[tuple[ExpectedHost, Answer], ...]:
        """The hosts that answered, in the order of the spec."""
        answers = self.answers
        return tuple((host, answers[host.name]) for host in self.graph.hosts if host.name in answers)

    @cached_property
    def by_address(self) -> Mapping[str, ExpectedHost]:
        """The hosts by what stands for them in the URIs of their nodes."""
        return {host.advertised.lower(): host for host in self.graph.hosts}

    def robots(self) -> Iterator[tuple[ExpectedHost, ExpectedRobot, Answer]]:
        """Yields the robots whose host answered."""
        return ((host, robot, answer) for host, answer in self.hosts for robot in host.robots)

    def programs(self) -> Iterator[tuple[ExpectedHost, ExpectedProgram, Answer]]:
        """Yields the programs whose host answered."""
        return ((host, program, answer) for host, answer in self.hosts for program in host.programs)

    def reached(self, host: str) -> str:
        """Returns the key of the finding whether ``host`` answered."""
        outcome = self.outcomes.get(host, HostError(Kind.STOPPED, ""))
        if not isinstance(outcome, HostError) or outcome.kind in _AWAY:
            return f"{HOST} {host}"
        return f"{'probed' if outcome.kind is Kind.STOPPED else outcome.kind.value} {host}"

    @cached_property
    def master_processes(self) -> Mapping[str, UnitState | None]:
        """By hub, the unit of its master."""
        return {host.name: answer.units.get(host.master_unit or "") for host, answer in self.hosts}

    def has_foreign_master(self, host: ExpectedHost) -> bool:
        """Returns True if ``host`` reaches a master, and not that of its hub, whose unit does not run."""
        master = self.answers[host.name].master
        process = self.master_processes.get(host.hub)
        reachable = master is not None and master.reachable
        return reachable and process is not None and process.sub in _NO_MAIN_PROCESS and not process.skipped

    @cached_property
    def conflicts(self) -> tuple[Conflict, ...]:
        """The names that two nodes of one graph have or had."""
        return tuple(conflicts(self.graph, self.answers, self.launched))

    @cached_property
    def _rivals(self) -> Mapping[tuple[str, str], Iterable[str]]:
        found: dict[tuple[str, str], list[str]] = {}
        for conflict in self.conflicts:
            for place in conflict.explained:
                found.setdefault((place.host, place.unit), []).append(conflict.key)
        return found

    def rivals(self, host: str, unit: str) -> Iterable[str]:
        """Returns the keys of the findings about equal names that explain what is wrong with a unit."""
        return self._rivals.get((host, unit), ())
