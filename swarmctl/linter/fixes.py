"""Applies the fixes of findings in rounds: texts in, texts out.

Fixing one error may reveal others, so the text is checked again until no fix is left. A fix that makes the
spec worse is not kept. The caller provides the check and the texts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import NamedTuple

from swarmctl.diagnostics import Diagnostic, Edit, Fix, Span, has_errors
from swarmctl.yamltext.edits import apply
from swarmctl.yamltext.files import MAX_FIXABLE

_ROUNDS = 10
_MOST_CHECKED = 1_000_000  # characters that all tries together check again
_MOST_CHECKS, _LEAST_CHECKS = 200, 3

Texts = Mapping[str, str]  # by file


class Stage(IntEnum):
    """How far a spec is right: the first stage of a check that has errors."""

    TEXT = 0
    FORMAT = 1
    NAMES = 2
    RULES = 3


@dataclass(frozen=True)
class Findings:
    """The findings in a spec, and the first stage that has errors."""

    stage: Stage
    diagnostics: tuple[Diagnostic, ...]


@dataclass(frozen=True)
class Fixed:
    """The new texts of the files that changed, the findings whose fixes they contain, and those left."""

    texts: Texts
    made: tuple[Diagnostic, ...]
    left: tuple[Diagnostic, ...]

    def behind(self, found: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
        """Yields what is left on lines that no fix changes, without what was ``found`` before the fixes."""
        edits = [edit for one in self.made if one.fix for edit in one.fix.edits]
        if any("\n" in edit.text or edit.span.line != edit.span.end_line for edit in edits):
            return  # other lines have other numbers
        known = {(one.code, one.span) for one in found}
        changed = {(edit.span.file, edit.span.line) for edit in edits}

        def changes(*spans: Span) -> bool:
            return any((span.file, span.line) in changed for span in spans)

        for one in self.left:
            if one.span is not None and (one.code, one.span) not in known and not changes(one.span):
                stays = one.fix is not None and not changes(*(edit.span for edit in one.fix.edits))
                yield one if stays else replace(one, fix=None)


@dataclass(frozen=True)
class Fixable:
    """What ``--fix`` and ``--unsafe-fixes`` do to a spec: the second makes all fixes of the first, too."""

    safe: Fixed
    all: Fixed


def fixable(
    lint: Callable[[Texts], Findings], original: Callable[[str], str], found: Findings | None = None
) -> Fixable:
    """Tries the fixes of a spec in memory: first the safe ones, then the others as well.

    ``lint`` checks the spec with the changed texts it receives; ``original`` returns the text of a file.
    ``found`` is what is wrong without changes; without it, ``lint`` says so.
    """
    fixer = _Fixer(lint, original, found or lint({}))
    safe = fixer.improved(unsafe=False)
    return Fixable(safe, fixer.improved(unsafe=True))


class _State(NamedTuple):
    """A spec with some of its fixes, and the findings that are left."""

    texts: Texts
    made: tuple[Diagnostic, ...]
    found: Findings


class _Fixer:
    """Applies fixes; each state is better than the one before."""

    def __init__(
        self, lint: Callable[[Texts], Findings], original: Callable[[str], str], found: Findings
    ) -> None:
        self._lint, self._original = lint, original
        self._state = _State({}, (), found)
        offered = [one.fix for one in found.diagnostics if one.fix is not None]
        size = sum(len(original(file)) for file in {edit.span.file for fix in offered for edit in fix.edits})
        self._checks = max(_LEAST_CHECKS, min(_MOST_CHECKS, _MOST_CHECKED // max(size, 1)))

    def improved(self, *, unsafe: bool) -> Fixed:
        """Applies all fixes that improve the spec, and those of findings that appear then."""
        for _ in range(_ROUNDS):
            together = self._offered(unsafe=unsafe)
            after = self._with(together) or self._with_each(together)
            if after is None:
                break
            self._state = after
        return Fixed(self._state.texts, self._state.made, self._state.found.diagnostics)

    def _offered(self, *, unsafe: bool) -> list[Diagnostic]:
        """Returns findings whose fixes can be applied together."""
        fixes: dict[Fix, Diagnostic] = {}
        for found in self._state.found.diagnostics:
            if found.fix is not None and (unsafe or found.fix.safe) and self._is_small(found.fix):
                fixes.setdefault(found.fix, found)
        return [fixes[fix] for fix in _compatible(tuple(fixes))]

    def _is_small(self, fix: Fix) -> bool:
        return all(len(self._original(edit.span.file)) <= MAX_FIXABLE for edit in fix.edits)

    def _with_each(self, together: Sequence[Diagnostic]) -> _State | None:
        """Adds fixes one after the other, without those that make the spec worse."""
        kept: list[Diagnostic] = []
        state = None
        for one in together if len(together) > 1 else ():
            if (after := self._with([*kept, one], (state or self._state).found)) is not None:
                kept.append(one)
                state = after
        return state

    def _with(self, some: Sequence[Diagnostic], before: Findings | None = None) -> _State | None:
        """Returns the spec with some fixes more, or None if it is not better than ``before``."""
        if not some or self._checks <= 0:
            return None
        self._checks -= 1
        texts = {**self._state.texts, **_applied(some, self._state.texts, self._original)}
        after = self._lint(texts)
        better = _is_better(after, before or self._state.found)
        return _State(texts, (*self._state.made, *some), after) if better else None


def _compatible(fixes: Sequence[Fix]) -> list[Fix]:
    """Returns ``fixes`` without those that change the same text as another; insertions are compatible."""
    edits = sorted(
        ((edit, number) for number, fix in enumerate(fixes) for edit in fix.edits),
        key=lambda one: (one[0].span, one[1]),
    )
    dropped: set[int] = set()
    last: tuple[Edit, int] | None = None
    for edit, number in edits:
        if number in dropped:
            continue
        if last is not None and last[1] != number and _collide(last[0], edit):
            dropped.add(number)
        elif last is None or last[0].span.file != edit.span.file or _end(last[0]) <= _end(edit):
            last = edit, number
    return [fix for number, fix in enumerate(fixes) if number not in dropped]


def _collide(first: Edit, second: Edit) -> bool:
    if first.span.file != second.span.file:
        return False
    return first == second or (second.span.line, second.span.column) < _end(first)


def _end(edit: Edit) -> tuple[int, int]:
    return edit.span.end_line, edit.span.end_column


def _applied(diagnostics: Iterable[Diagnostic], texts: Texts, original: Callable[[str], str]) -> Texts:
    edits: dict[str, list[Edit]] = {}
    for found in diagnostics:
        for edit in found.fix.edits if found.fix else ():
            edits.setdefault(edit.span.file, []).append(edit)
    return {
        file: apply(texts[file] if file in texts else original(file), some) for file, some in edits.items()
    }


def _is_better(after: Findings, before: Findings) -> bool:
    """True if the spec improved. At stage FORMAT, a corrected key may reveal an error in its value."""
    if after.stage is not before.stage:
        return after.stage > before.stage
    if after.stage is Stage.FORMAT:
        return _messages(after) != _messages(before)
    return _weight(after) < _weight(before)


def _messages(found: Findings) -> set[str]:
    return {one.message for one in found.diagnostics}


def _weight(found: Findings) -> tuple[int, int]:
    errors = sum(has_errors([one]) for one in found.diagnostics)
    return errors, len(found.diagnostics)
