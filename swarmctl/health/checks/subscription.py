"""Whether subscribers have a connection to each publisher that their master lists. Pure.

A master announces a publisher once to each subscriber; where that call is lost, the two stay apart. A
publisher drops a subscriber whose package has another definition of the type.
"""

from __future__ import annotations

from swarm_onboard.agent.observations import SenderSeen, UnconnectedSeen

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks import authority, connection, link
from swarmctl.health.checks.connection import Owner
from swarmctl.health.expected_graph import ExpectedHost
from swarmctl.health.root_cause import Findings
from swarmctl.health.unit_faults import host_of
from swarmctl.health.verdict import Verdict, bad

TABLE = {
    "subscription": (
        (
            "a subscriber has no connection to a publisher, in two looks",
            "unhealthy, with both types or MD5 sums where they differ, else with the restart that repairs it",
        ),
    )
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each such pair. What may not command a robot need not be connected to it."""
    for host, answer in context.hosts:
        for pair in answer.unconnected:
            robot, program = owner = _owner(context, host, pair)
            home = context.by_address.get(host_of(pair.uri))
            sender = SenderSeen(host_of(pair.uri))
            if home is None or (robot and not authority.may_command(robot, pair.publisher, sender)):
                continue
            subject = connection.subject(pair.node, host, pair.publisher, home)
            after = [f"{connection.CHECK} {subject}", *link.keys(context.graph, host)]
            after += [f"command type {robot.name}"] if robot else []
            verdict = _verdict(pair, host, owner)
            found.add("subscription", subject, verdict, host=host, robot=robot, program=program, after=after)


def _owner(context: CheckContext, host: ExpectedHost, pair: UnconnectedSeen) -> Owner:
    inputs = connection.inputs_of(context.graph, host)
    found = (one.owner for one in inputs if one.node == pair.node and pair.topic in one.topics)
    return next(found, (None, None))


def _verdict(pair: UnconnectedSeen, host: ExpectedHost, owner: Owner) -> Verdict:
    nothing, types = f"nothing arrives on {pair.topic}", (pair.type, pair.publisher_type)
    if all(types) and "*" not in types and pair.type != pair.publisher_type:
        text = f"it subscribes to {pair.type}, and the publisher sends {pair.publisher_type}: {nothing}"
        return bad(text, "remap one of the two topics, or start one of the nodes with the other's type")
    if pair.md5 and pair.publisher_md5 and pair.md5 != pair.publisher_md5:
        sums = f"MD5 sum {pair.md5[:8]} here, {pair.publisher_md5[:8]} there"
        package = pair.type.partition("/")[0]
        hint = f"install or build the same version of {package} for both, and start them again"
        return bad(f"{pair.type} is another message ({sums}): {nothing}", hint)
    unit = _unit_of(owner)
    start = f"on {host.name}: sudo systemctl restart {unit}" if unit else f"start {pair.node} again"
    return bad(f"there is no connection: {nothing}", f"{start}; it gets the list of publishers then")


def _unit_of(owner: Owner) -> str:
    robot, program = owner
    if robot is not None:
        return robot.gate.unit if robot.gate is not None else robot.unit
    return program.unit if program is not None else ""
