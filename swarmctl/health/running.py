"""Programs as they should run and as they do: the unit, the node, what it publishes and hears. Pure."""

from __future__ import annotations

from swarmctl.health import verdicts
from swarmctl.health.expected import ExpectedHost
from swarmctl.health.findings import Findings
from swarmctl.health.programs import ExpectedProgram
from swarmctl.health.seen import Answer, NodeSeen, UnitSeen
from swarmctl.health.verdicts import State, Verdict

CHECK = "program"


def compare(found: Findings, host: ExpectedHost, answer: Answer | None, gate: str) -> None:
    """One finding a program of ``host``. ``gate``: the finding that says whether the host could be asked."""
    for program in host.programs:
        if answer is None:
            not_asked = verdicts.unknown("its host could not be asked")
            found.add(CHECK, program.name, not_asked, program=program, after=[gate])
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
    """The first thing that is wrong, from the unit to what its node hears."""
    by_unit = verdicts.unit(program.unit, host.name, unit)
    if unit is not None and unit.skipped and program.packages:
        return _skipped(program)
    if by_unit.state not in (State.OK, State.WARNING):
        return by_unit
    restart = f"on {host.name}: systemctl restart {program.unit}"
    if unit is None or not unit.runs or not program.node:
        return by_unit
    if node is None or node.registered is None:
        return verdicts.unknown(f"{program.node} was not asked about")
    if not node.registered:
        journal = f"on {host.name}: journalctl -u {program.unit} -n 20"
        return verdicts.bad(f"runs, but its node {program.node} is not registered at the master", journal)
    if not node.alive:
        return verdicts.bad(f"{program.node} is registered and does not answer ({node.error})", restart)
    if (advertised := verdicts.host_of(node.uri)) != host.advertised.lower():
        text = f"{program.node} tells others to reach it at {advertised}, not at {host.advertised}"
        return verdicts.bad(text, f"a second node of this name? else {restart}")
    wrong = _wrong(program, node)
    return wrong if wrong is not None else by_unit


def _skipped(program: ExpectedProgram) -> Verdict:
    several = len(program.packages) > 1
    lacks = "one of the ROS packages" if several else "the ROS package"
    text = f"is skipped: host {program.host} lacks {lacks} {', '.join(program.packages)}"
    debian = " ".join(f"ros-noetic-{name.replace('_', '-')}" for name in program.packages)
    return Verdict(State.SKIPPED, text, f"apt install {debian}, then swarmctl deploy")


def _wrong(program: ExpectedProgram, node: NodeSeen) -> Verdict | None:
    """A topic that the spec names and the node does not have, or has of another type."""
    hint = "correct the spec, or the program's names (remap)"
    for topics, seen, verb, state in (
        (program.publishes, node.publishes, "publish", State.BAD),
        # Many a node subscribes only while somebody hears what it makes of it.
        (program.hears, node.hears, "hear", State.WARNING),
    ):
        for topic, kind in topics:
            known = seen.get(topic)
            if known is None:
                return Verdict(state, f"{program.node} does not {verb} {topic}", hint)
            if known not in (kind, "*", ""):
                text = f"{topic} of {program.node} is of type {known}, not {kind}"
                return verdicts.bad(text, hint)
    return None
