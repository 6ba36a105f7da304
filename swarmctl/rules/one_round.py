"""All findings of a spec with errors at once: what holds however its errors are repaired.

The spec is repaired in several ways, and the rules check each result. A finding that follows from an error is
not in all of them: with another name, or without the key, it would not be there. The rest is certain.
What a file that cannot be read may have is added; what only that file can show is not reported.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import islice

from swarmctl.diagnostics import Diagnostic, in_order, without_echoes
from swarmctl.rules.context import Rule, RuleContext
from swarmctl.rules.name_repairs import name_faults
from swarmctl.rules.suppressions import apply_suppressions
from swarmctl.rules.unread_parts import SHOWN_BY_ALL_FILES, absent_sections, certain
from swarmctl.spec.load import Document, Draft, document_of, homeless_codecs
from swarmctl.spec.model import Spec
from swarmctl.spec.recovery import MOST_FAULTS, Repair, repaired_catalog
from swarmctl.yamltext.limits import MAX_FINDINGS

_MOST_REPAIRS = 6
_CHARACTERS = 1_500_000  # of the spec, together in all repairs: 10 000 robots are repaired in two ways
_ROUNDS = 4  # a repaired name may lead to another


@dataclass(frozen=True)
class _Repaired:
    """What is found in a spec that was repaired in one way."""

    document: Document | None
    found: tuple[Diagnostic, ...]
    ways: int  # in how many ways it can be repaired


def all_at_once(draft: Draft, rules: Sequence[Rule]) -> tuple[Diagnostic, ...]:
    """Returns the findings of a draft that has errors."""
    if not draft.is_readable:
        return in_order(document_of(draft)[1])
    first = _repaired(draft, rules, 0)
    size = sum(map(len, draft.texts.values()))
    count = min(first.ways, _MOST_REPAIRS, max(2, _CHARACTERS // size))
    others = (_repaired(draft, rules, number) for number in range(1, count))
    own = [one for one in draft.diagnostics if draft.is_complete or one.code not in SHOWN_BY_ALL_FILES]
    found = without_echoes([*own, *_in_all(first, others)])
    if first.document is not None:
        kept = apply_suppressions(found, first.document, draft.texts)
        found = [one for one in kept if one.code != "SIL001"]  # it may suppress what cannot be found yet
    return in_order(found)


def _repaired(draft: Draft, rules: Sequence[Rule], number: int) -> _Repaired:
    assert draft.root is not None
    repair = Repair(
        Spec, draft.root, draft.path, draft.texts, number, complete=draft.is_complete, trees=draft.trees
    )
    repair.mark(draft.diagnostics)
    if not draft.is_complete:
        repair.change(absent_sections(draft.root))
    catalog, of_types = repaired_catalog(draft.catalog, number)
    spec, source = repair.value()
    document, unread = None, set[str]()
    for _ in range(_ROUNDS):
        if spec is None:
            break
        document = draft.document(spec, source, catalog)
        note = repair.lose if repair.whole else lambda _, name: unread.add(name)
        faults = list(islice(name_faults(document, note, whole=repair.whole), MOST_FAULTS + 1))
        repair.report(_found(document, rules, names=True, unread=None if repair.whole else unread))
        if not faults:
            repair.report(homeless_codecs(spec, source))
            repair.report(_found(document, rules, names=False, unread=None if repair.whole else unread))
            break
        if len(faults) > MOST_FAULTS or not repair.change(faults):
            break
        spec, source = repair.value()
    return _Repaired(document, (*of_types, *repair.found.elements()), repair.most_ways)


def _found(
    document: Document, rules: Sequence[Rule], *, names: bool, unread: Collection[str] | None
) -> Iterable[Diagnostic]:
    """Returns what rules find; of ``unread`` names the entries are in a file that could not be read."""
    context = RuleContext(document)
    found = [one for rule in rules if rule.names is names for one in islice(rule(context), MAX_FINDINGS)]
    return found if unread is None else certain(found, unread)


def _in_all(first: _Repaired, others: Iterable[_Repaired]) -> list[Diagnostic]:
    """Returns what is found in all repairs; of its help, notes and fix, what all agree on.

    Takes no more of ``others`` once nothing is left.
    """
    certain, others = list(first.found), iter(others)
    while certain and (other := next(others, None)) is not None:
        known = {_key(one): one for one in other.found}
        certain = [_agreed(found, known[_key(found)]) for found in certain if _key(found) in known]
    return certain


def _agreed(found: Diagnostic, other: Diagnostic) -> Diagnostic:
    """Returns a finding with the help, notes and fix that it has in two repairs."""
    return replace(
        found,
        label=found.label if other.label == found.label else "",
        notes=tuple(note for note in found.notes if note in other.notes),
        help=tuple(text for text in found.help if text in other.help),
        fix=found.fix if other.fix == found.fix else None,
    )


def _key(found: Diagnostic) -> tuple[object, ...]:
    return found.code, found.span, found.severity, found.message
