"""The gate in front of a vendor's driver: whether it runs, and whether all commands pass through it. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swarm_onboard.agent.observations import NodeSeen
from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health import unit_faults
from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks import link, unit
from swarmctl.health.expected_graph import ExpectedHost, ExpectedRobot
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import State, Verdict, bad, listed, ok, unknown
from swarmctl.render.middleware import ExpectedGate

TABLE = {
    "gate": (
        ("the gate of a robot does not run, or lacks its input or output", "unhealthy"),
        ("a second process has the name of its node", "a warning, with the command that ends it"),
    ),
    "wiring": (
        ("commands reach a driver past its gate", "unhealthy; a warning where they may be something else"),
        ("no node receives what the gate lets through", "unhealthy"),
    ),
}

_LOST = "commands do not reach the driver"
_COMMANDS = ("cmd", "command", "setpoint", "teleop", "joy")  # in the name of a topic that takes commands


def compare(found: Findings, context: CheckContext) -> None:
    """Files whether each gate runs, and, where the hub was probed, whether all commands pass through it."""
    for host, robot, answer in context.robots():
        if (gate := robot.gate) is None:
            continue
        running = _runs(robot, gate, host, answer.units.get(gate.unit), answer.nodes.get(gate.node))
        after = [*context.rivals(host.name, gate.unit), f"master {host.name}", f"discovery {host.name}"]
        after += [*link.keys(context.graph, host), f"probe {host.name} ros"]
        after += [unit.key(host.name, gate.unit), f"release {host.name}"]
        found.add("gate", robot.name, running, robot=robot, after=after)
        hub = context.answers.get(host.hub)
        if hub is not None and gate.output in hub.commanders:
            others = _other_inputs(robot, gate, hub, answer)
            # A driver that takes its commands elsewhere is no symptom: it is what is wrong.
            driver = [] if others else [unit.key(host.name, robot.unit), f"driver {robot.name}"]
            wiring = _bypassed(robot, gate, hub, answer, others)
            unseen = [f"discovery {one}" for one in (host.hub, f"{host.hub} to {host.name}")]
            after = [f"gate {robot.name}", *driver, *unseen]
            found.add("wiring", robot.name, wiring, robot=robot, after=after)


def _runs(
    robot: ExpectedRobot,
    gate: ExpectedGate,
    host: ExpectedHost,
    process: UnitState | None,
    seen: NodeSeen | None,
) -> Verdict:
    """Checks the gate's node on ``host``. ``process``: its unit."""
    restart = f"on {robot.host}: sudo systemctl restart {gate.unit}"
    if seen is None or seen.registered is None:
        return unknown(unit_faults.unchecked(gate.node, seen))
    if not seen.registered:
        return bad(f"{gate.node} {unit_faults.absent(host)}: {_LOST}", restart)
    if not seen.alive:
        return bad(f"{gate.node} {unit_faults.dead(host, seen)}: {_LOST}", restart)
    if other := unit_faults.moved(host, seen):
        return bad(f"{gate.node} {other}", restart)
    if robot.command not in seen.subscribes:
        return bad(f"{gate.node} does not subscribe to {robot.command}: commands are lost", restart)
    if gate.output not in seen.publishes:
        return bad(f"{gate.node} does not publish {gate.output}: {_LOST}", restart)
    if process is not None and process.pid and seen.pid and process.pid != seen.pid:
        text = (
            f"{gate.node} is process {seen.pid}, but its unit runs {process.pid}: a second one has its name"
        )
        hint = f"on {robot.host}: sudo kill {seen.pid}; sudo systemctl restart {gate.unit}"
        return Verdict(State.WARNING, text, hint)
    return ok(f"{gate.node} runs")


