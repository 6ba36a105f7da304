"""Looks at robots on all hosts of a swarm before units stop on which these robots depend."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

from swarm_onboard.agent.motion_gate import RobotUse
from swarm_onboard.agent.verbs import motion

from swarmctl.plan.plan import Problem
from swarmctl.plan.robots_in_use import Dependent, Dependents, Stops, problems
from swarmctl.remote import operators, parallel_hosts
from swarmctl.remote.ask import ask
from swarmctl.remote.connections import Connections
from swarmctl.remote.parallel_hosts import Finished, Note, Stop
from swarmctl.remote.transport import HostError, Kind, Target

_UNKNOWN = "`--keep-going` goes on without an answer, as does `optional: true` for a host that may be away"


NONE_AWAY: Mapping[str, str] = {}
Uses = Mapping[str, RobotUse]
"""The robots in use, by name."""


@dataclass(frozen=True)
class Seen:
    """The problem of each host whose units must not stop now, and notes on the robots."""

    problems: Mapping[str, Problem]
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True)
class Guard:
    """``targets``: of all hosts of the swarm; ``lenient``: what is not known holds nothing back, or with
    ``without_away`` what is not known of hosts that are away;
    ``stop_robots``: robots in use are stopped on their hosts."""

    dependents: Dependents
    targets: Mapping[str, Target]
    connections: Connections
    parallel: int
    stop: Stop
    lenient: bool = False
    stop_robots: bool = False
    without_away: bool = False

    def look(self, stops: Stops, away: Mapping[str, str] = NONE_AWAY) -> Seen:
        """Returns which units must not stop now, since robots in use depend on them.

        ``away``: hosts that are not queried, each with the reason; without it its robots do not count. Those
        that ``clear`` would stop do not count either.
        """
        return self._seen(stops, away, stop=False)

    def clear(self, stops: Stops, away: Mapping[str, str] = NONE_AWAY) -> Seen:
        """As ``look``, but robots are stopped first, and count if they are not confirmed to stand."""
        return self._seen(stops, away, stop=True)

    def _seen(self, stops: Stops, away: Mapping[str, str], *, stop: bool) -> Seen:
        robots = self.dependents.robots(stops)
        queried = {host: names for host, names in robots.items() if host not in away}
        unqueried = {host: why for host, why in away.items() if why and host in robots}
        if not queried and not unqueried:
            return Seen({})
        uses, errors, _ = self._query(queried, stop=False)
        found = self.dependents.in_use(stops, uses)
        notes: list[Note] = []
        if found and self.stop_robots:
            left, notes = self._stopped(found, uses) if stop else ({}, [])
            found = self.dependents.in_use(stops, left)
        failed = unqueried | {host: str(error) for host, error in errors.items()}
        unknown = self.dependents.unknown(stops, failed)
        hosts = self.dependents.swarm.hosts
        passed = [
            one
            for one in unknown
            if self.lenient
            or hosts[one.robot.host].optional
            or (self.without_away and one.robot.host in unqueried)
        ]
        notes += [Note(one.robot.host, f"{one.robot.name} {one.why}") for one in passed]
        held = problems([one for one in unknown if one not in passed])
        refused = {host: replace(one, hint=_UNKNOWN) for host, one in held.items()} | problems(found)
        return Seen(refused, tuple(dict.fromkeys(notes)))

    def _stopped(self, found: Iterable[Dependent], uses: Uses) -> tuple[Uses, list[Note]]:
        """Stops robots. Returns those that are not confirmed to stand, and what their hosts noted."""
        due: dict[str, list[str]] = {}
        for robot in dict.fromkeys(one.robot.name for one in found):
            due.setdefault(self.dependents.swarm.robots[robot].host, []).append(robot)
        _, errors, notes = self._query(due, stop=True)
        return {name: _unstopped(uses[name], errors[host]) for host in errors for name in due[host]}, notes

    def _query(
        self, robots: Mapping[str, list[str]], *, stop: bool
    ) -> tuple[dict[str, RobotUse], dict[str, HostError], list[Note]]:
        """The robots in use, the errors of their hosts, and what these noted."""

        def work(target: Target, say: Callable[[str], None]) -> motion.Answer:
            request = motion.Request(
                self.dependents.swarm.name, operators.this_one(), robots[target.host], stop
            )
            with self.connections.agent_session(target) as host:
                return ask(host, motion.handle, request, on_note=say)

        uses: dict[str, RobotUse] = {}
        errors: dict[str, HostError] = {}
        notes: list[Note] = []
        targets = [self.targets[host] for host in robots]
        for event in parallel_hosts.each(targets, work, parallel=self.parallel, stop=self.stop):
            if isinstance(event, Note):
                notes.append(event)
            elif isinstance(event, Finished):
                if isinstance(found := event.outcome, HostError):
                    errors[event.host] = found
                else:
                    uses |= found.in_use
        return uses, errors, notes


def host_error(problem: Problem) -> HostError:
    """Returns a problem as the error of its host."""
    return HostError(Kind(problem.kind), problem.message, problem.hint)


def _unstopped(use: RobotUse, error: HostError) -> RobotUse:
    return use._replace(why=f"{use.why}, and is not confirmed to stand: {error}")
