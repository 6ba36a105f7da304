"""The health of a swarm as text: a table of hosts, robots and programs, then causes with their symptoms."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from rich.text import Text

from swarmctl.health.checks import LOWEST_SHARE, State
from swarmctl.health.observations import UnitSeen
from swarmctl.health.root_cause import Finding
from swarmctl.health.swarm_health import (
    BridgeRow,
    HostRow,
    ProgramRow,
    RobotRow,
    Status,
    TopicRow,
)
from swarmctl.swarm.topics import DIAGNOSTICS
from swarmctl.views.escape import printable

MOST_SYMPTOMS = 6  # shown under one cause
_HEADINGS = ("HOST / ROBOT", "STATE", "RELEASE / DRIVER", "UNITS", "MASTER / DEVICE", "TOPICS, Hz")
_STYLE = {
    State.OK: "green",
    State.SKIPPED: "dim",
    State.WARNING: "yellow",
    State.UNKNOWN: "magenta",
    State.BAD: "bold red",
}
_GLYPH = {State.OK: "✓", State.SKIPPED: "-", State.WARNING: "!", State.UNKNOWN: "?", State.BAD: "✗"}
NOBODY = "nobody"  # as a driver reports it
_WIDEST = 40  # columns of a cell that is not the last
_LONGEST = 200  # characters of a sentence from a host


def status(shown: Status) -> Text:
    """Table, findings and summary."""
    return table(shown.hosts).append_text(findings(shown)).append_text(summary(shown))


def table(hosts: Sequence[HostRow]) -> Text:
    """One row per host, below it one row per robot and program."""
    rows = [row for host in hosts for row in _rows(host)]
    plain = [_HEADINGS, *(cells for _, cells in rows)]
    widths = [max(len(cells[column]) for cells in plain) for column in range(len(_HEADINGS) - 1)]
    text = Text(f"{_line(_HEADINGS, widths)}\n", "bold")
    for state, cells in rows:
        line = Text(_line(cells, widths))
        start = widths[0] + 2
        line.stylize(_STYLE[state], start, start + len(cells[1]))
        text.append_text(line).append("\n")
    return text


def _rows(host: HostRow) -> Iterator[tuple[State, tuple[str, ...]]]:
    yield _host(host)
    yield from (_robot(robot) for robot in host.robots)
    yield from (_program(program) for program in host.programs)


def findings(shown: Status) -> Text:
    """Every cause that is not ok, how to fix it, and its symptoms."""
    text = Text()
    for cause, symptoms in shown.diagnosis.explained():
        text.append("\n").append(_GLYPH[cause.state], _STYLE[cause.state]).append(
            f" {_sentence(cause)}\n", "bold"
        )
        if cause.hint:
            text.append("    help", "bold green").append(f": {_clean(cause.hint)}\n")
        for symptom in symptoms[:MOST_SYMPTOMS]:
            text.append(f"    {_GLYPH[symptom.state]}", _STYLE[symptom.state]).append(
                f" {_sentence(symptom)}\n"
            )
        if len(symptoms) > MOST_SYMPTOMS:
            text.append(f"    ... and {len(symptoms) - MOST_SYMPTOMS} more\n")
    return text.append("\n")


def summary(shown: Status) -> Text:
    """``newswarm is healthy: 3 hosts, 3 robots``, or how many causes make it unhealthy."""
    robots = sum(len(host.robots) for host in shown.hosts)
    size = f"{_many(len(shown.hosts), 'host')}, {_many(robots, 'robot')}"
    if shown.diagnosis.healthy:
        warnings = sum(cause.state is State.WARNING for cause, _ in shown.diagnosis.explained())
        noted = f", with {_many(warnings, 'warning')}" if warnings else ""
        return Text.assemble(f"{shown.swarm} is ", ("healthy", "bold green"), f"{noted}: {size}")
    causes = {one.cause or one.key for one in shown.diagnosis.troubles}
    symptoms = sum(one.cause in causes for one in shown.diagnosis.findings)
    return Text.assemble(
        f"{shown.swarm} is ",
        ("unhealthy", "bold red"),
        f": {_many(len(causes), 'cause')}, {_many(symptoms, 'symptom')}; {size}",
    )


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    *front, last = cells
    return "  ".join(
        [*(f"{cell:<{width}}" for cell, width in zip(front, widths, strict=True)), last]
    ).rstrip()


def _host(host: HostRow) -> tuple[State, tuple[str, ...]]:
    if not host.reachable:
        return host.state, (host.name, host.state.value, "no answer", "", "", "")
    skipped = sum(unit.skipped for unit in host.units.values())
    units = f"{host.units_running}/{host.units_expected}{f', {skipped} skipped' if skipped else ''}"
    return host.state, (
        host.name,
        host.state.value,
        _clean(host.release or "none", _WIDEST),
        units,
        _master(host),
        _received(host.bridges),
    )


def _master(host: HostRow) -> str:
    if not host.has_master:
        return "hub" if host.is_hub else ""
    if host.master is None or not host.master.reachable:
        return "no master"
    latency = f"{host.master.latency * 1000:.1f} ms"
    return f"hub, {latency}" if host.is_hub else latency


def _received(bridges: Sequence[BridgeRow]) -> str:
    """How many topics this hub receives over bridges, from which islands, and which ones do not arrive."""
    if not bridges:
        return ""
    wrong = [one.topic for one in bridges if one.state not in (State.OK, State.SKIPPED)]
    islands = ", ".join(dict.fromkeys(one.origin for one in bridges))
    received = f"{len(bridges) - len(wrong)}/{_many(len(bridges), 'topic')} of {islands}"
    return _clean(f"receives {received}" + (f", not {', '.join(wrong)}" if wrong else ""), _LONGEST)


def _robot(robot: RobotRow) -> tuple[State, tuple[str, ...]]:
    missing = {False: " (missing)", None: "", True: ""}[robot.device_exists]
    topics = "  ".join(_topics(robot.topics))
    report = _clean(robot.report, _LONGEST)
    details = "  ".join(part for part in (topics, f'"{report}"' if report else "", _commanded(robot)) if part)
    device = "" if robot.device_exists is None else f"{_clean(robot.device, _WIDEST)}{missing}"
    return robot.state, (f"  {robot.name}", robot.state.value, _driver(robot.driver), "", device, details)


def _program(program: ProgramRow) -> tuple[State, tuple[str, ...]]:
    state = program.state.value
    return program.state, (f"  {program.name}", state, _driver(program.unit), "", program.node, "program")


def _driver(unit: UnitSeen | None) -> str:
    if unit is None or unit.load == "not-found":
        return ""
    return "skipped" if unit.skipped else _clean(unit.sub or unit.active, _WIDEST)


def _topics(topics: Iterable[TopicRow]) -> Iterable[str]:
    """Each measured rate; that of the diagnostics only when it is low."""
    for topic in topics:
        low = topic.rate is not None and topic.rate < LOWEST_SHARE * topic.expected
        if topic.rate is not None and (low or topic.name != DIAGNOSTICS):
            name = _clean(topic.name.rpartition("/")[2], _WIDEST)
            yield f"{name} {topic.rate:.1f}{f' of {topic.expected:g}' if low else ''}"


def _commanded(robot: RobotRow) -> str:
    """The commander of the robot; without one, those that may command it."""
    if robot.commander not in ("", NOBODY):
        return f"commanded by {_clean(robot.commander, _LONGEST)}"
    return (
        f"waits for commands from {_clean(', '.join(robot.commanders), _LONGEST)}" if robot.commanders else ""
    )


def _sentence(finding: Finding) -> str:
    return f"{finding.check} {_clean(finding.subject)}: {_clean(finding.message)}"


def _clean(text: str, longest: int = _LONGEST) -> str:
    """Text from a host, safe for a terminal and cut to ``longest`` characters."""
    safe = printable(text)
    return safe if len(safe) <= longest else f"{safe[: longest - 3]}..."


def _many(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"
