"""What `validate` and `--fix` make of a defect."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache
from pathlib import Path

from swarmctl.diagnostics import Diagnostic, Span, has_errors
from swarmctl.linter.fixes import Findings, Texts, fixable
from swarmctl.render.build_bundle import bundles
from swarmctl.spec.load import load
from swarmctl.swarm.resolve import resolve
from swarmctl.yamltext.files import Read, content
from tests.loading import lint_files
from tests.mutations.defects import Base, Defect

from . import (  # noqa: F401  they fill the registry
    mistakes_across,
    mistakes_of_spelling,
    mistakes_of_structure,
    mistakes_of_value,
)


class Outcome(Enum):
    """What the fixes that are certain made of the spec."""

    NONE = "no fix, or errors are left"
    ORIGINAL = "the original text"
    EQUAL = "another text whose hosts get the same files"
    OTHER = "a valid spec whose hosts get other files"


@dataclass(frozen=True)
class Verdict:
    """What came of one defect."""

    defect: Defect
    found: tuple[Diagnostic, ...]  # that the correct spec does not have
    at_the_line: bool
    after: Outcome  # of the fixes that are certain


def judged(defect: Defect) -> Verdict:
    """Checks and fixes the files of a defect."""
    path = defect.file.path
    texts = {str(path): defect.change.text}
    before = {(one.code, one.message) for one in clean(defect.base)}
    result = lint(defect.base, texts)
    found = tuple(one for one in result.diagnostics if (one.code, one.message) not in before)
    at_the_line = any(_fits(span, defect) for one in found for span in _spans(one))
    return Verdict(defect, found, at_the_line, _outcome(defect, found, texts))


def _outcome(defect: Defect, found: Sequence[Diagnostic], texts: Texts) -> Outcome:
    after = _fixed(defect, texts) if any(one.fix for one in found) else defect.change.text
    if after == defect.file.text:
        return Outcome.ORIGINAL
    rendered = None if after == defect.change.text else _digests(defect.base, {str(defect.file.path): after})
    if rendered is None:
        return Outcome.NONE
    return Outcome.EQUAL if rendered == _clean_digests(defect.base) else Outcome.OTHER


@cache
def clean(base: Base) -> tuple[Diagnostic, ...]:
    """Returns the findings of the correct spec, which are warnings at most."""
    return lint(base, {}).diagnostics


def _reader(base: Base, texts: Texts) -> Read:
    changed = {str(file.path): file.text for file in base.files} | dict(texts)

    def read(path: Path) -> bytes:
        known = changed.get(str(path))
        return content(path) if known is None else known.encode()

    return read


def lint(base: Base, texts: Texts) -> Findings:
    """Checks a base with other texts of some files."""
    return lint_files(base.layers, _reader(base, texts))


def _digests(base: Base, texts: Texts) -> Mapping[str, str] | None:
    """Returns what each host would get, by its digest; None if the spec has errors."""
    if has_errors(lint(base, texts).diagnostics):
        return None
    document, _ = load(base.layers, _reader(base, texts))
    assert document is not None
    return {host: bundle.digest for host, bundle in bundles(resolve(document)).items()}


@cache
def _clean_digests(base: Base) -> Mapping[str, str] | None:
    return _digests(base, {})


def _fixed(defect: Defect, texts: Texts) -> str:
    path = str(defect.file.path)
    read = _reader(defect.base, texts)
    done = fixable(lambda some: lint(defect.base, {**texts, **some}), lambda file: read(Path(file)).decode())
    return done.safe.texts.get(path, defect.change.text)


def _spans(found: Diagnostic) -> Iterable[Span]:
    return [*([found.span] if found.span else []), *(note.span for note in found.notes)]


def _fits(span: Span, defect: Defect) -> bool:
    texts = {str(file.path): file.text for file in defect.base.files} | {
        str(defect.file.path): defect.change.text
    }
    lines = range(span.line, max(span.end_line, span.line) + 1)
    if span.file == str(defect.file.path) and defect.change.lines.intersection(lines):
        return True
    shown = texts[span.file].splitlines()[span.line - 1 : lines.stop - 1] if span.file in texts else []
    return any(word in line for word in defect.change.words for line in shown)
