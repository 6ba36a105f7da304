"""The fixes of findings, applied round by round: texts in, texts out.

A mended text shows what its errors hid, so it is looked at again until nothing is left to fix. Nothing is
kept that makes a spec worse. How texts are looked at, and where they come from, the caller says.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from swarmctl.spec.diagnostics import Diagnostic, Edit, Fix, has_errors
from swarmctl.spec.edits import apply

ROUNDS = 10
MOST_ALONE = 50  # fixes that are tried one by one where all together did harm; each try checks the whole spec

Texts = Mapping[str, str]  # by file


class Stage(IntEnum):
    """How far a spec can be looked at: what is wrong at one stage hides what the next would find."""

    TEXT = 0
    VOCABULARY = 1
    NAMES = 2
    SENSE = 3


@dataclass(frozen=True)
class Findings:
    """All that was found in a spec, up to the stage that has errors."""

    stage: Stage
    diagnostics: tuple[Diagnostic, ...]


@dataclass(frozen=True)
class Fixed:
    """The files that differ, as they should be, and the findings whose fixes are in them."""

    texts: Texts
    made: tuple[Diagnostic, ...]


def fixed(look: Callable[[Texts], Findings], original: Callable[[str], str]) -> Fixed:
    """Apply every fix that can be. ``look`` takes the texts that differ, ``original`` has all of them."""
    texts: Texts = {}
    made: list[Diagnostic] = []
    found = look(texts)
    for _ in range(ROUNDS):
        for some in _attempts(found.diagnostics):
            tried = {**texts, **_applied(some, texts, original)}
            after = look(tried)
            if _is_better(after, found):
                break
        else:
            return Fixed(texts, tuple(made))
        texts, found, made = tried, after, [*made, *some]
    return Fixed(texts, tuple(made))


def _attempts(diagnostics: Sequence[Diagnostic]) -> Iterator[list[Diagnostic]]:
    """All fixes that can be applied together, and then each alone, as one of them may do harm."""
    fixable: dict[Fix, Diagnostic] = {}
    for found in diagnostics:
        if found.fix is not None:
            fixable.setdefault(found.fix, found)
    together = [fixable[fix] for fix in _compatible(tuple(fixable))]
    yield together
    if 1 < len(together) <= MOST_ALONE:
        yield from ([one] for one in together)


def _compatible(fixes: Sequence[Fix]) -> list[Fix]:
    """``fixes`` without those that would change the same text as another; additions go together."""
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
    """Whether a spec got better. A key that is right shows what is wrong with its value, another error."""
    if after.stage is not before.stage:
        return after.stage > before.stage
    if after.stage is Stage.VOCABULARY:
        return _messages(after) != _messages(before)
    return _weight(after) < _weight(before)


def _messages(found: Findings) -> set[str]:
    return {one.message for one in found.diagnostics}


def _weight(found: Findings) -> tuple[int, int]:
    errors = sum(has_errors([one]) for one in found.diagnostics)
    return errors, len(found.diagnostics)
