"""The findings in one or more specs, as the value that every format renders."""

from __future__ import annotations

import hashlib
import os.path
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.rulebook import RuleText, Severity
from swarmctl.spec.load import Document


@dataclass(frozen=True)
class Checked:
    """One spec, as it was named on the command line; without errors there is a document.

    ``fixable`` counts the fixes that ``--fix`` makes, ``more_fixable`` those that ``--unsafe-fixes`` adds.
    """

    spec: str
    document: Document | None
    diagnostics: tuple[Diagnostic, ...] = ()
    fixable: int = 0
    more_fixable: int = 0


@dataclass(frozen=True)
class Report:
    """All specs of one run. With ``strict``, warnings fail as well; ``rules`` are known by their code."""

    checked: tuple[Checked, ...]
    strict: bool = False
    rules: Mapping[str, RuleText] = field(default_factory=dict)

    def passes(self, one: Checked) -> bool:
        """Returns True if the spec was read and none of its findings fails it."""
        return one.document is not None and not any(map(self.fails, one.diagnostics))

    def fails(self, found: Diagnostic) -> bool:
        """Returns True if the finding fails its spec: an error, or with ``strict`` any finding."""
        return self.strict or found.severity is Severity.ERROR

    @property
    def passed(self) -> bool:
        """True if all specs pass."""
        return all(map(self.passes, self.checked))

    @property
    def findings(self) -> Iterator[tuple[Checked, Diagnostic]]:
        """Every finding, with the spec it was found in."""
        return ((one, found) for one in self.checked for found in one.diagnostics)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The findings of all specs."""
        return tuple(found for _, found in self.findings)


def counted(diagnostics: Sequence[Diagnostic]) -> str:
    """``2 errors, 1 warning``."""
    counts = Counter(found.severity for found in diagnostics)
    return ", ".join(_many(counts[severity], severity.value) for severity in Severity if counts[severity])


def fixes_in(checked: Sequence[Checked]) -> str:
    """``3 fixable with validate --fix, 1 more with --unsafe-fixes``; the empty text without any."""
    safe, more = sum(one.fixable for one in checked), sum(one.more_fixable for one in checked)
    if not safe:
        return f"{more} fixable with validate --unsafe-fixes" if more else ""
    return f"{safe} fixable with validate --fix{f', {more} more with --unsafe-fixes' if more else ''}"


def outcome(report: Report) -> str:
    """Returns one line without text from specs: ``2 errors, 1 warning in 3 specs``."""
    specs, fixes = _many(len(report.checked), "spec"), fixes_in(report.checked)
    return f"{counted(report.diagnostics) or 'no findings'} in {specs}{f' ({fixes})' if fixes else ''}"


def sentence(found: Diagnostic) -> str:
    """Returns the message and the label in one sentence, for formats without a source excerpt."""
    return f"{found.message}: {found.label}" if found.label else found.message


def more(found: Diagnostic) -> Iterator[str]:
    """Yields the notes of a finding, and the ways to fix it."""
    yield from (f"{note.span}: {note.text}" for note in found.notes)
    yield from (f"{what}: {line}" for what, line in remedies(found))


def remedies(found: Diagnostic) -> Iterator[tuple[str, str]]:
    """Yields the lines of help, then the fix that a program can apply, each with the word for what it is."""
    fix = found.fix
    yield from (("help", line) for line in found.help if fix is None or line != fix.title)
    if fix is not None:
        yield ("fix" if fix.safe else "unsafe fix", fix.title)


def ways_to_fix(found: Diagnostic) -> str:
    """Returns the ways to fix a finding in one line."""
    return "; ".join(line if what == "help" else f"{what}: {line}" for what, line in remedies(found))


def place(one: Checked, found: Diagnostic) -> str:
    """``swarm.yaml:9:3``, or the spec where the finding has no place in a text."""
    return str(found.span) if found.span else one.spec


def file_of(one: Checked, found: Diagnostic) -> str:
    """Returns the file of a finding; the spec itself if the finding has no position."""
    return found.span.file if found.span else one.spec


def fingerprints(report: Report) -> list[str]:
    """A name for each finding that stays when lines move: of its code, file and message, and its number
    among those that are equal in these."""
    seen: Counter[tuple[str, str, str]] = Counter()
    names = []
    for one, found in report.findings:
        key = (found.code, file_of(one, found), found.message)
        seen[key] += 1
        text = "\0".join((*key, str(seen[key])))
        names.append(hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest())
    return names


def relative(report: Report, folder: str, base: str) -> Report:
    """The same with the paths of files below ``base`` relative to it and the others absolute.

    Paths in the report are relative to ``folder``; both folders are absolute.
    """

    def path(file: str) -> str:
        whole = os.path.normpath(os.path.join(folder, file))  # noqa: PTH118  (pathlib drops no `..`)
        inside = os.path.commonpath((base, whole)) == base and whole != base
        return os.path.relpath(whole, base) if inside else whole

    def moved(span: Span) -> Span:
        return replace(span, file=path(span.file))

    def at_base(found: Diagnostic) -> Diagnostic:
        fix = found.fix and replace(
            found.fix, edits=tuple(replace(edit, span=moved(edit.span)) for edit in found.fix.edits)
        )
        return replace(
            found,
            span=found.span and moved(found.span),
            notes=tuple(replace(note, span=moved(note.span)) for note in found.notes),
            fix=fix,
        )

    return replace(
        report,
        checked=tuple(
            replace(one, spec=path(one.spec), diagnostics=tuple(map(at_base, one.diagnostics)))
            for one in report.checked
        ),
    )


def _many(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"
