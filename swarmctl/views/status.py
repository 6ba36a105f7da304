"""The health of a swarm as text: the summary, causes with their symptoms, then the table of its hosts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from rich.cells import cell_len
from rich.text import Text
from swarm_onboard.agent.systemd import UnitState

from swarmctl.health.checks.topic import LOWEST_SHARE
from swarmctl.health.root_cause import Finding
from swarmctl.health.swarm_health import BridgeRow, HostRow, ProgramRow, RobotRow, Status, TopicRow
from swarmctl.health.verdict import State, listed
from swarmctl.swarm.topics import DIAGNOSTICS
from swarmctl.views.equal_hosts import FEW, Names, grouped, in_ranges, merged, merged_behind
from swarmctl.views.escape import printable
from swarmctl.views.width import wrapped
from swarmctl.yamltext import hostlist

_HEADINGS = ("HOST / ROBOT", "STATE", "RELEASE / DRIVER", "UNITS", "MASTER / DEVICE", "TOPICS, Hz")
GLYPH = {State.OK: "✓", State.SKIPPED: "-", State.WARNING: "!", State.UNKNOWN: "?", State.BAD: "✗"}
STYLE = {
    State.OK: "green",
    State.SKIPPED: "dim",
    State.WARNING: "yellow",
    State.UNKNOWN: "magenta",
    State.BAD: "bold red",
}
NOBODY = "nobody"  # as a driver reports it
_WIDEST = 40  # columns of a cell that is not the last
_LONGEST = 200  # characters of a sentence from a host
_LONGEST_RANGE = 24  # columns of the names of equal hosts; longer ones become "20 hosts like tb3-01"
_LEAST_LAST = 24  # columns of the last cell beside the others; in fewer it stands below

_Row = tuple[State, tuple[str, ...]]


def table(hosts: Sequence[HostRow], *, details: bool = True, width: int | None = None) -> Text:
    """One row per host, below it one row per robot and program.

    Without ``details``, equal hosts together, and hosts without a release without robots and programs.
    """
    groups = [[host] for host in hosts] if details else _equal([_shortened(host) for host in hosts])
    rows = [row for group in groups for row in _merged_rows(group)]
    cells = [_HEADINGS, *(cells for _, cells in rows)]
    widths = [max(cell_len(one[column]) for one in cells) for column in range(len(_HEADINGS) - 1)]
    if width is not None and sum(widths) + 2 * (len(widths) - 1) > width:
        return Text("\n").join([*(_stacked(state, row, width) for state, row in rows), Text()])
    beside = sum(widths) + 2 * len(widths)
    below = width is not None and width - beside < _LEAST_LAST
    text = _line(_HEADINGS[:-1] if below else _HEADINGS, widths, width)
    text.stylize("bold")
    for state, row in rows:
        line = _line(row[:-1] if below else row, widths, width)
        line.stylize(STYLE[state], widths[0] + 2, widths[0] + 2 + len(row[1]))
        text.append("\n").append_text(line)
        if below and row[-1]:
            text.append("\n").append_text(wrapped(Text(f"    {row[-1]}"), width, 4))
    return text.append("\n")


def _shortened(host: HostRow) -> HostRow:
    """A host without a release has no robot or program that runs: its own row is enough."""
    return replace(host, robots=(), programs=()) if host.deployed is False else host


def names_of(host: HostRow) -> Names:
    """The names that a host's texts may have: its own, those of its robots and their namespaces."""
    return Names(
        host.name,
        host.address,
        tuple(one.name for one in host.robots),
        tuple(one.namespace for one in host.robots),
    )


def clean(text: str, longest: int = _LONGEST) -> str:
    """Text from a host, safe for a terminal and cut to ``longest`` characters."""
    safe = printable(text)
    return safe if len(safe) <= longest else f"{safe[: longest - 3]}..."


