"""Compares the expected graph with the answers of the hosts, causes before symptoms. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from datetime import datetime
from types import MappingProxyType

from swarmctl.health import (
    bridge_checks,
    checks,
    command_sources,
    gate_checks,
    host_checks,
    launched_checks,
    link_checks,
    node_names,
    peer_checks,
    program_checks,
    publisher_checks,
    release_checks,
    time_checks,
)
from swarmctl.health.checks import State, Verdict
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, ExpectedRobot
from swarmctl.health.node_names import Conflicts
from swarmctl.health.observations import Answer, UnitSeen
from swarmctl.health.root_cause import HOST, Diagnosis, Findings
from swarmctl.remote.transport import HostError, Kind

_AWAY = (Kind.UNREACHABLE, Kind.LOST)


def diagnose(
    graph: ExpectedGraph,
    outcomes: Mapping[str, Answer | HostError],
    launched: Mapping[tuple[str, str], Collection[str]] = MappingProxyType({}),
) -> Diagnosis:
    """Compares expected and observed; links symptoms to causes. A host without outcome was not probed.

    ``launched``: the nodes that launch files start, by host and program or robot.
    """
    found = Findings(graph.hosts)
    answers = {name: one for name, one in outcomes.items() if isinstance(one, Answer)}
    gates = {}
    for host in graph.hosts:
        outcome = outcomes.get(host.name, HostError(Kind.STOPPED, "was not probed"))
        gates[host.name] = _reached(found, host, outcome)
    present = [(host, answers[host.name]) for host in graph.hosts if host.name in answers]
    names = node_names.compare(found, graph, answers, launched)
    clocks = time_checks.clocks(graph, answers)
    for host, answer in present:
        _system(found, host, answer)
        if host.name in clocks:
            found.add("clock", host.name, clocks[host.name], host=host)
    link_checks.compare(found, graph, answers)
    masters = {host.name: answers[host.name].units.get(host.master_unit or "") for host, _ in present}
    with_master = [(host, answer) for host, answer in present if host.master_uri]
    for host, answer in with_master:
        hub, gate = answers.get(host.hub), gates.get(host.hub, "")
        _master(found, host, answer, hub, process=masters.get(host.hub), gate=gate)
    time_checks.compare(found, graph, answers)
    unconnected = peer_checks.compare(found, graph, answers)
    for host in graph.hosts:
        for robot in host.robots:
            if host.name in answers:
                _command_sources(found, robot, answers.get(host.hub), answers[host.name])
                publisher_checks.compare(found, host, robot, answers.get(host.hub), unconnected)
                _stop(found, robot, answers[host.name])
                _robot(found, host, robot, answers[host.name], names)
                _gate(found, host, robot, answers[host.name], hub=answers.get(host.hub), names=names)
            else:
                not_probed = checks.unknown("its host could not be probed")
                found.add("robot", robot.name, not_probed, robot=robot, after=[gates[host.name]])
        program_checks.compare(found, host, answers.get(host.name), gate=gates[host.name], names=names)
    bridge_checks.compare(found, graph, answers, gates)
    return found.diagnosis()


def _reached(found: Findings, host: ExpectedHost, outcome: Answer | HostError) -> str:
    """Files whether the host answered; returns the key of that finding."""
    check, verdict = HOST, checks.ok("answers")
    if isinstance(outcome, HostError) and outcome.kind is Kind.STOPPED:
        check, verdict = "probed", checks.unknown(outcome.message)
    elif isinstance(outcome, HostError):
        check = HOST if outcome.kind in _AWAY else outcome.kind.value
        verdict = checks.bad(outcome.message, outcome.hint)
    return found.add(check, host.name, verdict, host=host)


def _system(found: Findings, host: ExpectedHost, answer: Answer) -> None:
    """Checks release, system, and units of no robot and no program; files the parts that the probe missed."""
    for part, why in answer.troubles.items():
        found.add("probe", f"{host.name} {part}", checks.unknown(why), host=host)
    if answer.release is not None or "release" not in answer.troubles:
        found.add("release", host.name, checks.release(host, answer.release), host=host)
    host_checks.compare(found, host, answer)
    if answer.load is not None:
        found.add("load", host.name, checks.load(answer.load, host.name), host=host)
    release_checks.compare(found, host, answer)
    of_others = {name for robot in host.robots for name in (robot.unit, robot.line_unit, robot.pairing_unit)}
    of_others |= {robot.gate.unit for robot in host.robots if robot.gate is not None}
    of_others |= {program.unit for program in host.programs}
    for name in host.release.units:
        if name not in of_others:
            foreign = name == host.master_unit and checks.is_foreign(answer.master, answer.units.get(name))
            _unit(found, host, name, answer, after=[f"master {host.name}"] if foreign else [])


def _unit(
    found: Findings,
    host: ExpectedHost,
    name: str,
    answer: Answer,
    *,
    robot: ExpectedRobot | None = None,
    after: Iterable[str] = (),
) -> str:
    seen = answer.units.get(name)
    explaining = [f"probe {host.name} units", *after]
    if seen is not None and seen.load == "not-found":
        explaining.append(f"release {host.name}")
    if seen is not None and seen.ended:
        explaining.append(f"{release_checks.FILES} {host.name}")
    verdict = checks.unit(name, host.name, seen)
    return found.add(
        "unit", _unit_subject(host.name, name), verdict, host=host, robot=robot, after=explaining
    )


def _unit_subject(host: str, unit: str) -> str:
    """Names the host as well, since units of the same name run on many hosts."""
    return f"{unit} on {host}"


def _master(
    found: Findings,
    host: ExpectedHost,
    answer: Answer,
    hub: Answer | None,
    *,
    process: UnitSeen | None,
    gate: str,
) -> None:
    """Checks the master as this host reaches it.

    ``process``: its unit on the hub; ``gate``: the finding whether the hub answered.
    """
    probe = f"probe {host.name} ros"
    if host.is_hub:
        own_unit = f"unit {_unit_subject(host.name, host.master_unit or '')}"
        verdict = checks.master(host, answer.master, process=process)
        # One that has the port is why the unit does not run.
        after = [probe] if checks.is_foreign(answer.master, process) else [probe, own_unit]
        found.add("master", host.name, verdict, host=host, after=after)
    else:
        run_id = hub.master.run_id if hub is not None and hub.master is not None else ""
        verdict = checks.master(host, answer.master, run_id, process)
        found.add("master", host.name, verdict, host=host, after=[gate, f"master {host.hub}", probe])


def _command_sources(found: Findings, robot: ExpectedRobot, hub: Answer | None, own: Answer) -> None:
    """Checks the publishers of a robot's command topic that the master of its island lists."""
    if hub is not None and robot.command in hub.commanders:
        guard = own.nodes.get(robot.guard_node)
        report = guard.report if guard is not None else None
        found.add("authority", robot.name, command_sources.unauthorised(robot, hub, report), robot=robot)
        found.add("command type", robot.name, command_sources.types(robot, hub), robot=robot)


