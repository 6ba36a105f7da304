"""What makes hosts fit, as text: a summary, then the steps of each host or of equal hosts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from rich.cells import cell_len
from rich.text import Text

from swarmctl.plan.host_preparation import HostPreparation, Kind
from swarmctl.plan.plan import Problem
from swarmctl.views.equal_hosts import Names, grouped, merged, merged_behind, notes
from swarmctl.views.escape import printable
from swarmctl.views.width import wrapped
from swarmctl.yamltext import hostlist

_WORDS = {
    Kind.ACCOUNT: "account",
    Kind.KEYS: "key",
    Kind.SUDO: "sudo rule",
    Kind.GROUP: "group",
    Kind.SOURCE: "package source",
    Kind.APT: "Debian package",
    Kind.PIP: "Python package",
    Kind.PULL: "container image",
    Kind.BUILD: "workspace",
    Kind.COMPILE: "ROS package to build",
}

_NARROWEST = 20  # columns for causes beside their targets; in fewer they stand below


@dataclass(frozen=True)
class PreparationView:
    """How preparations are shown: the ``names`` that hosts may differ in, all ``details`` or not, columns."""

    names: Mapping[str, Names] = field(default_factory=dict)
    width: int | None = None
    complete: Callable[[str], str] = str  # writes the commands in hints as they can be typed
    details: bool = False

    def text(self, hosts: Sequence[HostPreparation]) -> Text:
        """The summary, then the hosts that are not fit; those that lack the same share their lines."""
        text = self._line(summary(hosts))
        unfit = [host for host in hosts if not host.fit]
        for group in grouped(unfit, self._pattern, alone=lambda _: self.details):
            text.append("\n").append_text(self._hosts(group))
        fit = [host.host for host in hosts if host.fit]
        if fit and len(fit) < len(hosts):
            text.append_text(self._line(Text(f"\nfit: {hostlist.written(fit)}")))
        noted = [(host.host, note) for host in hosts for note in host.notes]
        shown = notes(noted, self.names, details=self.details, width=self.width, complete=self.complete)
        text.append("\n" if noted else "").append_text(shown)
        text.rstrip()
        return text

    def _pattern(self, host: HostPreparation) -> tuple[object, ...]:
        own = self._own(host)
        problems = [*host.lacks, *([host.problem] if host.problem else [])]
        kinds = (*(step.kind for step in host.steps), *(one.kind for one in problems))
        texts = (f"{step.target} {step.cause}" for step in host.steps)
        return kinds, *(
            own.pattern_of(printable(text)) for text in (*texts, *(one.message for one in problems))
        )

    def _own(self, host: HostPreparation) -> Names:
        return self.names.get(host.host) or Names(host.host)

    def _line(self, line: Text, indent: int = 4) -> Text:
        return wrapped(line, self.width, indent).append("\n")

    def _hosts(self, hosts: Sequence[HostPreparation]) -> Text:
        own = [self._own(host) for host in hosts]
        text = Text(hostlist.written(host.host for host in hosts), "bold")
        if hosts[0].problem:
            problems = [host.problem for host in hosts if host.problem]
            return self._problem(text.append("  "), problems, own)
        text = self._line(text)
        width = max((cell_len(printable(step.target)) for step in hosts[0].steps), default=0)
        beside = 15 + width if self.width is None or 15 + width + _NARROWEST <= self.width else 6
        for same in zip(*(host.steps for host in hosts), strict=True):
            cause = merged([printable(step.cause) for step in same], own)
            line = Text(f"  + {same[0].kind.value:<8} {printable(same[0].target):<{width}}", "green")
            text.append_text(self._line(line.append(f"  {cause}", "dim"), beside))
        for lacking in zip(*(host.lacks for host in hosts), strict=True):
            text.append_text(self._problem(Text("  ! "), lacking, own))
        return text

    def _problem(self, start: Text, problems: Sequence[Problem], own: Sequence[Names]) -> Text:
        message = merged_behind([printable(one.message) for one in problems], own)
        text = self._line(start.append(f"{problems[0].kind}: ", "bold red").append(message), 8)
        hint = self.complete(printable(problems[0].hint))
        return text.append_text(self._line(Text(f"  help: {hint}", "green"), 8)) if hint else text


def summary(hosts: Sequence[HostPreparation]) -> Text:
    """``prepare: 3 Debian packages, 1 group on 2 hosts``, or ``nothing to do``."""
    changing = [host for host in hosts if host.steps]
    counts = Counter(step.kind for host in changing for step in host.steps)
    counted = ", ".join(_many(counts[kind], word) for kind, word in _WORDS.items() if counts[kind])
    stuck = hostlist.written(host.host for host in hosts if host.lacks or host.problem)
    tail = f"; unfit all the same: {stuck}" if stuck else ""
    if not changing:
        return Text(f"nothing to do{tail}")
    return Text(f"prepare: {counted or 'lists of packages'} on {_many(len(changing), 'host')}{tail}")


def _many(count: int, word: str) -> str:
    return f"{count} {word}{'s' if count > 1 else ''}"
