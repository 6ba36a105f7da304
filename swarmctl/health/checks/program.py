"""Programs: the unit, the image, the nodes, their topics, services and actions. Pure."""

from __future__ import annotations

from swarm_onboard.agent.observations import NodeSeen
from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.verbs.probe import Answer
from swarm_onboard.common.systemd import WAITS

from swarmctl.health import launched_nodes, unit_faults
from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks import link
from swarmctl.health.checks import unit as units
from swarmctl.health.expected_graph import ExpectedHost, ExpectedProgram
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import State, Verdict, bad, ok, unknown, warning

CHECK = "program"
TABLE = {
    CHECK: (
        ("a program does not run", "as for `unit`"),
        ("it runs in trials alone, and no trial goes on", "ok; a warning if it failed in the last one"),
        ("its host lacks its ROS packages, and it may be skipped", "skipped, with the install command"),
        ("the image of its container is not on the host, or built for another machine", "unhealthy"),
        ("its node is not registered, does not answer, or advertises another address", "unhealthy"),
        (
            "its node lacks a declared topic, service or action, or its type differs",
            "unhealthy; for `subscribes`, a warning",
        ),
        *launched_nodes.TABLE,
        ("`teleop-joy` waits for its gamepad, or for the dead-man button to be let go", "a warning"),
    )
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each program."""
    for host in context.graph.hosts:
        answer = context.answers.get(host.name)
        for program in host.programs:
            if answer is None:
                verdict, after = unknown("its host could not be probed"), [context.reached(host.name)]
            else:
                verdict, after = _verdict(program, host, answer), causes(context, host, program, answer)
            found.add(CHECK, program.name, verdict, program=program, after=after)


def causes(context: CheckContext, host: ExpectedHost, program: ExpectedProgram, answer: Answer) -> list[str]:
    """Returns what may explain that a program does not run, or not well; most basic cause first."""
    unit = answer.units.get(program.unit)
    after = [
        *context.rivals(host.name, program.unit),
        f"systemd {host.name}",
        f"requirement {host.name}",
        f"probe {host.name} units",
    ]
    if unit is not None and unit.load == "not-found":
        after.append(f"release {host.name}")
    if unit is not None and unit.runs:
        after += [f"master {host.name}", f"discovery {host.name}", *link.keys(context.graph, host)]
        after.append(f"override {host.name} {program.unit}")
        after += [f"environment {program.name}"] if program.container is None else []
        after += [f"probe {host.name} {part}" for part in ("ros", "launched")]
        after.append(f"release {host.name}")
        after += [] if program.gives_time else [f"simulated time {host.hub}"]
    return after


def publisher(program: ExpectedProgram, answer: Answer, topic: str) -> NodeSeen | None:
    """Returns the node of ``program`` that publishes ``topic``, if one does."""
    if not program.node:
        return launched_nodes.publisher(topic, answer.launched.get(program.unit))
    node = answer.nodes.get(program.node)
    return node if node is not None and node.alive and topic in node.publishes else None


def _verdict(program: ExpectedProgram, host: ExpectedHost, answer: Answer) -> Verdict:
    """Returns the first problem, from the unit to the topics that its nodes have."""
    unit = answer.units.get(program.unit)
    by_unit = units.verdict(program.unit, host.name, unit)
    if unit is not None and unit.skipped and program.packages and not unit.unmet:
        return _skipped(program)
    if program.lifecycle == "trial" and unit is not None and unit.load == "loaded":
        by_unit = _between_trials(program, unit, by_unit)
    if program.container is not None and unit is not None and unit.load != "not-found":
        seen = answer.images.get(program.unit)
        by_image = unit_faults.image_problem(program.container, host.name, seen, by_unit)
        if by_image is not None:
            return by_image
    if unit is None or not unit.runs or by_unit.state not in (State.OK, State.WARNING):
        return by_unit
    if program.lifecycle != "service":
        return ok("ended with exit code 0") if unit.sub == "exited" else by_unit
    if program.node:
        wrong = _node(program, host, answer.nodes.get(program.node))
    else:
        wrong = launched_nodes.problem(program, host, answer.launched.get(program.unit))
    if wrong is None and unit.text.startswith(WAITS):
        return warning(unit.text)
    return wrong if wrong is not None else by_unit


def _between_trials(program: ExpectedProgram, unit: UnitState, verdict: Verdict) -> Verdict:
    if unit.active == "failed":
        return warning(f"in its last trial it {verdict.message}", verdict.hint)
    if unit.skipped and unit_faults.waits_for_trial(program.unit, unit.unmet):
        return ok("waits for a trial")
    if unit.active in ("inactive", "deactivating") and not unit.skipped and unit.result == "success":
        return ok("has ended")
    return verdict


def _node(program: ExpectedProgram, host: ExpectedHost, node: NodeSeen | None) -> Verdict | None:
    restart = f"on {host.name}: sudo systemctl restart {program.unit}"
    if node is None or node.registered is None:
        return unknown(unit_faults.unchecked(program.node, node))
    if not node.registered:
        journal = f"on {host.name}: sudo journalctl -u {program.unit} -n 50"
        return bad(f"runs, but its node {program.node} {unit_faults.absent(host)}", journal)
    if not node.alive:
        return bad(f"{program.node} {unit_faults.dead(host, node)}", restart)
    if other := unit_faults.moved(host, node):
        return bad(f"{program.node} {other}", f"check for a second node of this name; else {restart}")
    return _wrong(program, node)


def _skipped(program: ExpectedProgram) -> Verdict:
    several = len(program.packages) > 1
    lacks = "one of the ROS packages" if several else "the ROS package"
    text = f"is skipped: host {program.host} lacks {lacks} {', '.join(program.packages)}"
    return Verdict(State.SKIPPED, text, f"{program.install_hint}; then run swarmctl deploy")


def _wrong(program: ExpectedProgram, node: NodeSeen) -> Verdict | None:
    """A topic or a service of the spec that the node lacks, or has with another type."""
    hint = "correct the spec, or remap the program's names"
    for topics, seen, verb, state in (
        (program.publishes, node.publishes, "publish", State.BAD),
        # Many nodes subscribe only while their own output has subscribers.
        (program.subscribes, node.subscribes, "subscribe to", State.WARNING),
        (program.provides, node.provides, "provide", State.BAD),
    ):
        for topic, kind in topics:
            known = seen.get(topic)
            if known is None:
                return Verdict(state, f"{program.node} does not {verb} {topic}", hint)
            if known not in (kind, "*", ""):
                text = f"{topic} of {program.node} has type {known} instead of {kind}"
                return bad(text, hint)
    return None