def many(count: int, word: str) -> str:
    """``1 host``, ``2 hosts``."""
    return f"{count} {word}{'' if count == 1 else 's'}"


def _equal(hosts: Sequence[HostRow]) -> list[list[HostRow]]:
    """The hosts, equal ones together if they are more than a few."""

    def pattern(host: HostRow) -> tuple[object, ...]:
        own = names_of(host)
        current = host.release == host.expected_release
        return current, *((state, *map(own.pattern_of, cells)) for state, cells in _rows(host))

    return grouped(hosts, pattern, alone=lambda group: len(group) <= FEW)


def _merged_rows(hosts: Sequence[HostRow]) -> Iterator[_Row]:
    """The rows of one host, or of equal hosts as if they were one."""
    if len(hosts) == 1:
        yield from _rows(hosts[0])
        return
    names = [names_of(host) for host in hosts]
    for index, rows in enumerate(zip(*map(_rows, hosts), strict=True)):
        columns = list(zip(*(cells for _, cells in rows), strict=True))
        first = in_ranges(columns[0], names)
        if first is None or cell_len(first) > _LONGEST_RANGE:
            indent, what = ("", "hosts") if index == 0 else ("  ", "robots")
            first = f"{indent}{len(hosts)} {what} like {columns[0][0].strip()}"
        others = [in_ranges(cells, names) for cells in columns[1:]]
        yield rows[0][0], (first, *("one each" if cell is None else cell for cell in others))


def _line(cells: Sequence[str], widths: Sequence[int], width: int | None) -> Text:
    """One row; its last cell is wrapped within its column."""
    front = [cell + " " * (size - cell_len(cell)) for cell, size in zip(cells, widths, strict=False)]
    text = Text("  ".join([*front, *cells[len(widths) :]]))
    text.rstrip()
    return wrapped(text, width, sum(widths) + 2 * len(widths))


def _stacked(state: State, row: Sequence[str], width: int) -> Text:
    """A row on a narrow terminal: name and state, below them everything else."""
    name, word, *others = row
    text = wrapped(Text.assemble(name, "  ", (word, STYLE[state])), width, 4)
    rest = "  ".join(filter(None, others))
    return text.append("\n").append_text(wrapped(Text(f"    {rest}"), width, 4)) if rest else text


def _rows(host: HostRow) -> Iterator[_Row]:
    yield _host(host)
    yield from (_robot(robot) for robot in host.robots)
    yield from (_program(program) for program in host.programs)