def _stop(found: Findings, robot: ExpectedRobot, answer: Answer) -> None:
    """Names a robot that stands on purpose: it is not a fault, and it does not obey."""
    if (latch := answer.latches.get(robot.name)) is not None:
        text = f"stopped by {latch.who}{_since(latch.since)}"
        verdict = checks.warning(text, f"`swarmctl start SPEC {robot.name}` lets it obey again")
        found.add("stop", robot.name, verdict, robot=robot)


def _since(seconds: float) -> str:
    """A moment in words; none if the host's number is none."""
    try:
        moment = datetime.fromtimestamp(seconds).astimezone()
    except (ValueError, OverflowError, OSError):
        return ""
    return f" since {moment:%Y-%m-%d %H:%M:%S}" if seconds else ""


def _robot(
    found: Findings, host: ExpectedHost, robot: ExpectedRobot, answer: Answer, names: Conflicts
) -> None:
    """Checks a robot, from its line to its topics."""
    probe_devices, probe_ros = (f"probe {host.name} {part}" for part in ("devices", "ros"))
    master, release = f"master {host.name}", f"release {host.name}"
    line = ""
    if robot.pairing_unit is not None:
        _unit(found, host, robot.pairing_unit, answer, robot=robot)
    if robot.line_unit is not None:
        line = _unit(found, host, robot.line_unit, answer, robot=robot)
    undeployed = [release] if answer.release is None else []
    time = f"{time_checks.TIME} {host.hub}"
    device = "" if not robot.device else found.add(
        "device", robot.name, checks.device(robot, answer.devices.get(robot.device)),
        robot=robot, after=[probe_devices, line, *undeployed],
    )  # fmt: skip
    process, node = answer.units.get(robot.unit), answer.nodes.get(robot.node)
    starting = [master, device] if process is not None and process.active == "activating" else []
    rivals = names.of(host.name, robot.unit)
    unit = _unit(found, host, robot.unit, answer, robot=robot, after=[*rivals, *starting])
    differences = answer.environments.get(robot.unit, ())
    environment = found.add(
        "environment", robot.name, checks.environment(host.name, robot.unit, differences), robot=robot
    )
    if not robot.node:
        _launched(
            found, host, robot, answer, [*rivals, master, environment, probe_ros, device, unit, release]
        )
        return
    driver = found.add(
        "driver", robot.name, checks.driver(robot, host, process, node),
        robot=robot, after=[*rivals, master, environment, probe_ros, unit, release],
    )  # fmt: skip
    if node is None or not node.alive:
        return
    if robot.parameters and node.parameters is not None:
        found.add(
            "parameters", robot.name, checks.parameters(robot, node),
            robot=robot, after=[master, driver, release],
        )  # fmt: skip
    report = ""
    if node.report is not None:
        report = found.add(
            "report",
            robot.name,
            checks.report(node.report),
            robot=robot,
            after=[device, unit, f"authority {robot.name}"],
        )
    for topic in robot.topics:
        found.add(
            "topic", f"{topic.name} of {robot.name}",
            _of_robot(checks.topic(topic, node, answer.load), robot),
            robot=robot, after=[device, unit, report, driver, probe_ros, release, time],
        )  # fmt: skip


