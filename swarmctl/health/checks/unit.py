"""The systemd units: that they run, keep running, and have no stopped process. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.verbs.probe import Answer
from swarm_onboard.common.systemd import REJOINS

from swarmctl.health import unit_faults
from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks.release import FILES
from swarmctl.health.expected_graph import ExpectedHost, ExpectedRobot
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import State, Verdict, bad, ok, unknown, warning

CHECK = "unit"
TABLE = {
    CHECK: (
        ("the unit runs", "ok"),
        (
            "it failed, is stopped, or is being restarted",
            "unhealthy, with how it ended and its log's last lines",
        ),
        ("its first start takes more than 10 s", "unhealthy, with the last lines of its log"),
        ("systemd restarted it more than 3 times within 10 minutes", "unhealthy, also while it runs again"),
        ("systemd restarted it within the last 30 s", "a warning, with how it ended"),
        ("it was restarted 3 times or more since it was started, but long ago", "a warning"),
        (
            "a signal or a debugger has stopped one of its processes",
            "unhealthy, with the command to continue",
        ),
        ("a condition of its file is not met", "skipped, with what the host lacks and how to bring it"),
    )
}
MOST_RESTARTS = 3  # of a unit; one more within RESTART_WINDOW makes it unhealthy
RESTART_WINDOW = 600.0  # s; a start by hand or by a deploy begins a new count
_LONGEST_START = 10.0  # s
_JUST_NOW = 30.0  # s since a restart
_REJOINED = f"exit code {REJOINS}"


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each unit but those of programs, whose check includes them."""
    masters = {host.name: host.master_unit for host in context.graph.hosts}
    for host, answer in context.hosts:
        of_robots = {unit: robot for robot in host.robots for unit in _units(robot)}
        others = {*of_robots, *(program.unit for program in host.programs)}
        for name in host.release.units:
            if name not in others:
                foreign = name == host.master_unit and context.has_foreign_master(host)
                _add(found, host, name, answer, after=[f"master {host.name}"] if foreign else [])
        for name, robot in of_robots.items():
            after = [*context.rivals(host.name, name), *_starting(host, robot, name, answer)]
            seen = answer.units.get(name)
            after += [key(host.hub, masters.get(host.hub))] if seen is not None and _rejoins(seen) else []
            _add(found, host, name, answer, robot=robot, after=after)


def _units(robot: ExpectedRobot) -> Iterator[str]:
    gate = robot.gate.unit if robot.gate is not None else None
    return (unit for unit in (robot.pairing_unit, robot.line_unit, robot.unit, gate) if unit)


def _starting(host: ExpectedHost, robot: ExpectedRobot, name: str, answer: Answer) -> list[str]:
    """What the unit of a driver that is starting may wait for."""
    seen = answer.units.get(name)
    waits = name == robot.unit and seen is not None and seen.active == "activating"
    return [f"master {host.name}", f"device {robot.name}"] if waits else []


def _add(
    found: Findings,
    host: ExpectedHost,
    name: str,
    answer: Answer,
    *,
    robot: ExpectedRobot | None = None,
    after: Iterable[str] = (),
) -> None:
    seen = answer.units.get(name)
    explaining = [
        f"systemd {host.name}",
        f"requirement {host.name}",
        f"probe {host.name} units",
        f"override {host.name} {name}",
        *after,
    ]
    if seen is not None and seen.load == "not-found":
        explaining.append(f"release {host.name}")
    if seen is not None and seen.ended:
        explaining.append(f"{FILES} {host.name}")
    judged = verdict(name, host.name, seen)
    found.add(CHECK, _subject(host.name, name), judged, host=host, robot=robot, after=explaining)


def _subject(host: str, unit: str) -> str:
    """Names the host as well, since units of the same name run on many hosts."""
    return f"{unit} on {host}"


def key(host: str, unit: str | None) -> str:
    """Returns the key of the finding about a unit."""
    return f"{CHECK} {_subject(host, unit or '')}"


