"""Expected graph and answers to findings, along their dependencies: causes before symptoms. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from swarmctl.health import authority, bridges, running, verdicts
from swarmctl.health.expected import ExpectedGraph, ExpectedHost, ExpectedRobot
from swarmctl.health.findings import HOST, Diagnosis, Findings
from swarmctl.health.seen import Answer
from swarmctl.remote.transport import HostError, Kind

_AWAY = (Kind.UNREACHABLE, Kind.LOST)


def diagnose(graph: ExpectedGraph, outcomes: Mapping[str, Answer | HostError]) -> Diagnosis:
    """Compare. A host without an outcome counts as not asked."""
    found = Findings()
    answers = {name: one for name, one in outcomes.items() if isinstance(one, Answer)}
    gates = {}
    for host in graph.hosts:
        outcome = outcomes.get(host.name, HostError(Kind.STOPPED, "was not asked"))
        gates[host.name] = _reached(found, host, outcome)
    present = [(host, answers[host.name]) for host in graph.hosts if host.name in answers]
    for host, answer in present:
        _system(found, host, answer, answers.get(host.hub))
    for host, answer in sorted(present, key=lambda one: not one[0].is_hub):
        _master(found, host, answer, answers.get(host.hub), gates.get(host.hub, ""))
    for host in graph.hosts:
        for robot in host.robots:
            if host.name in answers:
                _orders(found, robot, answers.get(host.hub))
                _robot(found, host, robot, answers[host.name])
            else:
                not_asked = verdicts.unknown("its host could not be asked")
                found.add("robot", robot.name, not_asked, robot=robot, after=[gates[host.name]])
        running.compare(found, host, answers.get(host.name), gates[host.name])
    bridges.compare(found, graph, answers, gates)
    return Diagnosis(tuple(found.by_key.values()))


def _reached(found: Findings, host: ExpectedHost, outcome: Answer | HostError) -> str:
    """Whether the host could be asked; the key of that finding."""
    check, verdict = HOST, verdicts.ok("answers")
    if isinstance(outcome, HostError) and outcome.kind is Kind.STOPPED:
        check, verdict = "asked", verdicts.unknown(outcome.message)
    elif isinstance(outcome, HostError):
        check = HOST if outcome.kind in _AWAY else outcome.kind.value
        verdict = verdicts.bad(outcome.message, outcome.hint)
    return found.add(check, host.name, verdict, host=host)


def _system(found: Findings, host: ExpectedHost, answer: Answer, hub: Answer | None) -> None:
    """What the system knows: release, clock, units of no robot and no program; where the probe failed."""
    for part, why in answer.troubles.items():
        found.add("probe", f"{host.name} {part}", verdicts.unknown(why), host=host)
    if answer.release is not None or "release" not in answer.troubles:
        found.add("release", host.name, verdicts.release(host, answer.release), host=host)
    if hub is not None and hub.clock_ahead is not None and answer.clock_ahead is not None:
        found.add("clock", host.name, verdicts.clock(answer.clock_ahead - hub.clock_ahead), host=host)
    of_others = {name for robot in host.robots for name in (robot.unit, robot.line_unit)}
    of_others |= {program.unit for program in host.programs}
    for name in host.release.units:
        if name not in of_others:
            _unit(found, host, name, answer)


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
    verdict = verdicts.unit(name, host.name, seen)
    return found.add(
        "unit", _unit_subject(host.name, name), verdict, host=host, robot=robot, after=explaining
    )


def _unit_subject(host: str, unit: str) -> str:
    """Units of the same name are on many hosts."""
    return f"{unit} on {host}"


def _master(found: Findings, host: ExpectedHost, answer: Answer, hub: Answer | None, gate: str) -> None:
    """The master as this host sees it. ``gate``: the finding that says whether the hub could be asked."""
    probe = f"probe {host.name} ros"
    if host.is_hub:
        own_unit = f"unit {_unit_subject(host.name, host.master_unit or '')}"
        found.add(
            "master", host.name, verdicts.master(host, answer.master), host=host, after=[probe, own_unit]
        )
    else:
        run_id = hub.master.run_id if hub is not None and hub.master is not None else ""
        verdict = verdicts.master(host, answer.master, run_id)
        found.add("master", host.name, verdict, host=host, after=[gate, f"master {host.hub}", probe])


def _orders(found: Findings, robot: ExpectedRobot, hub: Answer | None) -> None:
    """Who sends a robot its orders, as the master of its island has it."""
    if hub is not None and robot.command in hub.commanders:
        found.add("authority", robot.name, authority.strangers(robot, hub), robot=robot)
        found.add("orders", robot.name, authority.types(robot, hub), robot=robot)


def _robot(found: Findings, host: ExpectedHost, robot: ExpectedRobot, answer: Answer) -> None:
    """A robot, from its line to its topics."""
    probe_devices, probe_ros = (f"probe {host.name} {part}" for part in ("devices", "ros"))
    master, release = f"master {host.name}", f"release {host.name}"
    line = ""
    if robot.line_unit is not None:
        line = _unit(found, host, robot.line_unit, answer, robot=robot)
    undeployed = [release] if answer.release is None else []
    device = found.add(
        "device", robot.name, verdicts.device(robot, answer.devices.get(robot.device)),
        robot=robot, after=[probe_devices, line, *undeployed],
    )  # fmt: skip
    process, node = answer.units.get(robot.unit), answer.nodes.get(robot.node)
    starting = [master, device] if process is not None and process.active == "activating" else []
    unit = _unit(found, host, robot.unit, answer, robot=robot, after=starting)
    driver = found.add(
        "driver", robot.name, verdicts.driver(robot, host.advertised, process, node),
        robot=robot, after=[master, probe_ros, unit, release],
    )  # fmt: skip
    if node is None or not node.alive:
        return
    report = ""
    if node.report is not None:
        report = found.add(
            "report",
            robot.name,
            verdicts.report(node.report),
            robot=robot,
            after=[device, unit, f"authority {robot.name}"],
        )
    for topic in robot.topics:
        found.add(
            "topic", f"{topic.name} of {robot.name}", verdicts.topic(topic, node),
            robot=robot, after=[device, unit, report, driver, probe_ros, release],
        )  # fmt: skip
