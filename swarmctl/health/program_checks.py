"""Checks of programs: the unit, the node, the topics it publishes and subscribes. Pure."""

from __future__ import annotations

from swarmctl.health import checks
from swarmctl.health.checks import State, Verdict
from swarmctl.health.expected_graph import ExpectedHost
from swarmctl.health.expected_programs import ExpectedProgram
from swarmctl.health.observations import Answer, NodeSeen, UnitSeen
from swarmctl.health.root_cause import Findings

CHECK = "program"


def compare(found: Findings, host: ExpectedHost, answer: Answer | None, gate: str) -> None:
    """Files one finding per program of ``host``. ``gate``: the finding whether the host answered."""
    for program in host.programs:
        if answer is None:
            not_probed = checks.unknown("its host could not be probed")
            found.add(CHECK, program.name, not_probed, program=program, after=[gate])
            continue
        unit, node = answer.units.get(program.unit), answer.nodes.get(program.node)
        after = [f"probe {host.name} units"]
        if unit is not None and unit.load == "not-found":
            after.append(f"release {host.name}")
        if unit is not None and unit.runs:
            after += [f"master {host.name}", f"probe {host.name} ros", f"release {host.name}"]
        found.add(CHECK, program.name, verdict(program, host, unit, node), program=program, after=after)


def verdict(
    program: ExpectedProgram, host: ExpectedHost, unit: UnitSeen | None, node: NodeSeen | None
) -> Verdict:
    """Returns the first problem, from the unit to the topics that the node subscribes."""
    by_unit = checks.unit(program.unit, host.name, unit)
    if unit is not None and unit.skipped and program.packages:
        return _skipped(program)
    if by_unit.state not in (State.OK, State.WARNING):
        return by_unit
    restart = f"on {host.name}: systemctl restart {program.unit}"
    if unit is None or not unit.runs or not program.node:
        return by_unit
    if node is None or node.registered is None:
        return checks.unknown(f"{program.node} was not checked")
    if not node.registered:
        journal = f"on {host.name}: journalctl -u {program.unit} -n 20"
        return checks.bad(f"runs, but its node {program.node} {checks.absent(host)}", journal)
    if not node.alive:
        return checks.bad(f"{program.node} {checks.dead(host, node)}", restart)
    if other := checks.moved(host, node):
        return checks.bad(f"{program.node} {other}", f"check for a second node of this name; else {restart}")
    wrong = _wrong(program, node)
    return wrong if wrong is not None else by_unit


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