def verdict(name: str, host: str, seen: UnitState | None) -> Verdict:
    """Checks that a systemd unit runs, that no process of it is stopped, and that it keeps running."""
    journal = f"on {host}: sudo journalctl -u {name} -n 50"
    if seen is None:
        return unknown("was not checked")
    if seen.load == "not-found":
        return bad("does not exist on the host", "run swarmctl deploy")
    if (troubled := _troubled(name, host, seen, journal)) is not None:
        return troubled
    if seen.skipped:
        why, hint = unit_faults.unmet_conditions(host, name, seen.unmet)
        return Verdict(State.SKIPPED, f"is skipped: {why}", hint)
    if seen.active == "failed":
        return bad(f"failed: {ending(seen)}{log_of(seen)}", journal)
    if seen.active == "activating" and seen.starting > _LONGEST_START:
        return bad(f"has been starting for {seen.starting:.0f} s{log_of(seen)}", journal)
    if seen.active == "activating":
        return Verdict(State.WARNING, _with("is starting", seen.text), journal)
    if not seen.runs:
        return bad(f"does not run ({seen.active or 'unknown'})", f"on {host}: sudo systemctl start {name}")
    if (restarts := seen.restarts - seen.rejoined) >= MOST_RESTARTS:
        text = f"{times(restarts)} since it was started{_running(seen)}"
        return Verdict(State.WARNING, text, journal)
    return ok(_with("runs", seen.text))


def _troubled(name: str, host: str, seen: UnitState, journal: str) -> Verdict | None:
    """Checks what a unit that runs may hide: stopped processes, and restarts one after the other."""
    if seen.stopped:
        numbers = " ".join(one.partition(" ")[0] for one in seen.stopped)
        text = f"a signal has stopped its process{'es' if len(seen.stopped) > 1 else ''} "
        return bad(text + ", ".join(seen.stopped), f"on {host}: sudo kill -CONT {numbers}")
    if _rejoins(seen):
        return warning("ended, and is started again: its master is another one now", journal)
    if seen.restarted or (seen.active == "activating" and seen.restarts) or seen.sub == "auto-restart":
        loops = seen.restarts > 1  # one restart may be the last one
        what = f"crash loop: {times(seen.restarts)}" if loops else "ended and is started again"
        return bad(f"{what}, last result {ending(seen)}{log_of(seen)}", journal)
    if seen.recent > MOST_RESTARTS:
        reset = f"once it is fixed: sudo systemctl reset-failed {name}"
        return bad(_lately(seen), f"{journal}; {reset}")
    if seen.recent and seen.runs and 0 < seen.running < _JUST_NOW:
        return warning(_lately(seen), journal)
    return None


def _rejoins(seen: UnitState) -> bool:
    """Returns True if it ended at this moment to join the master that has replaced its own."""
    return seen.exit == _REJOINED and (seen.restarted > 0 or seen.sub == "auto-restart")


def _lately(seen: UnitState) -> str:
    text = f"{times(seen.recent)} within {RESTART_WINDOW / 60:g} min, last result {ending(seen)}"
    return text + _running(seen)


def ending(seen: UnitState) -> str:
    """Returns how it ended: systemd's result, which is ``success`` while it runs again, and the exit code."""
    known = [one for one in (seen.result, seen.exit) if one and not (seen.exit and one == "success")]
    return ", ".join(known) or "unknown"


def log_of(seen: UnitState) -> str:
    """Returns the end of the log of a unit that does not run."""
    return f"; its log ends with: {seen.log}" if seen.log and not seen.runs else ""


def times(restarts: int) -> str:
    """Returns how often a unit was restarted, in words."""
    return f"restarted {restarts} time{'' if restarts == 1 else 's'}"


def _running(seen: UnitState) -> str:
    """For how long a restarted unit has run by now, in s, min or h, rounded down."""
    if not seen.runs or seen.running < 1:
        return ""
    for unit, seconds in (("h", 3600), ("min", 60)):
        if seen.running >= 2 * seconds:
            return f"; it has run for {seen.running // seconds:.0f} {unit} now"
    return f"; it has run for {seen.running:.0f} s now"


def _with(text: str, status: str) -> str:
    return f"{text}: {status}" if status else text
