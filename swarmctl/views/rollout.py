"""The report of a rollout as text: failures first, then the results of each host or of equal hosts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from rich.text import Text

from swarmctl.deploy.outcome import Outcome, Result
from swarmctl.remote.transport import HostError, Kind
from swarmctl.views.equal_hosts import FEW, Names, grouped, merged_behind, notes
from swarmctl.views.escape import printable
from swarmctl.views.progress import verdict
from swarmctl.views.width import wrapped
from swarmctl.yamltext import hostlist

_Named = tuple[str, Result]


@dataclass(frozen=True)
class RolloutView:
    """How a report is shown: the ``names`` that hosts may differ in, all ``details`` or not, columns."""

    names: Mapping[str, Names] = field(default_factory=dict)
    details: bool = False
    width: int | None = None
    complete: Callable[[str], str] = str  # writes the commands in hints as they can be typed

    def text(self, found: Mapping[str, Result], absent: Sequence[str] = ()) -> Text:
        """The hosts, failures first, then notes and the summary; ``absent``: unreachable optional hosts."""
        failed = [one for one in found.items() if isinstance(one[1], HostError)]
        last = (*absent, *(name for name, error in failed if _held(error)))
        failed.sort(key=lambda one: one[0] in last)
        text = self.failures(dict(failed))
        for group in self._equal([one for one in found.items() if not isinstance(one[1], HostError)]):
            text.append_text(self._line(self._done(group)))
        done = [(name, result) for name, result in found.items() if isinstance(result, Outcome)]
        noted = [(name, note) for name, result in done for note in (*result.errors, *result.plan.notes)]
        text.append_text(
            notes(noted, self.names, details=self.details, width=self.width, complete=self.complete)
        )
        return text.append_text(wrapped(Text(summary(found, absent)), self.width, 2))

    def failures(self, failed: Mapping[str, Result]) -> Text:
        """The errors with their hints; equal ones name all of their hosts."""
        return Text().join(self._failure(group) for group in self._equal(list(failed.items())))

    def _equal(self, hosts: Sequence[_Named]) -> list[list[_Named]]:
        """Hosts of the same result together if they are more than a few, and all of the same failure."""
        return grouped(
            hosts,
            self._pattern,
            alone=lambda group: (
                self.details or (len(group) <= FEW and not isinstance(group[0][1], HostError))
            ),
        )

    def _pattern(self, host: _Named) -> tuple[str, ...]:
        name, result = host
        own = self._own(name)
        hint = result.hint if isinstance(result, HostError) else ""
        kind = "" if isinstance(result, HostError) or not result.changed else own.kind
        return (
            kind,
            own.pattern_of(verdict(result, details=self.details).plain),
            own.pattern_of(printable(hint)),
        )

    def _own(self, host: str) -> Names:
        return self.names.get(host) or Names(host)

    def _line(self, line: Text, indent: int = 4) -> Text:
        return wrapped(line, self.width, indent).append("\n")

    def _failure(self, group: Sequence[_Named]) -> Text:
        errors = [error for _, error in group if isinstance(error, HostError)]
        own = [self._own(name) for name, _ in group]
        message = merged_behind([printable(one.message) for one in errors], own)
        kind = (f"  {errors[0].kind.value}: ", "bold red")
        listed = _listed(group)
        text = self._line(Text.assemble((listed, "bold"), kind, message))
        hint = self.complete(printable(errors[0].hint))
        start = Text.assemble("  ", ("help", "bold green"), ": ")
        return text.append_text(self._line(start.append(hint), 8)) if hint else text

    def _done(self, group: Sequence[_Named]) -> Text:
        first, result = group[0]
        assert not isinstance(result, HostError)  # failures have lines of their own
        like = f"{len(group)} hosts like {first}: " if len(group) > 1 and result.changed else ""
        return Text.assemble((_listed(group), "bold"), f"  {like}", verdict(result, details=self.details))


def summary(found: Mapping[str, Result], absent: Sequence[str] = ()) -> str:
    """The numbers of hosts in one sentence, with the names of those that were not changed."""
    errors = {name: result for name, result in found.items() if isinstance(result, HostError)}
    held = [name for name, error in errors.items() if _held(error)]
    failed = {name: error for name, error in errors.items() if name not in (*absent, *held)}
    changed = sum(not isinstance(result, HostError) and result.changed for result in found.values())
    text = f"{changed} of {len(found)} hosts changed"
    if absent:
        text += f"; optional and unreachable: {hostlist.written(absent)}"
    if held:
        text += f"; held back: {hostlist.written(held)}"
    if failed:
        text += f"; failed: {hostlist.written(failed)}"
    if any(error.retryable for error in failed.values()):
        text += "; run the same command again when these hosts are reachable"
    return text


def _held(result: Result) -> bool:
    return isinstance(result, HostError) and result.kind is Kind.HELD


def _listed(group: Sequence[_Named]) -> str:
    return hostlist.written(name for name, _ in group)
