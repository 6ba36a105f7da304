"""The topics that drivers and programs publish: their types and rates. Pure."""

from __future__ import annotations

from swarm_onboard.agent.observations import LoadSeen, NodeSeen, TopicSeen
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health import launched_nodes
from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks import driver, program, simulated_time, unit
from swarmctl.health.checks.load import BUSY
from swarmctl.health.expected_graph import ExpectedHost, ExpectedRobot
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import State, Verdict, bad, ok, unknown, warning
from swarmctl.swarm.topics import DriverTopic

TABLE = {
    "topic": (
        ("a topic of a driver is not published, or has another type", "unhealthy"),
        ("it has less than 70 % of its rate, or no message came", "unhealthy, with the age of the last one"),
        ("it is too slow on a host whose processors are busy, and messages still come", "a warning"),
    )
}
LOWEST_SHARE = 0.7  # of the expected rate
_PERIODS_TO_JUDGE = 2.0


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each topic of a driver that lives, and each that a program publishes at a rate."""
    for host, robot, answer in context.robots():
        if _lives(robot, answer):
            after = _causes(context, host, robot)
            for topic in robot.topics:
                judged = _of_robot(verdict(topic, _publisher(topic, robot, answer), answer.load), robot)
                found.add("topic", f"{topic.name} of {robot.name}", judged, robot=robot, after=after)
    for host, one, answer in context.programs():
        process = answer.units.get(one.unit)
        for topic in one.measured if process is not None and process.runs else ():
            node = program.publisher(one, answer, topic.name)
            if node is not None:
                after = [*program.causes(context, host, one, answer), f"{program.CHECK} {one.name}"]
                judged = verdict(topic, node, answer.load)
                found.add("topic", f"{topic.name} of {one.name}", judged, program=one, after=after)


def _lives(robot: ExpectedRobot, answer: Answer) -> bool:
    if robot.node:
        node = answer.nodes.get(robot.node)
        return node is not None and node.alive is True
    launched = answer.launched.get(robot.unit)
    return launched is not None and not launched.error


def _causes(context: CheckContext, host: ExpectedHost, robot: ExpectedRobot) -> list[str]:
    time = f"{simulated_time.TIME} {host.hub}"
    if not robot.node:
        return [*driver.causes(context, host, robot), f"driver {robot.name}", time]
    parts = (f"{check} {robot.name}" for check in ("report", "driver"))
    probe, release = f"probe {host.name} ros", f"release {host.name}"
    return [f"device {robot.name}", unit.key(host.name, robot.unit), *parts, probe, release, time]


def _publisher(topic: DriverTopic, robot: ExpectedRobot, answer: Answer) -> NodeSeen | None:
    if robot.node:
        return answer.nodes[robot.node]
    return launched_nodes.publisher(topic.name, answer.launched.get(robot.unit))


def _of_robot(verdict: Verdict, robot: ExpectedRobot) -> Verdict:
    """The verdict with a hint at the link of a robot that no device connects."""
    if verdict.state is not State.BAD or verdict.hint or not robot.reach:
        return verdict
    return Verdict(verdict.state, verdict.message, robot.reach)


def verdict(wanted: DriverTopic, node: NodeSeen | None, load: LoadSeen | None = None) -> Verdict:
    """Checks that a topic is published, its type and its rate.

    ``load``: of its host. A host with much to do slows down its nodes, and what status looks with: then a low
    rate is a warning, and silence is none.
    """
    published_as = node.publishes.get(wanted.name) if node is not None else None
    if node is None or published_as is None:
        return bad("is not published")
    seen = node.topics.get(wanted.name)
    if wanted.type not in (published_as, seen.type if seen else ""):
        return bad(f"has type {published_as} instead of {wanted.type}")
    if not wanted.rate:
        return ok("is published")
    if seen is None:
        return unknown("was not measured")
    if seen.error:
        return bad(f"cannot be received: {seen.error}")
    return _rate(wanted, seen, load)


def too_slow(wanted: DriverTopic, seen: TopicSeen) -> bool:
    """Returns True if the probe listened for too short a time to measure the rate."""
    return seen.rate is None and (not seen.seconds or 0 < wanted.rate * seen.seconds < _PERIODS_TO_JUDGE)


def _rate(wanted: DriverTopic, seen: TopicSeen, load: LoadSeen | None) -> Verdict:
    if too_slow(wanted, seen):
        return Verdict(State.SKIPPED, f"is too slow to be measured in {seen.seconds:g} s")
    if seen.count == 0:
        return bad(f"no message in {seen.seconds:g} s, {wanted.rate:g} Hz expected")
    if seen.rate is None:
        return bad(f"one message in {seen.seconds:g} s, {wanted.rate:g} Hz expected")
    text = f"measured {seen.rate:.1f} Hz of {wanted.rate:g}"
    if seen.rate >= LOWEST_SHARE * wanted.rate:
        return ok(text)
    if seen.age is not None and seen.age * wanted.rate > _PERIODS_TO_JUDGE:
        return bad(f"{text}, the last message {seen.age:.1f} s ago")
    if load is not None and load.busy >= BUSY:
        text = f"{text}, while the processors of its host were busy ({load.busy:.0%})"
        return warning(text, "`top` on the host shows what keeps them busy")
    return bad(text)
