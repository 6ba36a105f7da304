"""Applies the fixes of findings in rounds: texts in, texts out.

Fixing one error may reveal others, so the text is checked again until no fix is left. A fix that makes the
spec worse is not kept. The caller provides the check and the texts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from swarmctl.diagnostics import Diagnostic, Edit, Fix, has_errors
from swarmctl.yamltext.edits import apply

ROUNDS = 10
MOST_ALONE = 50  # fixes tried one by one if all together make the spec worse; each try checks the whole spec

Texts = Mapping[str, str]  # by file


class Stage(IntEnum):
    """The stages of a check; errors at one stage prevent the next one from running."""

    TEXT = 0
    FORMAT = 1
    NAMES = 2
    RULES = 3


@dataclass(frozen=True)
class Findings:
    """The findings in a spec, up to the first stage that has errors."""

    stage: Stage
    diagnostics: tuple[Diagnostic, ...]


@dataclass(frozen=True)
class Fixed:
    """The new texts of the files that changed, and the findings whose fixes they contain."""

    texts: Texts
    made: tuple[Diagnostic, ...]


def apply_fixes(lint: Callable[[Texts], Findings], original: Callable[[str], str]) -> Fixed:
    """Applies all fixes that improve the spec.

    ``lint`` checks the spec with the changed texts it receives; ``original`` returns the text of a file.
    """
    texts: Texts = {}
    made: list[Diagnostic] = []
    found = lint(texts)
    for _ in range(ROUNDS):
        for some in _attempts(found.diagnostics):
            tried = {**texts, **_applied(some, texts, original)}
            after = lint(tried)
            if _is_better(after, found):
                break
        else:
            return Fixed(texts, tuple(made))
        texts, found, made = tried, after, [*made, *some]
    return Fixed(texts, tuple(made))


def _attempts(diagnostics: Sequence[Diagnostic]) -> Iterator[list[Diagnostic]]:
    """Yields all compatible fixes together, then each one alone, since one may make the spec worse."""
    fixable: dict[Fix, Diagnostic] = {}
    for found in diagnostics:
        if found.fix is not None:
            fixable.setdefault(found.fix, found)
    together = [fixable[fix] for fix in _compatible(tuple(fixable))]
    yield together
    if 1 < len(together) <= MOST_ALONE:
        yield from ([one] for one in together)


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
