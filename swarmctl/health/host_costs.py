"""Reads again and again what units cost, from each host at its own pace: a silent host delays no other."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from swarm_onboard.agent.verbs import costs
from swarm_onboard.agent.verbs.costs import Answer, UnitCosts

from swarmctl.health.host_logs import source_of
from swarmctl.remote import agent_client
from swarmctl.remote.ask import ask
from swarmctl.remote.parallel_hosts import WAKES, stream
from swarmctl.remote.transport import AgentSession, HostError, Session, Target, Transport


@dataclass(frozen=True)
class UnitCost:
    """A unit, called as in logs. ``cpu``: cores that it keeps busy; ``memory``: resident, bytes."""

    host: str
    name: str
    cpu: float
    memory: int
    processes: int


def between(host: str, swarm: str, before: Answer, after: Answer) -> list[UnitCost]:
    """The units that run now, the busiest first. One that has started meanwhile counts from its start."""
    seconds = max(after.clock - before.clock, 1e-3)
    found = (
        UnitCost(
            host,
            source_of(unit, swarm),
            round(max(0.0, now.cpu - before.units.get(unit, UnitCosts()).cpu) / seconds, 4),
            now.memory,
            now.processes,
        )
        for unit, now in after.units.items()
    )
    return sorted(found, key=lambda one: (-one.cpu, one.name))


def chosen(
    found: Mapping[str, list[UnitCost] | HostError], parts: Mapping[str, Sequence[str]]
) -> tuple[list[UnitCost], dict[str, HostError]]:
    """The units of the selected robots and programs, all of a host without any; and the hosts with errors."""
    units = [
        one
        for host, costs in found.items()
        if not isinstance(costs, HostError)
        for one in costs
        if not parts[host] or one.name.partition("/")[0] in parts[host]
    ]
    return units, {host: one for host, one in found.items() if isinstance(one, HostError)}


_AGAIN = 1.0  # s until a host that failed is connected to again
_PATIENCE = 10.0  # s for an answer


class HostCosts:
    """What the units of each host took over the last ``every`` s; read until the process ends."""

    def __init__(self, swarm: str, targets: Sequence[Target], transport: Transport, every: float) -> None:
        self._swarm, self._every = swarm, every
        self._hosts = [target.host for target in targets]
        self._latest: dict[str, list[UnitCost] | HostError] = {}
        self._all = threading.Event()
        stream(targets, self._read, self._failed, transport=transport)

    def wait_for_all(self) -> None:
        """Returns once every host has answered, or has an error."""
        while not self._all.wait(WAKES):
            pass

    def latest(self) -> Mapping[str, list[UnitCost] | HostError]:
        """The last answer or error of each host that has one, in the order of the targets."""
        return {host: self._latest[host] for host in self._hosts if host in self._latest}

    def _read(self, session: Session, target: Target) -> None:
        with agent_client.agent_session(session, verbs=("costs",)) as agent:
            before = self._answer(agent)
            while True:
                time.sleep(self._every)
                after = self._answer(agent)
                self._take(target.host, between(target.host, self._swarm, before, after))
                before = after

    def _failed(self, host: str, error: HostError) -> float:
        self._take(host, error)
        return _AGAIN

    def _answer(self, agent: AgentSession) -> costs.Answer:
        return ask(agent, costs.handle, costs.Request(self._swarm), timeout=_PATIENCE)

    def _take(self, host: str, found: list[UnitCost] | HostError) -> None:
        self._latest[host] = found
        if len(self._latest) == len(self._hosts):
            self._all.set()
