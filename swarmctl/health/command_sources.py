"""The publishers of a robot's command topic: whether they are authorised, and their message type. Pure."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.health.checks import State, Verdict, bad, ok
from swarmctl.health.expected_graph import ExpectedRobot
from swarmctl.health.observations import Answer, SenderSeen

_MOST_NAMED = 3


def senders(robot: ExpectedRobot, hub: Answer) -> Iterator[tuple[str, SenderSeen]]:
    """Yields the live nodes that publish on the command topic of ``robot``, with what the probe found."""
    for node in hub.commanders.get(robot.command, ()):
        seen = hub.senders.get(node)
        if seen is not None and robot.command in seen.publishes:
            yield node, seen


def may_command(robot: ExpectedRobot, node: str, seen: SenderSeen) -> bool:
    """Returns True if ``control`` allows ``node`` to command ``robot``."""
    return any(commander.includes(node, seen.host) for commander in robot.commanders)


def unauthorised(robot: ExpectedRobot, hub: Answer) -> Verdict:
    """Checks for unauthorised publishers: a warning if the driver rejects them, else bad."""
    found = [(node, seen) for node, seen in senders(robot, hub) if not may_command(robot, node, seen)]
    if not found:
        return ok("no unauthorised publisher")
    named = [f"{node} on {seen.host}" for node, seen in found[:_MOST_NAMED]]
    more = [f"{len(found) - _MOST_NAMED} more"] if len(found) > _MOST_NAMED else []
    who, them = ("publisher", "it") if len(found) == 1 else ("publishers", "them")
    effect = "rejected by the driver" if robot.guarded else "the driver obeys any publisher"
    return Verdict(
        State.WARNING if robot.guarded else State.BAD,
        f"unauthorised {who} {', '.join([*named, *more])} on {robot.command}; {effect}",
        f"stop {them}, or add {them} to `control` (allowed now: {_names(robot)})",
    )


def types(robot: ExpectedRobot, hub: Answer) -> Verdict:
    """Checks the type of commands: ROS drops another type before the driver receives it."""
    wanted = robot.command_type
    for node, seen in senders(robot, hub):
        kind = seen.publishes[robot.command]
        if kind not in (wanted, "*") and may_command(robot, node, seen):
            text = f"{node} on {seen.host} publishes {robot.command} as {kind} instead of {wanted}"
            return bad(f"{text}: its commands are lost", f"publish {wanted}, or remap the topic")
    return ok(f"of type {wanted}")


def _names(robot: ExpectedRobot) -> str:
    return ", ".join(dict.fromkeys(one.name for one in robot.commanders)) or "nobody"