def _gate(
    found: Findings,
    host: ExpectedHost,
    robot: ExpectedRobot,
    answer: Answer,
    *,
    hub: Answer | None,
    names: Conflicts,
) -> None:
    """Checks the gate in front of a vendor's driver, after that driver."""
    gate = robot.gate
    if gate is None:
        return
    master, probe_ros = f"master {host.name}", f"probe {host.name} ros"
    process, node = answer.units.get(gate.unit), answer.nodes.get(gate.node)
    rivals = names.of(host.name, gate.unit)
    unit = _unit(found, host, gate.unit, answer, robot=robot, after=rivals)
    runs = found.add(
        "gate", robot.name, gate_checks.runs(robot, gate, host, process, node),
        robot=robot, after=[*rivals, master, probe_ros, unit, f"release {host.name}"],
    )  # fmt: skip
    wiring = ""
    if hub is not None and gate.output in hub.commanders:
        others = gate_checks.other_inputs(robot, gate, hub, answer)
        # A driver that takes its commands elsewhere is no symptom: it is what is wrong.
        driver = [] if others else [f"unit {_unit_subject(host.name, robot.unit)}", f"driver {robot.name}"]
        verdict = gate_checks.bypassed(robot, gate, hub, others)
        wiring = found.add("wiring", robot.name, verdict, robot=robot, after=[runs, *driver])
    if node is not None and node.report is not None:
        found.add(
            "gate report", robot.name, checks.report(node.report),
            robot=robot, after=[wiring, f"authority {robot.name}"],
        )  # fmt: skip


def _launched(
    found: Findings, host: ExpectedHost, robot: ExpectedRobot, answer: Answer, after: list[str]
) -> None:
    """Checks the nodes that the launch file of a robot's driver starts, and its topics."""
    seen, after = answer.launched.get(robot.unit), [*after, f"probe {host.name} launched"]
    verdict = launched_checks.driver(robot, host, seen)
    driver = found.add("driver", robot.name, verdict, robot=robot, after=after)
    if seen is None or seen.error:
        return
    for topic in robot.topics:
        found.add(
            "topic", f"{topic.name} of {robot.name}",
            _of_robot(launched_checks.topic(topic, seen, answer.load), robot),
            robot=robot, after=[*after, driver, f"{time_checks.TIME} {host.hub}"],
        )  # fmt: skip


def _of_robot(verdict: Verdict, robot: ExpectedRobot) -> Verdict:
    """The verdict with a hint at the link of a robot that no device connects."""
    if verdict.state is not State.BAD or verdict.hint or not robot.reach:
        return verdict
    return Verdict(verdict.state, verdict.message, robot.reach)
