"""Reads the records of who commanded the robots from their hosts, and checks each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from swarm_onboard.agent.audit import ChangeEntry
from swarm_onboard.agent.verbs import command_record, history
from swarm_onboard.common.record_chain import Head

from swarmctl.plan.command_history import Record, read
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.ask import ask
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import Session, Target, Transport

_VERBS = ("history", "command_record")
_MOST_ROBOTS = 100  # of one host


@dataclass(frozen=True)
class HostRecords:
    """What a host has recorded: its changes, and its robots' records by name."""

    changes: list[ChangeEntry]
    robots: Mapping[str, Record]


def command_records(
    swarm: str,
    targets: list[Target],
    transport: Transport,
    seen: Mapping[str, Mapping[str, Head]],
    *,
    parallel: int,
) -> Iterator[Event[HostRecords]]:
    """Reads the records of every host. ``seen``: heads that were read before, by host and robot.

    Yields events.
    """

    def work(session: Session, target: Target, note: object) -> HostRecords:
        with agent_client.agent_session(session, verbs=_VERBS) as host:
            before = seen[target.host]
            there = ask(host, command_record.handle, command_record.Request(swarm)).robots
            robots = {}
            for name in sorted({*there[:_MOST_ROBOTS], *before}):
                lines = ask(host, command_record.handle, command_record.Request(swarm, name)).text
                robots[name] = read(lines, before.get(name))
            changes = ask(host, history.handle, history.Request(swarm)).entries
            return HostRecords(changes, robots)

    return parallel_hosts.run(targets, work, transport=transport, parallel=parallel)
