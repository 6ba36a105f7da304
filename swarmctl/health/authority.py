"""Who publishes the orders of a robot: may they, and do their orders arrive? Pure."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.health.expected import ExpectedRobot
from swarmctl.health.seen import Answer, SenderSeen
from swarmctl.health.verdicts import State, Verdict, bad, ok
from swarmctl.topology.interfaces import COMMAND_TYPE

_MOST_NAMED = 3


def senders(robot: ExpectedRobot, hub: Answer) -> Iterator[tuple[str, SenderSeen]]:
    """The nodes that publish ``robot``'s orders. Who is registered and does not answer publishes nothing."""
    for node in hub.commanders.get(robot.command, ()):
        seen = hub.senders.get(node)
        if seen is not None and robot.command in seen.publishes:
            yield node, seen


def may_command(robot: ExpectedRobot, node: str, seen: SenderSeen) -> bool:
    return any(commander.includes(node, seen.host) for commander in robot.commanders)


def strangers(robot: ExpectedRobot, hub: Answer) -> Verdict:
    """A warning where the robot's driver refuses them; rosserial_python obeys whoever publishes."""
    found = [(node, seen) for node, seen in senders(robot, hub) if not may_command(robot, node, seen)]
    if not found:
        return ok("nobody who may not")
    named = [f"{node} on {seen.host}" for node, seen in found[:_MOST_NAMED]]
    more = [f"{len(found) - _MOST_NAMED} more"] if len(found) > _MOST_NAMED else []
    verb, them = ("publishes", "it") if len(found) == 1 else ("publish", "them")
    means = f"its driver refuses {them}" if robot.guarded else f"its driver cannot tell, and obeys {them}"
    return Verdict(
        State.WARNING if robot.guarded else State.BAD,
        f"somebody who may not: {', '.join([*named, *more])} {verb} on {robot.command}; {means}",
        f"{_names(robot)} may: end {them}, or add {them} to `control`",
    )


def types(robot: ExpectedRobot, hub: Answer) -> Verdict:
    """Orders of another type are dropped by ROS before any driver sees them."""
    for node, seen in senders(robot, hub):
        kind = seen.publishes[robot.command]
        if kind not in (COMMAND_TYPE, "*") and may_command(robot, node, seen):
            text = f"{node} on {seen.host} publishes {robot.command} as {kind}, not as {COMMAND_TYPE}"
            return bad(f"{text}: its orders are lost", f"publish {COMMAND_TYPE} there, or remap it elsewhere")
    return ok(f"of type {COMMAND_TYPE}")


def _names(robot: ExpectedRobot) -> str:
    return ", ".join(dict.fromkeys(one.name for one in robot.commanders)) or "nobody"
