"""Reads the logs of hosts and their records of who commanded the robots, and checks each."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from swarm_onboard.agent.audit import ChangeEntry
from swarm_onboard.agent.verbs import command_record, history
from swarm_onboard.common.record_chain import Head

from swarmctl.plan.command_history import Record, read
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.ask import ask, ask_each
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import Session, Target, Transport


def histories(
    swarm: str, targets: list[Target], transport: Transport, *, parallel: int
) -> Iterator[Event[history.Answer]]:
    """Reads the log of every host. Yields events."""
    chosen = {target.host: target for target in targets}
    requests = dict.fromkeys(chosen, history.Request(swarm))
    return ask_each(history.handle, requests, chosen, transport, parallel=parallel)


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


def path_of(place: Path, host: str) -> Path:
    """Returns the file with the heads of a host, in the journal of its swarm."""
    return place / f".commands-{host}.json"


def recall_heads(place: Path, host: str) -> dict[str, Head]:
    """Returns the heads by robot; none if they are not known."""
    try:
        found = json.loads(path_of(place, host).read_text("utf-8"))
        return {str(robot): Head(int(one["number"]), str(one["digest"])) for robot, one in found.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}


def remember_heads(place: Path, host: str, heads: Mapping[str, Head]) -> None:
    """Stores the heads by robot, atomically. Raises ``OSError``."""
    place.mkdir(parents=True, exist_ok=True)
    draft = place / f".commands-{host}.new"
    draft.write_text(json.dumps({robot: asdict(head) for robot, head in heads.items()}), "utf-8")
    draft.replace(path_of(place, host))
