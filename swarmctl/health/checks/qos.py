"""Publishers and subscribers of one topic that exchange nothing, as their QoS or their types differ. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from swarm_onboard.agent.observations import UnmatchedSeen

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks.connection import Owner, nodes_of
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import State, Verdict

QOS, TYPE = "qos", "type"
TABLE = {
    QOS: (
        (
            "the QoS that a subscriber asks for is more than a publisher offers",
            "unhealthy, with the policies; a warning if the spec does not name both nodes",
        ),
    ),
    TYPE: (
        (
            "a publisher and a subscriber of a topic have other types, or other definitions of the type",
            "unhealthy; a warning if the spec does not name both nodes",
        ),
    ),
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each such pair, as the hub of its island sees it."""
    owners = {node: owner for host in context.graph.hosts for node, owner in nodes_of(host).items()}
    for host, answer in context.hosts:
        for pair in answer.unmatched:
            robot, program = owners.get(pair.subscriber) or owners.get(pair.publisher) or (None, None)
            named = pair.subscriber in owners and pair.publisher in owners
            check, subject = QOS if pair.policies else TYPE, f"{pair.topic} of {pair.publisher}"
            verdict = _verdict(pair, State.BAD if named else State.WARNING)
            found.add(
                check, f"{subject} to {pair.subscriber}", verdict,
                host=host, robot=robot, program=program, after=_causes(pair, owners),
            )  # fmt: skip


def _causes(pair: UnmatchedSeen, owners: Mapping[str, Owner]) -> list[str]:
    """What finds a wrong type where the spec has the right one."""
    found = []
    for node in (pair.publisher, pair.subscriber):
        robot, program = owners.get(node, (None, None))
        if robot is not None and not pair.policies:
            checks = ("driver", "command type", f"topic {pair.topic} of")
            found += [f"{check} {robot.name}" for check in checks]
        if program is not None and not pair.policies:
            found.append(f"program {program.name}")
    return found


def _verdict(pair: UnmatchedSeen, state: State) -> Verdict:
    lost = f"{pair.subscriber} receives nothing of {pair.publisher} on {pair.topic}"
    if pair.policies:
        hint = "let the subscriber ask for no more than the publisher offers, or the publisher offer more"
        return Verdict(state, f"{lost}: {pair.policies}", hint)
    if pair.type != pair.publisher_type:
        text = f"{lost}: it subscribes to {pair.type}, and the publisher sends {pair.publisher_type}"
        return Verdict(state, text, "remap one of the two topics, or use the other's type")
    hint = f"install or build the same version of {pair.type.partition('/')[0]} for both, and restart them"
    return Verdict(state, f"{lost}: they have other definitions of {pair.type}", hint)
