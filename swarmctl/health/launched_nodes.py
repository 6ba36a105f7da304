"""The nodes that a launch file starts, which the probe finds through roslaunch. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from swarm_onboard.agent.observations import EndedSeen, LaunchedSeen, NodeSeen

from swarmctl.health import unit_faults
from swarmctl.health.expected_graph import ExpectedHost
from swarmctl.health.verdict import State, Verdict, bad, unknown

TABLE = (
    ("a node of its launch file does not answer, or another host has its name", "unhealthy"),
    ("one ended with another exit code than 0, or after more than a minute, and stays away", "unhealthy"),
    ("one ended with exit code 0 within a minute of its start", "ok: it has done its task"),
    ("how one ended is not in the journal", "a warning"),
    ("none has a declared topic, service or action", "unhealthy; for `subscribes`, a warning"),
)
LONGEST_TASK = 60.0  # s; a node that ends with exit code 0 before that has done its task
_HINT = "correct the spec, or remap the program's names"


class Launched(Protocol):
    """What a unit launches, and what its nodes should have, with the types."""

    @property
    def unit(self) -> str:
        """The systemd unit."""

    @property
    def publishes(self) -> tuple[tuple[str, str], ...]:
        """Topics with their types."""

    @property
    def subscribes(self) -> tuple[tuple[str, str], ...]:
        """Topics with their types."""

    @property
    def provides(self) -> tuple[tuple[str, str], ...]:
        """Services and actions with their types."""


@dataclass(frozen=True)
class LaunchedDriver:
    """The launch file of a robot's driver; its topics are checked one by one."""

    unit: str
    publishes: tuple[tuple[str, str], ...] = ()
    subscribes: tuple[tuple[str, str], ...] = ()
    provides: tuple[tuple[str, str], ...] = ()


def problem(program: Launched, host: ExpectedHost, seen: LaunchedSeen | None) -> Verdict | None:
    """Returns the worst problem of the nodes of ``program``, or None."""
    if seen is None:
        return unknown("its nodes were not checked")
    if seen.error:
        return unknown(f"its nodes were not found: {seen.error}")
    found = [*_ended(program, host, seen), *_alive(program, host, seen), *_topics(program, seen)]
    return max(found, key=lambda one: one.state is State.BAD, default=None)


def _ended(program: Launched, host: ExpectedHost, seen: LaunchedSeen) -> Iterator[Verdict]:
    """Nodes that have ended without being started again."""
    for name, one in seen.ended.items():
        if _has_done_its_task(one):
            continue
        text = f"its node {name} has ended{f' ({one.exit})' if one.exit else ''} and is not started again"
        hint = (
            f"on {host.name}: sudo journalctl -u {program.unit}; `respawn` in the launch file starts it again"
        )
        yield Verdict(State.BAD if one.exit else State.WARNING, text, hint)


def _has_done_its_task(one: EndedSeen) -> bool:
    return one.exit == "exit code 0" and one.lasted is not None and one.lasted < LONGEST_TASK


def _alive(program: Launched, host: ExpectedHost, seen: LaunchedSeen) -> Iterator[Verdict]:
    """Nodes that are registered, but not alive, or elsewhere. Not all that roslaunch runs register."""
    restart = f"on {host.name}: sudo systemctl restart {program.unit}"
    for name in seen.starts:
        node = seen.nodes.get(name)
        if node is None or not node.registered:
            continue
        if not node.alive:
            yield bad(f"{name} {unit_faults.dead(host, node)}", restart)
        elif other := unit_faults.moved(host, node):
            yield bad(f"{name} {other}", f"check for a second node of this name; else {restart}")


def _topics(program: Launched, seen: LaunchedSeen) -> Iterator[Verdict]:
    """Topics and services of the spec that no node has, or has with another type."""
    nodes = seen.nodes.values()
    for topics, sides, verb, state in (
        (program.publishes, [node.publishes for node in nodes], "publishes", State.BAD),
        (program.subscribes, [node.subscribes for node in nodes], "subscribes to", State.WARNING),
        (program.provides, [node.provides for node in nodes], "provides", State.BAD),
    ):
        for topic, kind in topics:
            known = {side[topic] for side in sides if topic in side}
            if not known:
                yield Verdict(state, f"none of its nodes {verb} {topic}", _HINT)
            elif not known & {kind, "*", ""}:
                yield bad(f"{topic} has type {min(known)} instead of {kind}", _HINT)


def publisher(topic: str, seen: LaunchedSeen | None) -> NodeSeen | None:
    """Returns the node that publishes ``topic``, if one does."""
    nodes = seen.nodes.values() if seen is not None else ()
    return next((one for one in nodes if topic in one.publishes), None)
