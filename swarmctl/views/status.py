"""The health of a swarm as text: the summary, causes with their symptoms, then the table of its hosts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from rich.text import Text

from swarmctl.health.root_cause import Finding
from swarmctl.health.swarm_health import Status
from swarmctl.health.verdict import State, listed
from swarmctl.views import status_table
from swarmctl.views.equal_hosts import Names, grouped, in_ranges, merged, merged_behind
from swarmctl.views.status_table import GLYPH, STYLE, clean, many
from swarmctl.views.width import wrapped
from swarmctl.yamltext import hostlist

MOST_SYMPTOMS = 6  # shown under one cause


def status(
    shown: Status, *, details: bool = False, width: int | None = None, complete: Callable[[str], str] = str
) -> Text:
    """Summary, findings and table; equal hosts and equal causes together, unless with ``details``.

    ``complete`` writes the commands in hints as they can be typed.
    """
    view = _Findings(shown, details, width, complete)
    text = wrapped(summary(shown), width, 2).append("\n\n").append_text(view.text())
    text.append_text(status_table.table(shown.hosts, details=details, width=width))
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
        return {host.name: status_table.names_of(host) for host in self.shown.hosts}

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