def _bypassed(
    robot: ExpectedRobot,
    gate: ExpectedGate,
    hub: Answer,
    answer: Answer,
    others: Mapping[str, Sequence[str]],
) -> Verdict:
    """Checks at the master that every command passes through the gate, and that somebody receives it.

    ``others``: what ``_other_inputs`` returns.
    """
    there = [one for one in hub.commanders.get(gate.output, ()) if one != gate.node]
    silent = [one for one in there if not _publishes(hub, one, gate.output)]
    if rivals := [one for one in there if one not in silent]:
        hint = f"stop {_them(rivals)}, or publish on {robot.command}"
        return bad(f"{listed(rivals)} on {gate.output}: the driver obeys it past the gate", hint)
    # A node that subscribes from outside the robot's namespace is not a driver: it records or shows commands.
    own = f"{gate.node.rpartition('/')[0]}/"
    past = [
        one
        for one in hub.receivers.get(robot.command, ())
        if one != gate.node and (one.startswith(own) or one in others.get(robot.command, ()))
    ]
    if past:
        hint = f"remap its command topic to {gate.output}: `command` of the driver names it"
        return bad(f"{listed(past)} subscribes to {robot.command}: it receives commands past the gate", hint)
    for topic, nodes in others.items():
        if (verdict := _used(robot, hub, topic, nodes)) is not None:
            return verdict
    if not hub.receivers.get(gate.output, ()):
        if hub.incomplete or (hub.seen is not None and not others and _sees_receivers(gate, answer)):
            return unknown(f"who subscribes to {gate.output} was not seen yet")
        return _unheard(robot, gate, others)
    if silent:
        text = f"{listed(silent)} on {gate.output}: listed by the master, but not answering"
        return Verdict(State.WARNING, text, f"if {_it(silent)} ended: `rosnode cleanup` removes the entry")
    if others:
        return ok(f"every command passes through it; nobody publishes on {listed(list(others))}")
    return ok("every command passes through it")


def _other_inputs(
    robot: ExpectedRobot, gate: ExpectedGate, hub: Answer, answer: Answer
) -> dict[str, list[str]]:
    """Returns the nodes of the driver by each topic of a command's type that they take beside the gate's."""
    launched = answer.launched.get(robot.unit)
    nodes = {robot.node} if launched is None else {*launched.starts, *launched.nodes}
    found = {
        topic: [one for one in receivers if one in nodes and one != gate.node]
        for topic, receivers in hub.receivers.items()
        if topic != gate.output
    }
    return {topic: receivers for topic, receivers in found.items() if receivers}


def _used(robot: ExpectedRobot, hub: Answer, topic: str, nodes: Sequence[str]) -> Verdict | None:
    """What passes beside the gate on another topic that ``nodes`` of the driver take."""
    senders = [
        one
        for one in hub.commanders.get(topic, ())
        if one not in nodes and one != robot.node and _publishes(hub, one, topic)
    ]
    if not senders:
        return None
    text = f"{listed(senders)} on {topic}, to which {listed(nodes)} subscribes"
    hint = f"stop {_them(senders)}, or publish on {robot.command}"
    if any(word in topic for word in _COMMANDS):
        return bad(f"{text}: it commands the driver past the gate", hint)
    return Verdict(State.WARNING, f"{text}: if these are commands, they pass beside the gate", hint)


def _unheard(robot: ExpectedRobot, gate: ExpectedGate, others: Mapping[str, Sequence[str]]) -> Verdict:
    """Nobody receives what the gate lets through."""
    for topic, nodes in others.items():
        private = f"{nodes[0]}/"
        name = f"~{topic[len(private) :]}" if topic.startswith(private) else topic
        text = (
            f"{listed(nodes)} takes commands on {topic} instead of {gate.output}: they pass beside the gate"
        )
        return bad(text, f"write `command: {name}` in the driver of {robot.name}, so that it is remapped")
    hint = f"check `command` of the driver: it names the topic that {robot.node or 'it'} takes commands from"
    return bad(f"no node subscribes to {gate.output}: {_LOST}", hint)


def _sees_receivers(gate: ExpectedGate, answer: Answer) -> bool:
    """Returns True if the gate itself reports no fault: one without a subscriber of its output does."""
    seen = answer.nodes.get(gate.node)
    return seen is not None and seen.report is not None and seen.report.level == 0


def _publishes(hub: Answer, node: str, topic: str) -> bool:
    """Whether ``node`` publishes ``topic`` or was not looked up: the master lists a killed one for ever."""
    return node not in hub.senders or topic in hub.senders[node].publishes


def _it(nodes: Sequence[str]) -> str:
    return "it has" if len(nodes) == 1 else "they have"


def _them(nodes: Sequence[str]) -> str:
    return "it" if len(nodes) == 1 else "them"