def _host(host: HostRow) -> tuple[State, tuple[str, ...]]:
    if not host.reachable:
        return host.state, (host.name, host.state.value, "no answer", "", "", "")
    if host.deployed is False:
        return host.state, (host.name, host.state.value, "none", "", "", "")
    skipped = sum(unit.skipped for unit in host.units.values())
    units = f"{host.units_running}/{host.units_expected}{f', {skipped} skipped' if skipped else ''}"
    return host.state, (
        host.name,
        host.state.value,
        clean(host.release or "none", _WIDEST),
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
    received = f"{len(bridges) - len(wrong)}/{many(len(bridges), 'topic')} of {islands}"
    return clean(f"receives {received}" + (f", not {', '.join(wrong)}" if wrong else ""), _LONGEST)


def _robot(robot: RobotRow) -> tuple[State, tuple[str, ...]]:
    missing = {False: " (missing)", None: "", True: ""}[robot.device_exists]
    topics = "  ".join(_topics(robot.topics))
    report = clean(robot.report, _LONGEST)
    details = "  ".join(part for part in (topics, f'"{report}"' if report else "", _commanded(robot)) if part)
    device = "" if robot.device_exists is None else f"{clean(robot.device, _WIDEST)}{missing}"
    return robot.state, (f"  {robot.name}", robot.state.value, _driver(robot.driver), "", device, details)


def _program(program: ProgramRow) -> tuple[State, tuple[str, ...]]:
    state = program.unit.text if program.unit is not None and program.unit.runs else ""
    details = "  ".join(["program", *_topics(program.topics), *([f'"{clean(state)}"'] if state else [])])
    node = clean(program.node, _WIDEST)
    return program.state, (f"  {program.name}", program.state.value, _driver(program.unit), "", node, details)


def _driver(unit: UnitState | None) -> str:
    if unit is None or unit.load == "not-found":
        return ""
    return "skipped" if unit.skipped else clean(unit.sub or unit.active, _WIDEST)


def _topics(topics: Iterable[TopicRow]) -> Iterable[str]:
    """Each measured rate; that of the diagnostics only when it is low.

    A topic without a declared rate is not measured, or may be silent for long, which is not a fault.
    """
    for topic in topics:
        low = topic.rate is not None and topic.rate < LOWEST_SHARE * topic.expected
        name = clean(topic.name.rpartition("/")[2], _WIDEST)
        if topic.name == DIAGNOSTICS and not low:
            continue
        if not topic.rate and not topic.expected:
            yield f"{name} -"
        elif topic.rate is not None:
            yield f"{name} {topic.rate:.1f}{f' of {topic.expected:g}' if low else ''}"


def _commanded(robot: RobotRow) -> str:
    """The commander of the robot; without one, those that may command it."""
    if robot.commander not in ("", NOBODY):
        return f"commanded by {clean(robot.commander, _LONGEST)}"
    return (
        f"waits for commands from {clean(', '.join(robot.commanders), _LONGEST)}" if robot.commanders else ""
    )


MOST_SYMPTOMS = 6  # shown under one cause


def status(
    shown: Status, *, details: bool = False, width: int | None = None, complete: Callable[[str], str] = str
) -> Text:
    """Summary, findings and table; equal hosts and equal causes together, unless with ``details``.

    ``complete`` writes the commands in hints as they can be typed.
    """
    view = _Findings(shown, details, width, complete)
    text = wrapped(summary(shown), width, 2).append("\n\n").append_text(view.text())
    text.append_text(table(shown.hosts, details=details, width=width))
    text.rstrip()
    return text


def line(cause: Finding) -> str:
    """A finding as its line in ``status`` begins, without the glyph: ``device k3: /dev/ttyUSB0 ...``."""
    return f"{cause.check} {clean(cause.subject)}: {clean(cause.message)}"


def summary(shown: Status) -> Text:
    """``newswarm is healthy: 3 hosts, 3 robots``, or how many causes make it unhealthy."""
    robots = sum(len(host.robots) for host in shown.hosts)
    size = f"{many(len(shown.hosts), 'host')}, {many(robots, 'robot')}"
    if shown.diagnosis.healthy:
        warnings = sum(cause.state is State.WARNING for cause, _ in shown.diagnosis.explained())
        noted = f", with {many(warnings, 'warning')}" if warnings else ""
        return Text.assemble(f"{shown.swarm} is ", ("healthy", "bold green"), f"{noted}: {size}")
    causes = {one.cause or one.key for one in shown.diagnosis.troubles}
    symptoms = sum(one.cause in causes for one in shown.diagnosis.findings)
    return Text.assemble(
        f"{shown.swarm} is ",
        ("unhealthy", "bold red"),
        f": {many(len(causes), 'cause')}, {many(symptoms, 'symptom')}; {size}",
    )


@dataclass(frozen=True)
class _Findings:
    """Every cause that is not ok, how to fix it, and its symptoms. Equal ones name all of their hosts."""

    shown: Status
    details: bool
    width: int | None
    complete: Callable[[str], str]

    @cached_property
    def _hosts(self) -> dict[str, Names]:
        return {host.name: names_of(host) for host in self.shown.hosts}

    def text(self) -> Text:
        text = Text()
        symptoms = dict(self.shown.causes())
        alone = [one for one in symptoms if one.state is State.SKIPPED and not symptoms[one]]
        skipped = {} if self.details else dict.fromkeys(alone)
        for causes in self._equal(cause for cause in symptoms if cause not in skipped):
            found = [symptom for cause in causes for symptom in symptoms[cause]]
            text.append_text(self._cause(causes, self._equal(found))).append("\n")
        if skipped:
            named = listed([f"{equal[0].check} {self._subject(equal)}" for equal in self._equal(skipped)])
            line = Text.assemble(("-", STYLE[State.SKIPPED]), f" skipped: {named}; --details shows why\n")
            text.append_text(wrapped(line, self.width, 4)).append("\n")
        return text

    def _equal(self, findings: Iterable[Finding]) -> list[list[Finding]]:
        return grouped(findings, lambda one: one.key if self.details else self._pattern(one))

    def _pattern(self, one: Finding) -> tuple[object, ...]:
        texts = (one.check, one.subject, one.message, one.hint)
        return one.state, *(self._own(one).pattern_of(clean(text)) for text in texts)

    def _own(self, one: Finding) -> Names:
        host = self._hosts.get(one.host, Names(one.host))
        return replace(host, robots=(one.robot,)) if one.robot else host

    def _cause(self, causes: Sequence[Finding], symptoms: Sequence[Sequence[Finding]]) -> Text:
        text = self._sentence(causes, "", "bold")
        if hint := self.complete(clean(causes[0].hint)):
            line = Text.assemble("    ", ("help", "bold green"), f": {hint}")
            text.append_text(wrapped(line, self.width, 10)).append("\n")
        most = len(symptoms) if self.details else MOST_SYMPTOMS
        if self.shown.is_bare(causes[0]) and not self.details:
            return text.append_text(self._elsewhere(symptoms, most))
        return text.append_text(self._symptoms(symptoms, most))

    def _elsewhere(self, symptoms: Sequence[Sequence[Finding]], most: int) -> Text:
        """The symptoms on hosts that have a release; those of the others are counted."""
        there = [[one for one in equal if one.host not in self.shown.bare] for equal in symptoms]
        text = self._symptoms([equal for equal in there if equal], most)
        hidden = sum(map(len, symptoms)) - sum(map(len, there))
        line = Text(f"    {many(hidden, 'symptom')} of that: --details lists them\n")
        return text.append_text(line) if hidden else text

    def _symptoms(self, symptoms: Sequence[Sequence[Finding]], most: int) -> Text:
        text = Text()
        for equal in symptoms[:most]:
            text.append_text(self._sentence(equal, "    ", ""))
        left = sum(map(len, symptoms[most:]))
        return text.append(f"    ... and {left} more\n" if left else "")

    def _subject(self, equal: Sequence[Finding]) -> str:
        """The subjects of equal findings; their robots or hosts where they differ in more than ranges."""
        ranges = in_ranges([clean(one.subject) for one in equal], [self._own(one) for one in equal])
        return ranges or hostlist.written(one.robot or one.host for one in equal)

    def _sentence(self, equal: Sequence[Finding], blanks: str, style: str) -> Text:
        """One sentence for equal findings; names that do not fit in it follow in a line of their own."""
        first, own = equal[0], [self._own(one) for one in equal]
        who = hostlist.written(one.robot or one.host for one in equal)
        messages = [clean(one.message) for one in equal]
        message = merged_behind(messages, own) if first.subject == first.host else merged(messages, own)
        line = Text.assemble(blanks, (GLYPH[first.state], STYLE[first.state]))
        line.append(f" {first.check} {self._subject(equal)}: {message}", style)
        text = wrapped(line, self.width, len(blanks) + 4).append("\n")
        if len(equal) > 1 and who not in line.plain:
            named = Text(f"{blanks}    {many(len(equal), 'time')}: {who}")
            text.append_text(wrapped(named, self.width, len(blanks) + 6)).append("\n")
        return text
