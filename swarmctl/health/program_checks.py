"""Checks of programs: the unit, the nodes, the topics they publish and subscribe. Pure."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.health import checks, image_checks, launched_checks
from swarmctl.health.checks import State, Verdict
from swarmctl.health.expected_graph import ExpectedHost
from swarmctl.health.expected_programs import ExpectedProgram
from swarmctl.health.node_names import Conflicts
from swarmctl.health.observations import Answer, NodeSeen
from swarmctl.health.root_cause import Findings

CHECK = "program"


def compare(
    found: Findings,
    host: ExpectedHost,
    answer: Answer | None,
    *,
    gate: str,
    names: Conflicts,
) -> None:
    """Files one finding for each program of ``host``, and one per topic with a declared rate.

    ``gate``: the finding whether the host answered; ``names``: those of equal node names.
    """
    for program in host.programs:
        if answer is None:
            not_probed = checks.unknown("its host could not be probed")
            found.add(CHECK, program.name, not_probed, program=program, after=[gate])
            continue
        unit = answer.units.get(program.unit)
        after = [*names.of(host.name, program.unit), f"probe {host.name} units"]
        if unit is not None and unit.load == "not-found":
            after.append(f"release {host.name}")
        if unit is not None and unit.runs:
            parts = [f"probe {host.name} {part}" for part in ("ros", "launched")]
            after += [f"master {host.name}", *_environment(found, program, answer)]
            after += [*parts, f"release {host.name}"]
            after += [] if program.gives_time else [f"simulated time {host.hub}"]
        key = found.add(CHECK, program.name, verdict(program, host, answer), program=program, after=after)
        for topic in program.measured if unit is not None and unit.runs else ():
            node = publisher(program, answer, topic.name)
            if node is not None:
                subject = f"{topic.name} of {program.name}"
                rate = checks.topic(topic, node, answer.load)
                found.add("topic", subject, rate, program=program, after=[*after, key])


def _environment(found: Findings, program: ExpectedProgram, answer: Answer) -> Iterator[str]:
    """Checks the ROS variables of a program; not those of a container, whose engine runs in the unit."""
    if program.container is None:
        verdict = checks.environment(program.host, program.unit, answer.environments.get(program.unit, ()))
        yield found.add("environment", program.name, verdict, program=program)


def publisher(program: ExpectedProgram, answer: Answer, topic: str) -> NodeSeen | None:
    """Returns the node of ``program`` that publishes ``topic``, if one does."""
    if not program.node:
        return launched_checks.publisher(topic, answer.launched.get(program.unit))
    node = answer.nodes.get(program.node)
    return node if node is not None and node.alive and topic in node.publishes else None


def verdict(program: ExpectedProgram, host: ExpectedHost, answer: Answer) -> Verdict:
    """Returns the first problem, from the unit to the topics that its nodes have."""
    unit = answer.units.get(program.unit)
    by_unit = checks.unit(program.unit, host.name, unit)
    if unit is not None and unit.skipped and program.packages:
        return _skipped(program)
    if program.container is not None and unit is not None and unit.load != "not-found":
        seen = answer.images.get(program.unit)
        by_image = image_checks.problem(program.container, host.name, seen, by_unit)
        if by_image is not None:
            return by_image
    if unit is None or not unit.runs or by_unit.state not in (State.OK, State.WARNING):
        return by_unit
    if program.oneshot:
        return checks.ok("ended with exit code 0") if unit.sub == "exited" else by_unit
    if program.node:
        wrong = _node(program, host, answer.nodes.get(program.node))
    else:
        wrong = launched_checks.problem(program, host, answer.launched.get(program.unit))
    return wrong if wrong is not None else by_unit


def _node(program: ExpectedProgram, host: ExpectedHost, node: NodeSeen | None) -> Verdict | None:
    restart = f"on {host.name}: sudo systemctl restart {program.unit}"
    if node is None or node.registered is None:
        return checks.unknown(f"{program.node} was not checked")
    if not node.registered:
        journal = f"on {host.name}: sudo journalctl -u {program.unit} -n 50"
        return checks.bad(f"runs, but its node {program.node} {checks.absent(host)}", journal)
    if not node.alive:
        return checks.bad(f"{program.node} {checks.dead(host, node)}", restart)
    if other := checks.moved(host, node):
        return checks.bad(f"{program.node} {other}", f"check for a second node of this name; else {restart}")
    return _wrong(program, node)


def _skipped(program: ExpectedProgram) -> Verdict:
    several = len(program.packages) > 1
    lacks = "one of the ROS packages" if several else "the ROS package"
    text = f"is skipped: host {program.host} lacks {lacks} {', '.join(program.packages)}"
    return Verdict(State.SKIPPED, text, f"{program.install_hint}; then run swarmctl deploy")


def _wrong(program: ExpectedProgram, node: NodeSeen) -> Verdict | None:
    """A topic of the spec that the node lacks, or has with another type."""
    hint = "correct the spec, or remap the program's names"
    for topics, seen, verb, state in (
        (program.publishes, node.publishes, "publish", State.BAD),
        # Many nodes subscribe only while their own output has subscribers.
        (program.subscribes, node.subscribes, "subscribe to", State.WARNING),
    ):
        for topic, kind in topics:
            known = seen.get(topic)
            if known is None:
                return Verdict(state, f"{program.node} does not {verb} {topic}", hint)
            if known not in (kind, "*", ""):
                text = f"{topic} of {program.node} has type {known} instead of {kind}"
                return checks.bad(text, hint)
    return None
