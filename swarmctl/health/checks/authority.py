"""The publishers of a robot's command topic: whether they are authorised, and their message type. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from swarm_onboard.agent.observations import Report, SenderSeen
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.check_context import CheckContext
from swarmctl.health.expected_graph import ExpectedRobot
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import State, Verdict, bad, listed, ok

TABLE = {
    "authority": (
        (
            "a node that `control` does not allow publishes commands of a robot",
            "unhealthy; a warning if the driver or the gate rejects it, also for a minute after it has ended",
        ),
    ),
    "command type": (("a node that may command publishes another type of message", "unhealthy"),),
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files two findings for each robot whose command topic the master of its island lists."""
    for host, robot, answer in context.robots():
        hub = context.answers.get(host.hub)
        if hub is not None and robot.command in hub.commanders:
            guard = answer.nodes.get(robot.guard_node)
            report = guard.report if guard is not None else None
            found.add("authority", robot.name, _unauthorised(robot, hub, report), robot=robot)
            found.add("command type", robot.name, _types(robot, hub), robot=robot)


def senders(robot: ExpectedRobot, hub: Answer) -> Iterator[tuple[str, SenderSeen]]:
    """Yields the live nodes that publish on the command topic of ``robot``, with what the probe found."""
    for node in hub.commanders.get(robot.command, ()):
        seen = hub.senders.get(node)
        if seen is not None and robot.command in seen.publishes:
            yield node, seen


def may_command(robot: ExpectedRobot, node: str, seen: SenderSeen) -> bool:
    """Returns True if `control` allows ``node`` to command ``robot``, or may do: where a graph does not show
    on which host a node is, it may be on one that `control` allows.
    """
    if not seen.host and any(commander.addresses for commander in robot.commanders):
        return True
    return any(commander.includes(node, seen.host) for commander in robot.commanders)


def _unauthorised(robot: ExpectedRobot, hub: Answer, report: Report | None) -> Verdict:
    """Checks for unauthorised publishers: a warning if the driver or the gate rejects them, else bad.

    ``report``: what that node reports; "rejected" is its word, not a guess.
    """
    found = [(node, seen) for node, seen in senders(robot, hub) if not may_command(robot, node, seen)]
    if not found:
        return _lately(robot, report) if robot.guard else ok(_unguarded(robot))
    named = listed([_placed(node, seen) for node, seen in found])
    who, them = ("publisher", "it") if len(found) == 1 else ("publishers", "them")
    text = f"unauthorised {who} {named} on {robot.command}"
    return Verdict(
        State.WARNING if robot.guard else State.BAD,
        f"{text}; {_effect(robot, found, report)}",
        f"stop {them}, or add {them} to `control` (allowed now: {_names(robot)})",
    )


def _placed(node: str, seen: SenderSeen) -> str:
    return f"{node} on {seen.host}" if seen.host else node


def _lately(robot: ExpectedRobot, report: Report | None) -> Verdict:
    """Checks for senders that have ended: a person who tries by hand is done before anybody looks.

    Driver and gate name them for a minute, but not those that may command and waited for a higher priority.
    """
    if report is None or not report.strangers:
        return ok("no unauthorised publisher")
    return Verdict(
        State.WARNING,
        f"within the last minute the {robot.guard} rejected {report.strangers}",
        f"to let a sender command {robot.name}, add it to `control` (allowed now: {_names(robot)})",
    )


def _effect(robot: ExpectedRobot, found: Sequence[tuple[str, SenderSeen]], report: Report | None) -> str:
    if not robot.guard:
        return _unguarded(robot)
    rejected = [node for node, _ in found if report is not None and node in report.refused]
    others = [node for node, _ in found if node not in rejected]
    if not others:
        return f"rejected by the {robot.guard}"
    them = "it" if len(found) == 1 else listed(others) if rejected else "them"
    silent = (
        f"the {robot.guard} has received no command of {them}"
        if report is not None and report.refused_all
        else f"the {robot.guard} does not report whether it rejects {them}"
    )
    return f"{listed(rejected)} rejected by the {robot.guard}, {silent}" if rejected else silent


def _unguarded(robot: ExpectedRobot) -> str:
    why = f", as it is ungated: {robot.ungated}" if robot.ungated else ""
    return f"the driver obeys any publisher{why}"


def _types(robot: ExpectedRobot, hub: Answer) -> Verdict:
    """Checks the type of commands: ROS drops another type before the driver receives it."""
    wanted = robot.command_type
    for node, seen in senders(robot, hub):
        kind = seen.publishes[robot.command]
        if kind not in (wanted, "*") and may_command(robot, node, seen):
            text = f"{_placed(node, seen)} publishes {robot.command} as {kind} instead of {wanted}"
            return bad(f"{text}: its commands are lost", f"publish {wanted}, or remap the topic")
    return ok(f"of type {wanted}")


def _names(robot: ExpectedRobot) -> str:
    return ", ".join(dict.fromkeys(one.name for one in robot.commanders)) or "nobody"
